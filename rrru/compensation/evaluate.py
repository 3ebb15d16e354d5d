"""Errors of every trajectory under every calibration: by its model, and driven again. Lengths in mm, angles in rad."""

import logging
from collections.abc import Callable
from fnmatch import fnmatchcase

import numpy as np
import pandas as pd

from rrru.arrays import FloatArray
from rrru.calibration.campaign_fit import deviation_vector
from rrru.campaign import measurements as rows
from rrru.errors import SimulationError, UnreachableError
from rrru.kinematics.robot import Robot

# measurements that a controller makes, positions (n, 3) to actuator values
Drive = Callable[[Callable[[FloatArray], FloatArray]], pd.DataFrame]
GROUPS = {"all_lines": "line_*", "all": "*"}
# the standard asks for 30 cycles; fewer than three do not determine a standard deviation
_FEWEST_REPEATS = 3
_CALIBRATION = ["calibration", "method", "mode"]
_ERROR = ["error_x_mm", "error_y_mm", "error_z_mm"]
_TANGENT = ["tangent_x", "tangent_y", "tangent_z"]


def under_calibrations(
    measurements: pd.DataFrame, mechanism: Robot, parameters: pd.DataFrame, drive: Drive | None = None
) -> pd.DataFrame:
    """Rows of `errors` before any calibration and under every one of a `parameters` frame.

    drive: makes measurements with a controller, positions (n, 3) to actuator values; None where the robot cannot be
    driven and every calibration is judged by its model alone. A calibration under whose commands the robot loses its
    pose has no rows of that mode, and a line of output states this.
    """
    frames = [before(rows.at_tool(measurements, mechanism))]
    for calibration, method in parameters[["calibration", "method"]].drop_duplicates().itertuples(index=False):
        deviations = deviation_vector(parameters, calibration, method, mechanism)
        parts = {"model": model_residual(measurements, mechanism, deviations)}
        if drive is not None:
            try:
                parts["closed_loop"] = closed_loop(drive, mechanism, deviations)
            except (SimulationError, UnreachableError) as error:
                logging.warning("closed loop left out, %s by %s: %s", calibration, method, error)
        frames += [part.assign(calibration=calibration, method=method, mode=mode) for mode, part in parts.items()]
    return pd.concat(frames, ignore_index=True)


def before(measurements: pd.DataFrame) -> pd.DataFrame:
    """Rows of `errors` before any calibration: measured minus commanded position of the tool."""
    return _errors(measurements, rows.command(measurements)).assign(calibration="none", method="none", mode="before")


def model_residual(measurements: pd.DataFrame, mechanism: Robot, deviations: FloatArray) -> pd.DataFrame:
    """Measured position minus that of the calibrated model for the commanded values: `errors` without names."""
    actuators, command = rows.actuators(measurements, mechanism), rows.command(measurements)
    if (readings := rows.readings(measurements)) is None:
        return _errors(measurements, mechanism.forward(actuators, deviations, command))
    twists = mechanism.twists(deviations)
    return _errors(measurements, mechanism.measured(mechanism.solve(actuators, command, twists), twists, readings))


def closed_loop(drive: Drive, mechanism: Robot, deviations: FloatArray) -> pd.DataFrame:
    """Measured minus commanded position where the robot is driven again, as `errors` without names.

    The controller sends the actuator values with which the calibrated model lands on the target.
    """
    measurements = rows.at_tool(drive(lambda position: mechanism.inverse(position, deviations)), mechanism)
    return _errors(measurements, rows.command(measurements))


def _errors(measurements: pd.DataFrame, expected: FloatArray) -> pd.DataFrame:
    """Measured minus expected positions (n, 3), point by point; null at points that fits may not use."""
    error = np.where(rows.usable(measurements)[:, None], rows.measured(measurements) - expected, np.nan)
    columns = rows.vector_columns("error", error)
    return measurements[["run", "trajectory", "point"]].assign(**columns, error_mm=np.linalg.norm(error, axis=1))


