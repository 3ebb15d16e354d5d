"""Reading columns of a measurement table as arrays, and choosing rows of it. Lengths in mm, angles in rad."""

from collections.abc import Iterable
from fnmatch import fnmatchcase

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from rrru.kinematics.base_parameters import MeasurementConfig
from rrru.kinematics.readings import Readings, place_on_platform
from rrru.kinematics.robot import Robot

USED = ("ok", "near_singularity")
# rows of a held-out test: no fit uses them, but the robot was there
HELD_OUT = "held_out"
# what a reflector is fixed to
ON_PLATFORM, ON_WORLD = "platform", "world"


def vectors(frame: pd.DataFrame, name: str) -> np.ndarray:
    """Positions (n, 3) in mm that a table holds in the columns name_x_mm, name_y_mm and name_z_mm."""
    # column by column: a selection of several costs far more than their values
    return np.stack([frame[f"{name}_{axis}_mm"].to_numpy(dtype=float) for axis in "xyz"], axis=1)


def vector_columns(name: str, values: np.ndarray) -> dict[str, np.ndarray]:
    """Columns of a table by name from positions (n, 3) in mm; see `vectors`."""
    return {f"{name}_{axis}_mm": values[:, k] for k, axis in enumerate("xyz")}


def command(measurements: pd.DataFrame) -> np.ndarray:
    """Commanded positions (n, 3)."""
    return vectors(measurements, "command")


def measured(measurements: pd.DataFrame) -> np.ndarray:
    """Measured positions (n, 3), NaN where not measured."""
    return vectors(measurements, "measured")


def turn_columns(name: str, turns: np.ndarray) -> dict[str, np.ndarray]:
    """Columns name_rx_rad, name_ry_rad and name_rz_rad from orientations (n, 3, 3): rotation vectors, NaN where NaN."""
    vectors, known = np.full((len(turns), 3), np.nan), np.isfinite(turns).all(axis=(1, 2))
    if known.any():
        vectors[known] = Rotation.from_matrix(turns[known]).as_rotvec()
    return {f"{name}_r{axis}_rad": vectors[:, k] for k, axis in enumerate("xyz")}


def turns(measurements: pd.DataFrame, name: str) -> np.ndarray:
    """Orientations (n, 3, 3) that a table holds as rotation vectors in columns as of `turn_columns`, NaN where null."""
    vectors = measurements[[f"{name}_r{axis}_rad" for axis in "xyz"]].to_numpy(dtype=float)
    result, known = np.full((len(vectors), 3, 3), np.nan), np.isfinite(vectors).all(axis=1)
    if known.any():
        result[known] = Rotation.from_rotvec(vectors[known]).as_matrix()
    return result


def has_turns(measurements: pd.DataFrame) -> bool:
    """Whether orientations were measured."""
    return "measured_rx_rad" in measurements and bool(measurements["measured_rx_rad"].notna().any())


def readings(measurements: pd.DataFrame, characteristic_length_mm: float = np.nan) -> Readings | None:
    """The Readings at the n rows of a table, None where only positions of the tool were read.

    characteristic_length_mm: see Readings.
    """
    reflectors = place = on_world = None
    if "target" in measurements:
        reflectors, place = sites(measurements["target"]).to_numpy(), vectors(measurements, "target")
        on_world = on_the_world(measurements)
    elif not has_turns(measurements):
        return None
    turn = turns(measurements, "measured") if has_turns(measurements) else None
    return Readings(measured(measurements), reflectors, place, turn, characteristic_length_mm, on_world)


def on_the_world(measurements: pd.DataFrame) -> np.ndarray | None:
    """Rows (n,) of reflectors that are fixed to the world, not to the platform; None where no row is."""
    if "target_on" not in measurements:
        return None
    result = (measurements["target_on"] == ON_WORLD).to_numpy()
    return result if result.any() else None


def measurement_config(
    measurements: pd.DataFrame, known: Iterable[str] = (), registered: bool = False
) -> MeasurementConfig:
    """The MeasurementConfig of a campaign; known: reflectors with stated places; registered: whether its frame was."""
    names = tuple(pd.unique(sites(measurements["target"]))) if "target" in measurements else ()
    stated = set(sites(pd.Series([*known], dtype=object)))
    fitted = tuple(name for name in names if name not in stated)
    return MeasurementConfig(names, fitted, has_turns(measurements), registered)


