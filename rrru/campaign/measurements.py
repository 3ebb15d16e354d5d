"""Reading columns of a measurement table as arrays, and choosing rows of it. Lengths in mm, angles in rad."""

from collections.abc import Iterable
from fnmatch import fnmatchcase
from typing import Any

import numpy as np
import pandas as pd

USED = ("ok", "near_singularity")


def vectors(frame: pd.DataFrame, name: str) -> np.ndarray:
    """Positions (n, 3) in mm that a table holds in the columns name_x_mm, name_y_mm and name_z_mm."""
    return frame[[f"{name}_{axis}_mm" for axis in "xyz"]].to_numpy(dtype=float)


def vector_columns(name: str, values: np.ndarray) -> dict[str, np.ndarray]:
    """Columns of a table by name from positions (n, 3) in mm; see `vectors`."""
    return {f"{name}_{axis}_mm": values[:, k] for k, axis in enumerate("xyz")}


def command(measurements: pd.DataFrame) -> np.ndarray:
    """Commanded positions (n, 3)."""
    return vectors(measurements, "command")


def measured(measurements: pd.DataFrame) -> np.ndarray:
    """Measured positions (n, 3), NaN where not measured."""
    return vectors(measurements, "measured")


def actuators(measurements: pd.DataFrame, robot: Any) -> np.ndarray:
    """Commanded actuator values (n, K) of a robot, angles in rad or lengths in mm."""
    return measurements[robot.parts.columns].to_numpy(dtype=float)


def on_trajectories(measurements: pd.DataFrame, patterns: Iterable[str]) -> np.ndarray:
    """Rows (n,) on trajectories whose name fits one of the patterns (* matches anything)."""
    names = measurements["trajectory"].unique()
    chosen = [name for name in names if any(fnmatchcase(name, pattern) for pattern in patterns)]
    return measurements["trajectory"].isin(chosen).to_numpy()


def usable(measurements: pd.DataFrame, use_near_singularity: bool = True) -> np.ndarray:
    """Rows (n,) that fits may use: measured, no outlier and, if so asked, not near a singularity."""
    allowed = USED if use_near_singularity else USED[:1]
    return measurements["status"].isin(allowed).to_numpy() & np.isfinite(measured(measurements)).all(axis=1)


def direction(measurements: pd.DataFrame) -> np.ndarray:
    """+1 or -1 (n,): whether a run passes its trajectory in the order of the first run along it or against it."""
    from scipy.spatial import cKDTree

    result, position = np.ones(len(measurements), dtype=int), command(measurements)
    first: dict[str, cKDTree] = {}
    for (trajectory, _), run in measurements.reset_index(drop=True).groupby(["trajectory", "run"], sort=False):
        rows = run.index.to_numpy()
        tree = first.setdefault(trajectory, cKDTree(position[rows]))
        # most steps tell, so that a closed path's equal ends or a missing point do not matter
        steps = np.sign(np.diff(tree.query(position[rows])[1])).sum()
        result[rows] = -1 if steps < 0 else 1
    return result


def mark_near_singularity(measurements: pd.DataFrame, constraint_measure: np.ndarray, margin: float) -> pd.DataFrame:
    """The table with status "near_singularity" where the measure (n,) is below the margin and all else is fine."""
    near = (measurements["status"] == "ok") & (np.asarray(constraint_measure) < margin)
    return measurements.assign(status=measurements["status"].where(~near, "near_singularity"))
