"""The run that a diagnosis advises, as runs of a plan: a pass like the campaign's, or short passes of poses. mm, s."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from rrru.campaign import measurements as rows
from rrru.campaign.plan import Run, make_plan
from rrru.campaign.trajectories import Line, from_config
from rrru.diagnosis.options import OPTIONS
from rrru.pipeline.config import Motion


def advised_runs(
    run: Mapping[str, Any], poses: pd.DataFrame, trajectories: Mapping[str, Any], motion: Motion
) -> tuple[Run, ...]:
    """Runs of a plan for a row of `gap_next_runs` as a mapping; poses: the diagnosis' `gap_next_poses`.

    trajectories: section of the campaign's own; motion: its speed, acceleration and dwell. A faster pass has the
    campaign's profile, faster in proportion.
    """
    speed = run["speed_mm_s"]
    entry = {key: run[key] for key in ("reverse", "speed_mm_s", "payload_kg")}
    if run["kind"] == "poses":
        ends = zip(rows.vectors(poses, "from").tolist(), rows.vectors(poses, "to").tolist(), strict=True)
        lines = [Line(f"pose_{k}", *pair, OPTIONS.points_per_pass) for k, pair in enumerate(ends, start=1)]
        return make_plan(lines, [entry | {"acceleration_mm_s2": speed**2 / OPTIONS.pass_length_mm}], **motion).runs
    entry["acceleration_mm_s2"] = motion["acceleration_mm_s2"] * (speed / motion["speed_mm_s"]) ** 2
    return make_plan(from_config(trajectories), [entry | {"trajectories": [run["trajectory"]]}], **motion).runs
