"""All results of a campaign that need no diagnosis: its tables, calibrations, their errors, and their figures."""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from rrru.figures.drawing import draw_all
from rrru.pipeline import config as parts
from rrru.pipeline.jobs import calibrate, compensate, genetic, read
from rrru.pipeline.jobs.outputs import CAMPAIGN_FIGURES
from rrru.pipeline.result_paths import result_paths


def write(
    config: Mapping[str, Any],
    name: str,
    frames: Mapping[str, pd.DataFrame],
    folder: str | Path,
    kinds: Collection[str],
) -> dict[str, str]:
    """Write a campaign's tables, calibrations, their errors and figures into a folder of results; returns its paths.

    frames: of `rrru.pipeline.jobs.read`; kinds: of the figures' files. Raises FitError where the readings do not
    determine the parameters.
    """
    paths = result_paths(folder, name, config)
    read.write(parts.read_settings(config, name), frames, paths)
    settings = parts.calibration_settings(config, name, *parts.CALIBRATION_KEYS)
    calibrated, _ = calibrate.calibrate(settings, frames["measurements"], frames["campaigns"])
    calibrate.write(settings, calibrated, frames["campaigns"], paths)
    frames = {**frames, **calibrated}
    runs = genetic.genetic(parts.calibration_settings(config, name, *parts.GENETIC_KEYS), frames)
    genetic.write(runs, paths)
    settings = parts.calibration_settings(config, name, driven=True)
    compensate.write(compensate.compensate(settings, frames | runs), paths)
    draw_all(CAMPAIGN_FIGURES, paths, parts.figure_options(config, name), paths, kinds)
    return paths