def summarise(errors: pd.DataFrame, measurements: pd.DataFrame) -> pd.DataFrame:
    """Rows of `error_summary`: sizes, and accuracies after ISO 9283, per calibration and trajectory.

    errors: rows of `errors` of one campaign; besides every trajectory the groups "all_lines" and "all" are summed up.
    """
    names = measurements["trajectory"].unique().tolist()
    # a trajectory with the name of a group replaces the group
    groups = {group: [name for name in names if fnmatchcase(name, pattern)] for group, pattern in GROUPS.items()}
    groups = {name: [name] for name in names} | {name: groups[name] for name in groups if name not in names}
    joined = errors.merge(_path_geometry(measurements), on=["run", "point"], how="left", validate="many_to_one")
    judged = _about_barycentres(joined.dropna(subset=_ERROR)).reindex(joined.index).to_numpy()
    trajectory, result = joined["trajectory"].to_numpy(), []
    for key, part in joined.groupby(_CALIBRATION, sort=False):
        label, at = dict(zip(_CALIBRATION, key, strict=True)), part.index.to_numpy()
        for name, members in groups.items():
            if members:
                chosen = judged[at[np.isin(trajectory[at], members)]]
                result.append(label | {"trajectory": name} | _statistics(chosen[np.isfinite(chosen[:, 0])]))
    return pd.DataFrame(result)


def _path_geometry(measurements: pd.DataFrame) -> pd.DataFrame:
    """Per run and point: the commanded path's unit tangent (n, 3) and the number of the station.

    Points at one station are passed under the same conditions: trajectory, place, direction, speed and payload.
    """
    frame = measurements[["run", "point", "trajectory", "speed_mm_s", "payload_kg"]].reset_index(drop=True)
    position, tangent = rows.command(measurements), np.zeros((len(frame), 3))
    for run in frame.groupby("run", sort=False).indices.values():
        points = position[run]
        along = np.gradient(points, axis=0, edge_order=2) if len(run) > 2 else points[-1:] - points[:1]
        length = np.linalg.norm(along, axis=1, keepdims=True)
        tangent[run] = np.divide(along, length, out=np.zeros_like(along), where=length > 0.0)
    pose = [measurements[name].to_numpy() for name in measurements if name == "target" or name.startswith("command_r")]
    keys = [frame["trajectory"], rows.direction(measurements), frame["speed_mm_s"], frame["payload_kg"]]
    keys += [*position.T, *pose]
    station = frame.groupby(keys, dropna=False, sort=False).ngroup()
    return frame[["run", "point"]].assign(station=station, **dict(zip(_TANGENT, tangent.T, strict=True)))


def _about_barycentres(known: pd.DataFrame) -> pd.DataFrame:
    """The quantities of ISO 9283 for every row with an error: its size, passes of its station, AP, AT and RP there.

    AP: distance between commanded position and barycentre of the attained ones. AT: the same across the path only (the
    standard compares in the plane normal to the commanded path). RP: l + 3 S_l about the barycentre. In mode "model"
    the model's position replaces the commanded one.
    """
    keys = [*_CALIBRATION, "station"]
    stations, tangent = known.groupby(keys, sort=False), known[_TANGENT].to_numpy()
    barycentre = stations[_ERROR].transform("mean").to_numpy()
    across = barycentre - (barycentre * tangent).sum(axis=1, keepdims=True) * tangent
    known = known.assign(off=np.linalg.norm(known[_ERROR].to_numpy() - barycentre, axis=1))
    off = known.groupby(keys, sort=False)["off"]
    return known[["error_mm"]].assign(
        repeats=off.transform("size"),
        pose=np.linalg.norm(barycentre, axis=1),
        path=np.linalg.norm(across, axis=1),
        scatter=off.transform("mean") + 3.0 * off.transform("std"),
    )


def _statistics(judged: FloatArray) -> dict[str, float]:
    """Count, sizes and largest ISO 9283 numbers of rows (n, 5) of `_about_barycentres`, null where there is none."""
    count = len(judged)
    size, repeats, pose, path, scatter = (judged if count else np.full((1, 5), np.nan)).T
    passes = int(repeats.min()) if count else 0
    return {
        "points": count,
        "min_mm": size.min(),
        "mean_mm": size.mean(),
        "rms_mm": np.sqrt((size**2).mean()),
        "max_mm": size.max(),
        "repeats": passes,
        "pose_accuracy_mm": pose.max(),
        "path_accuracy_mm": path.max(),
        "repeatability_mm": scatter.max() if passes >= _FEWEST_REPEATS else np.nan,
    }
