"""Errors of every trajectory under every calibration: by its model, and driven again. Lengths in mm, angles in rad."""

from fnmatch import fnmatchcase

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.fit.campaign_fit import deviation_vector

GROUPS = {"all_lines": "line_*", "all": "*"}
# the standard asks for 30 cycles; below three a spread says nothing
_FEWEST_REPEATS = 3
_ERROR = [f"error_{axis}_mm" for axis in "xyz"]


def under_calibrations(measurements, mechanism, parameters, drive=None):
    """Rows of `errors` before any calibration and under every one of a `parameters` frame.

    drive: makes measurements with a controller, positions (n, 3) to actuator values; None where the robot is not at
    hand and every calibration is judged by its model alone.
    """
    frames = [before(measurements)]
    for calibration, method in parameters[["calibration", "method"]].drop_duplicates().itertuples(index=False):
        deviations = deviation_vector(parameters, calibration, method, mechanism)
        parts = {"model": model_residual(measurements, mechanism, deviations)}
        if drive is not None:
            parts["closed_loop"] = closed_loop(drive, mechanism, deviations)
        frames += [part.assign(calibration=calibration, method=method, mode=mode) for mode, part in parts.items()]
    return pd.concat(frames, ignore_index=True)


def before(measurements):
    """Rows of `errors` before any calibration: measured minus commanded position."""
    return _errors(measurements, rows.command(measurements)).assign(calibration="none", method="none", mode="before")


def model_residual(measurements, mechanism, deviations):
    """Measured position minus the calibrated model's for the values that were sent: `errors` without names."""
    model = mechanism.forward(rows.actuators(measurements), deviations, rows.command(measurements))
    return _errors(measurements, model)


def closed_loop(drive, mechanism, deviations):
    """Measured minus commanded position where the robot is driven again, as `errors` without names.

    The controller sends the actuator values with which the calibrated model lands on the target.
    """
    measurements = drive(lambda position: mechanism.inverse(position, deviations))
    return _errors(measurements, rows.command(measurements))


def _errors(measurements, expected):
    """Measured minus expected positions (n, 3), point by point; null at points that fits may not use."""
    error = np.where(rows.usable(measurements)[:, None], rows.measured(measurements) - expected, np.nan)
    columns = rows.vector_columns("error", error)
    return measurements[["run", "trajectory", "point"]].assign(**columns, error_mm=np.linalg.norm(error, axis=1))


def summarise(errors, measurements):
    """Rows of `error_summary`: sizes, and accuracies after ISO 9283, per calibration and trajectory.

    errors: rows of `errors` of one campaign; besides every trajectory the groups "all_lines" and "all" are summed up.
    """
    geometry = _path_geometry(measurements)
    names = measurements["trajectory"].unique().tolist()
    # a trajectory that is called as a group stands for itself
    groups = {group: [one for one in names if fnmatchcase(one, pattern)] for group, pattern in GROUPS.items()}
    groups = {name: [name] for name in names} | {name: groups[name] for name in groups if name not in names}
    result = []
    for key, part in errors.groupby(["calibration", "method", "mode"], sort=False):
        label = dict(zip(("calibration", "method", "mode"), key, strict=True))
        joined = part.merge(geometry, on=["run", "point"], how="left", validate="one_to_one")
        for name, members in groups.items():
            if members:
                chosen = joined[joined["trajectory"].isin(members)]
                result.append(label | {"trajectory": name} | _sizes(chosen) | _iso_9283(chosen))
    return pd.DataFrame(result)


def _sizes(part):
    """Count, minimum, mean, RMS and maximum of the error's size; null where no point was measured."""
    size = part["error_mm"].dropna().to_numpy()
    known = size if size.size else np.array([np.nan])
    numbers = (known.min(), known.mean(), np.sqrt((known**2).mean()), known.max())
    return {"points": len(size), **dict(zip(("min_mm", "mean_mm", "rms_mm", "max_mm"), numbers, strict=True))}


def _path_geometry(measurements):
    """Per run and point: the commanded path's unit tangent (n, 3), the place as a key and the direction of motion."""
    frame = measurements[["run", "point", "speed_mm_s", "payload_kg"]].reset_index(drop=True)
    position, tangent = rows.command(measurements), np.zeros((len(frame), 3))
    for run in frame.groupby("run", sort=False).indices.values():
        points = position[run]
        along = np.gradient(points, axis=0, edge_order=2) if len(run) > 2 else points[-1:] - points[:1]
        length = np.linalg.norm(along, axis=1, keepdims=True)
        tangent[run] = np.divide(along, length, out=np.zeros_like(along), where=length > 0.0)
    columns = {f"tangent_{axis}": tangent[:, k] for k, axis in enumerate("xyz")}
    columns |= {f"at_{axis}": position[:, k] for k, axis in enumerate("xyz")}
    return frame.assign(**columns, direction=rows.direction(measurements))


def _iso_9283(part):
    """Accuracies after ISO 9283, from points passed `repeats` times under the same conditions, null without any.

    pose_accuracy_mm: largest distance between commanded position and barycentre of the attained ones (AP).
    path_accuracy_mm: the same across the path only (AT: the standard compares in the plane normal to the commanded
    path). repeatability_mm: largest l + 3 S_l about the barycentre (RP), null with fewer than three repeats. In mode
    "model" the model's position stands for the commanded one.
    """
    part = part.dropna(subset=_ERROR).reset_index(drop=True)
    if part.empty:
        return {"repeats": 0, "pose_accuracy_mm": np.nan, "path_accuracy_mm": np.nan, "repeatability_mm": np.nan}
    keys = ["trajectory", "direction", "speed_mm_s", "payload_kg", "at_x", "at_y", "at_z"]
    groups = part.groupby(keys, dropna=False, sort=False)
    barycentre = groups[_ERROR].transform("mean").to_numpy()
    tangent = part[["tangent_x", "tangent_y", "tangent_z"]].to_numpy()
    across = barycentre - (barycentre * tangent).sum(axis=1, keepdims=True) * tangent
    distance = pd.Series(np.linalg.norm(part[_ERROR].to_numpy() - barycentre, axis=1))
    distance, repeats = distance.groupby(groups.ngroup().to_numpy()), int(groups.size().min())
    largest = (distance.mean() + 3.0 * distance.std(ddof=1)).max()
    return {
        "repeats": repeats,
        "pose_accuracy_mm": np.linalg.norm(barycentre, axis=1).max(),
        "path_accuracy_mm": np.linalg.norm(across, axis=1).max(),
        "repeatability_mm": largest if repeats >= _FEWEST_REPEATS else np.nan,
    }
