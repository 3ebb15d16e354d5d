"""Where the files of a campaign are in a folder of results."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rrru.figures.files import figure_paths
from rrru.pipeline.config import corrected_kind
from rrru.pipeline.jobs.outputs import (
    CAMPAIGN_FIGURES,
    CAMPAIGN_TABLES,
    GAP_FIGURES,
    GAP_TABLES,
    READ_TABLES,
    part_path,
)


def result_paths(folder: str | Path, name: str, config: Mapping[str, Any]) -> dict[str, str]:
    """Paths of all files of a campaign in a folder of results, as the workflow has them."""
    named = (*READ_TABLES, *CAMPAIGN_TABLES, *GAP_TABLES, "gap_points", "corrected_drives")
    kind = corrected_kind(config, config["campaigns"][name])
    return {
        **{table: part_path(folder, name, table) for table in named},
        **figure_paths(f"{folder}/figures/{name}", {**CAMPAIGN_FIGURES, **GAP_FIGURES}),
        "timings": f"{folder}/timings/{name}.parquet",
        "verdict": f"{folder}/campaigns/{name}/verdict.json",
        "robot": f"{folder}/campaigns/{name}/robot.json",
        **({"corrected": f"{folder}/campaigns/{name}/corrected.{kind}"} if kind else {}),
    }