def sites(targets: pd.Series) -> pd.Series:
    """Names of the sites of reflectors by the names of these."""
    return "reflector " + targets.astype(str)


def series(measurements: pd.DataFrame) -> np.ndarray:
    """Numbers (n,) of the runs, those of each reflector apart: rows that follow one another smoothly."""
    if "target" not in measurements:
        return np.asarray(measurements["run"].to_numpy())
    return np.asarray(measurements.groupby(["run", "target"], sort=False).ngroup().to_numpy() + 1)


def at_tool(measurements: pd.DataFrame, robot: Robot) -> pd.DataFrame:
    """The table with the tool's positions alone: those of reflectors carried to it, as the nominal robot holds them.

    Without the rows of reflectors that it does not hold.
    """
    if (on_world := on_the_world(measurements)) is not None:
        measurements = measurements[~on_world]
    measurements = measurements.drop(columns=[f"measured_r{axis}_rad" for axis in "xyz"], errors="ignore")
    if "target" not in measurements:
        return measurements
    poses, place = robot.solve(actuators(measurements, robot), command(measurements)), vectors(measurements, "target")
    offset = poses.point(place) - poses.point(place_on_platform(robot, robot.twists()))
    places = [f"target_{axis}_mm" for axis in "xyz"]
    plain = measurements.drop(columns=["target", "target_on", *places], errors="ignore")
    return plain.assign(**vector_columns("measured", measured(measurements) - offset))


def actuators(measurements: pd.DataFrame, robot: Robot) -> np.ndarray:
    """Commanded actuator values (n, K) of a robot, angles in rad or lengths in mm."""
    return np.asarray(measurements[robot.parts.columns].to_numpy(dtype=float))


def on_trajectories(measurements: pd.DataFrame, patterns: Iterable[str]) -> np.ndarray:
    """Rows (n,) on trajectories whose name fits one of the patterns (* matches anything)."""
    names = measurements["trajectory"].unique()
    chosen = [name for name in names if any(fnmatchcase(name, pattern) for pattern in patterns)]
    return np.asarray(measurements["trajectory"].isin(chosen).to_numpy())


def usable(measurements: pd.DataFrame, use_near_singularity: bool = True) -> np.ndarray:
    """Rows (n,) that fits may use: measured, no outlier and, if so asked, not near a singularity."""
    allowed = USED if use_near_singularity else USED[:1]
    return np.asarray(measurements["status"].isin(allowed).to_numpy() & np.isfinite(measured(measurements)).all(axis=1))


def hold_out(measurements: pd.DataFrame, chosen: np.ndarray) -> pd.DataFrame:
    """The table with status "held_out" where rows (n,) are chosen that a fit might use.

    The rows stay: what a robot does at a stop depends on the one before it, whether that is fitted or not.
    """
    held = np.asarray(chosen, dtype=bool) & measurements["status"].isin(USED).to_numpy()
    return measurements.assign(status=measurements["status"].where(~held, HELD_OUT))


def direction(measurements: pd.DataFrame) -> np.ndarray:
    """+1 or -1 (n,): whether a run passes its trajectory in the order of the first run along it or against it."""
    from scipy.spatial import cKDTree

    result, position = np.ones(len(measurements), dtype=int), command(measurements)
    first: dict[str, cKDTree] = {}
    for (trajectory, _), run in measurements.reset_index(drop=True).groupby(["trajectory", "run"], sort=False):
        rows = run.index.to_numpy()
        tree = first.setdefault(trajectory, cKDTree(position[rows]))
        # the majority of the steps decides, so that a closed path's equal ends or a missing point do not matter
        steps = np.sign(np.diff(tree.query(position[rows])[1])).sum()
        result[rows] = -1 if steps < 0 else 1
    return result


def mark_near_singularity(measurements: pd.DataFrame, constraint_measure: np.ndarray, margin: float) -> pd.DataFrame:
    """The table with status "near_singularity" where the measure (n,) is below the margin and all else is fine."""
    near = (measurements["status"] == "ok") & (np.asarray(constraint_measure) < margin)
    return measurements.assign(status=measurements["status"].where(~near, "near_singularity"))
