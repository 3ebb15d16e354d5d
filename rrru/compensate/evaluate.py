"""Errors of every trajectory under every calibration: as the model predicts them, and driven again with corrected
commands.

Lengths in mm, angles in rad.
"""

from fnmatch import fnmatchcase

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows

GROUPS = {"all_lines": "line_*", "all": "*"}
# the standard asks for 30 cycles; below three a spread says nothing
_FEWEST_REPEATS = 3


def before(measurements):
    """Rows of `errors` before any calibration: measured minus commanded position."""
    return _rows(measurements, rows.measured(measurements) - rows.command(measurements), "none", "none", "before")


def model_residual(measurements, mechanism, deviations, calibration, method):
    """Rows of `errors` in mode "model": measured position minus the one that the calibrated model gives for the angles
    that were sent.
    """
    model = mechanism.forward(rows.actuators(measurements), deviations, rows.command(measurements))
    return _rows(measurements, rows.measured(measurements) - model, calibration, method, "model")


def closed_loop(robot, plan, deviations, noise_mm, generator, calibration, method):
    """Rows of `errors` in mode "closed_loop": the controller corrects its commands, the virtual robot drives them and
    is measured again.

    The corrected angles are those with which the calibrated model lands on the target.
    """
    mechanism = robot.mechanism
    measurements, _ = robot.run(
        plan, noise_mm, generator, controller=lambda position: mechanism.inverse(position, deviations)
    )
    return _rows(
        measurements, rows.measured(measurements) - rows.command(measurements), calibration, method, "closed_loop"
    )


def _rows(measurements, error, calibration, method, mode):
    """Rows of `errors` for error vectors (n, 3); points that fits may not use carry null errors."""
    error = np.where(rows.usable(measurements)[:, None], error, np.nan)
    return measurements[["run", "trajectory", "point"]].assign(
        calibration=calibration,
        method=method,
        mode=mode,
        **{f"error_{axis}_mm": error[:, k] for k, axis in enumerate("xyz")},
        error_mm=np.linalg.norm(error, axis=1),
    )


def summarise(errors, measurements):
    """Rows of `error_summary`: minimum, mean, RMS and maximum, and accuracies after ISO 9283, per calibration and
    trajectory.

    errors: rows of `errors` of one campaign; besides every trajectory the groups "all_lines" and "all" are summed up.
    """
    geometry = _path_geometry(measurements)
    names = measurements["trajectory"].unique().tolist()
    groups = {name: [name] for name in names}
    for group, pattern in GROUPS.items():
        # a trajectory of that name stands for itself
        groups.setdefault(group, [name for name in names if fnmatchcase(name, pattern)])
    result = []
    for (calibration, method, mode), part in errors.groupby(["calibration", "method", "mode"], sort=False):
        joined = part.merge(geometry, on=["run", "point"], how="left", validate="one_to_one")
        for name, members in groups.items():
            if not members:
                continue
            chosen = joined[joined["trajectory"].isin(members)]
            label = {"calibration": calibration, "method": method, "mode": mode, "trajectory": name}
            result.append(label | _statistics(chosen) | _iso_9283(chosen))
    return pd.DataFrame(result)


def _statistics(part):
    """Count, minimum, mean, RMS and maximum of the error's size; null where no point was measured."""
    size = part["error_mm"].dropna().to_numpy()
    if not size.size:
        return {"points": 0, **dict.fromkeys(("min_mm", "mean_mm", "rms_mm", "max_mm"), np.nan)}
    return {
        "points": len(size),
        "min_mm": size.min(),
        "mean_mm": size.mean(),
        "rms_mm": np.sqrt((size**2).mean()),
        "max_mm": size.max(),
    }


def _path_geometry(measurements):
    """Per run and point: unit tangent of the commanded path, the commanded position as a key and the direction of
    motion.
    """
    frames = []
    position = rows.command(measurements)
    side = rows.direction(measurements)
    for _, part in measurements.reset_index(drop=True).groupby("run", sort=False):
        index = part.index.to_numpy()
        if len(index) > 2:
            tangent = np.gradient(position[index], axis=0, edge_order=2)
        else:
            tangent = np.tile(position[index[-1]] - position[index[0]], (len(index), 1))
        length = np.linalg.norm(tangent, axis=1, keepdims=True)
        tangent = np.divide(tangent, length, out=np.zeros_like(tangent), where=length > 0.0)
        frames.append(
            part[["run", "point", "speed_mm_s", "payload_kg"]].assign(
                **{f"tangent_{axis}": tangent[:, k] for k, axis in enumerate("xyz")},
                **{f"at_{axis}": position[index, k] for k, axis in enumerate("xyz")},
                direction=side[index],
            )
        )
    return pd.concat(frames, ignore_index=True)


def _iso_9283(part):
    """Accuracies after ISO 9283, from points passed `repeats` times under the same conditions (null where none was
    measured).

    pose_accuracy_mm: largest distance between commanded position and barycentre of the attained ones (AP).
    path_accuracy_mm: the same across the path only (AT: the standard compares in the plane normal to the commanded
    path). repeatability_mm: largest l + 3 S_l about the barycentre (RP), null with fewer than three repeats. In mode
    "model" the model's position stands for the commanded one.
    """
    axes = [f"error_{axis}_mm" for axis in "xyz"]
    part = part.dropna(subset=axes).reset_index(drop=True)
    if part.empty:
        return {"repeats": 0, "pose_accuracy_mm": np.nan, "path_accuracy_mm": np.nan, "repeatability_mm": np.nan}
    keys = ["trajectory", "direction", "speed_mm_s", "payload_kg", "at_x", "at_y", "at_z"]
    groups = part.groupby(keys, dropna=False, sort=False)
    barycentre = groups[axes].transform("mean").to_numpy()
    tangent = part[["tangent_x", "tangent_y", "tangent_z"]].to_numpy()
    across = barycentre - (barycentre * tangent).sum(axis=1, keepdims=True) * tangent
    distance = pd.Series(np.linalg.norm(part[axes].to_numpy() - barycentre, axis=1)).groupby(groups.ngroup().to_numpy())
    repeats = int(groups.size().min())
    return {
        "repeats": repeats,
        "pose_accuracy_mm": np.linalg.norm(barycentre, axis=1).max(),
        "path_accuracy_mm": np.linalg.norm(across, axis=1).max(),
        "repeatability_mm": (distance.mean() + 3.0 * distance.std(ddof=1)).max()
        if repeats >= _FEWEST_REPEATS
        else np.nan,
    }
