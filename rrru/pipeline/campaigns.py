"""Tables of one campaign before any fit: state, singularities, workspace. Lengths in mm."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from rrru.calibration.campaign_noise import Noise
from rrru.campaign import measurements as rows
from rrru.campaign.ingest.registration import Registration
from rrru.estimation.intervals import QUANTILE_95
from rrru.kinematics import workspace
from rrru.kinematics.robot import Robot


def with_singularities(robot: Robot, measurements: pd.DataFrame, margin: float) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The measurements with points near a constraint singularity marked, and the rows of `singularity`."""
    translational, constraint, determinant = robot.singularities(
        rows.command(measurements), rows.actuators(measurements, robot)
    )
    measurements = rows.mark_near_singularity(measurements, constraint, margin)
    return measurements, measurements[["run", "trajectory", "point", "status"]].assign(
        translational_measure=translational,
        constraint_measure=constraint,
        constraint_determinant=determinant,
    )


def workspace_table(robot: Robot, measurements: pd.DataFrame) -> pd.DataFrame:
    """Rows of `workspace`: a vertical slice and the horizontal one through the middle of the commands.

    The vertical one is y = 0, or through the same middle where the robot reaches no point there. No rows for robots
    that orient their tool: what they reach depends on its orientation.
    """
    names = ("reachable", "translational_measure", "constraint_measure", "constraint_determinant")
    if robot.orients:
        return pd.DataFrame(columns=["x_mm", "y_mm", "z_mm", "slice", *names])
    _, side, height = rows.command(measurements).mean(axis=0).round(-1)
    reach = float(robot.reach_mm)
    # where z points down, the platform is on that side of the base
    across, down = (-reach, reach), (0.0 if robot.z_down else -reach, reach)
    step, frames = reach / robot.workspace_lines, []
    for plane, places, vertical in (("xz", (0.0, side), down), ("xy", (height,), across)):
        grids = (workspace.slice_points(plane, at, across, vertical, step) for at in places)
        points, actuators = _around_reachable(robot, grids, step)
        measures = dict(zip(names, workspace.measures(robot, points, actuators), strict=True))
        frames.append(pd.DataFrame(points, columns=["x_mm", "y_mm", "z_mm"]).assign(slice=plane, **measures))
    return pd.concat(frames, ignore_index=True)


def campaign_row(
    robot: Robot,
    section: Mapping[str, Any],
    measurements: pd.DataFrame,
    singular: pd.DataFrame,
    noise: Noise,
    notes: Iterable[str],
    registration: Registration | None = None,
) -> dict[str, Any]:
    """The row of `campaigns`; noise: a `rrru.calibration.campaign_noise.Noise`."""
    counts = measurements["status"].value_counts()
    source = f"virtual robot {section['virtual']}" if "virtual" in section else f"file {section['ingest']}"
    return {
        "robot": section["robot"],
        "z_down": robot.z_down,
        "source": source,
        "points": len(measurements),
        "runs": measurements["run"].nunique(),
        **{status: int(counts.get(status, 0)) for status in ("ok", "outlier", "stale", "near_singularity", "unsolved")},
        "noise_mm": noise.mm,
        "noise_rad": noise.rad,
        "noise_from": noise.source,
        "noise_rad_from": noise.rad_source,
        "platform_mass_kg": section.get("platform_mass_kg", np.nan),
        "registration_rms_mm": registration.rms_mm if registration else np.nan,
        "registration_max_mm": registration.max_mm if registration else np.nan,
        "min_translational_measure": singular["translational_measure"].min(),
        "min_constraint_measure": singular["constraint_measure"].min(),
        "notes": "; ".join(notes),
    }


def registration_table(registration: Registration | None) -> pd.DataFrame:
    """Rows of `registration`; none without one."""
    columns = ["number", "unit", "value", "random_95", "points"]
    if registration is None:
        return pd.DataFrame(columns=columns)
    names = [f"{kind}_{axis}" for kind in ("translation", "rotation") for axis in "xyz"]
    return pd.DataFrame(
        {
            "number": names,
            "unit": np.repeat(["mm", "rad"], 3),
            "value": registration.numbers,
            "random_95": QUANTILE_95 * np.sqrt(np.diag(registration.covariance)),
            "points": registration.points,
        }
    )


def unmatched_sets(sets: Mapping[str, Iterable[str]], measurements: pd.DataFrame) -> tuple[str, ...]:
    """A note where calibration sets match none of the campaign's trajectories."""
    unmatched = [name for name, patterns in sets.items() if not rows.on_trajectories(measurements, patterns).any()]
    if not unmatched:
        return ()
    present = ", ".join(measurements["trajectory"].unique())
    return (f"not calibrated on {', '.join(unmatched)}: these sets match none of the trajectories {present}",)


def unadvised(advice: Sequence[pd.DataFrame]) -> tuple[str, ...]:
    """A note where a campaign should follow advice (tables, the runs first) and no run was advised."""
    return ("no further run was advised, and none was added",) if advice and not len(advice[0]) else ()


def _around_reachable(robot: Robot, grids: Iterable[np.ndarray], step_mm: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) of the first grid of which the robot reaches some, and their actuator values (n, K).

    Those in the bounding box of its reachable points, widened by a tenth or step; all of the last grid where it reaches
    no point.
    """
    for points in grids:
        actuators = robot.planned(points)
        reachable = points[np.isfinite(actuators).all(axis=1)]
        if len(reachable):
            low, high = reachable.min(axis=0), reachable.max(axis=0)
            margin = np.maximum(0.1 * (high - low), 1.5 * step_mm)
            near = ((points >= low - margin) & (points <= high + margin)).all(axis=1)
            return points[near], actuators[near]
    return points, actuators
