"""The zero calibrations of the Delta as tables: estimates, observability and residuals by variant. mm and rad.

The same calibrations are made with other plates and on other robots too, since one draw may favour a variant.
"""

from dataclasses import replace

import numpy as np
import pandas as pd

from rrru.campaign.measurements import vector_columns, vectors
from rrru.studies.delta.variants import VARIANTS, Seen, taken_for_errors

# a target that is 0.1 mm per m too large
_SCALE_ERROR = 1e-4
_BEFORE = {"variant": "none", "source": "none", "measure": "none", "planes": "none", "poses": 0}
_SIZES = ("plane_mean", "plane_max", "base_mean", "base_max")


def study(twin, seen, length_error_mm):
    """Rows of `delta_calibrations`, `delta_observability` and `delta_points` for every variant, and before calibration.

    seen: `Seen`; length_error_mm: 1 sigma of every length's unknown error, for the bias of the zeros.
    """
    points, directions = [_points(twin, "none", None)], []
    calibrations = [_BEFORE | _sizes(points[0])]
    for variant in VARIANTS:
        command, places = variant.places(twin, seen)
        actuators = twin.mechanism.require_reachable(command)
        fitted, legs = (variant.residuals(robot, command, actuators, places) for robot in (twin.mechanism, twin.truth))
        result, covariance = variant.fit(fitted)
        # an arm's length changes the model; the residual, measured minus model, has the opposite sign
        lengths = taken_for_errors(fitted, -legs.jacobian(twin.truth.parameters.nominal)[..., 3:])
        points.append(_points(twin, variant.name, result.deviations))
        row = _calibration(variant, twin, result, len(command), length_error_mm * lengths)
        calibrations.append(row | _sizes(points[-1]))
        directions.append(_directions(variant, result.identifiability, covariance, lengths, _scale(variant, fitted)))
    return pd.DataFrame(calibrations), pd.concat(directions, ignore_index=True), pd.concat(points, ignore_index=True)


def _calibration(variant, twin, result, poses, lengths_rad):
    """The fit's columns of `delta_calibrations`; lengths_rad (3, q): zero errors by one sigma of every length."""
    row = {
        "variant": variant.name,
        "source": variant.source,
        "measure": variant.measure,
        "planes": variant.planes,
        "poses": poses,
        "equations": result.residual_mm.size,
        "rank": result.identifiability.rank,
        "condition": result.identifiability.condition,
        "residual_rms_mm": float(np.sqrt((result.residual_mm**2).mean())),
        "noise_mm": result.noise_mm,
    }
    drives = {
        "true": twin.zero_errors_rad,
        "found": result.deviations,
        "error": result.deviations - twin.zero_errors_rad,
        "standard_error": result.standard_errors,
        "length_error": [np.linalg.norm(lengths) for lengths in lengths_rad],
    }
    names = twin.mechanism.parameters.names
    return row | {f"{name}_{key}_rad": values[k] for k, name in enumerate(names) for key, values in drives.items()}


def _scale(variant, fitted):
    """Bias (3,) of the zero errors from a target that is too large by `_SCALE_ERROR`; NaN without a target."""
    if variant.source == "tracker":
        return np.full(3, np.nan)
    larger = variant.residuals(fitted.mechanism, None, fitted.actuators, fitted.measured_mm * (1.0 + _SCALE_ERROR))
    zero = fitted.mechanism.parameters.nominal
    return taken_for_errors(fitted, (larger.residual(zero) - fitted.residual(zero))[..., None])[:, 0]


def _directions(variant, seen, covariance, lengths, scale):
    """Rows of `delta_observability`: combinations of the zero errors, best observable first, and their bias.

    seen: the Identifiability; covariance (3, 3) in rad^2; lengths (3, q), scale (3,): zero errors from lengths and
    from the target's scale.
    """
    common = seen.directions.sum(axis=1) ** 2 / 3.0
    return pd.DataFrame(
        {"variant": variant.name, "direction": [1, 2, 3]}
        | {f"weight_{name}": seen.directions[:, k] for k, name in enumerate(seen.names)}
        | {
            "common_share": common,
            "kind": np.where(common > 0.5, "common", "differential"),
            "singular_value": seen.singular_values,
            "standard_error_rad": np.sqrt(np.einsum("da,ab,db->d", seen.directions, covariance, seen.directions)),
            "per_length_rad_mm": np.linalg.norm(seen.directions @ lengths, axis=1),
            "per_scale_rad": np.abs(seen.directions @ scale),
        }
    )


def _points(twin, variant, zero_rad):
    """Rows of `delta_points` after correction of zero errors (3,)."""
    error, base = twin.plane_errors(zero_rad, twin.generator("plane", variant))
    return pd.DataFrame(
        {"variant": variant, "point": np.arange(1, len(error) + 1)}
        | vector_columns("command", twin.plane_mm)
        | vector_columns("error", error)
        | vector_columns("base_error", base)
        | {"error_mm": np.linalg.norm(error, axis=1), "base_error_mm": np.linalg.norm(base, axis=1)}
    )


def _sizes(points):
    """Mean and largest error of rows of `delta_points` in both frames."""
    frames = (("plane", "error_mm"), ("base", "base_error_mm"))
    return {f"{frame}_{of}_mm": points[column].agg(of) for frame, column in frames for of in ("mean", "max")}


def other_draws(twin, truth, errors):
    """Rows of `delta_draws`: errors on the plane before and after every variant, over random draws.

    truth: the table `delta_truth`; errors: those of the optical centres in every draw, see `draws.drawn_errors`. Plate,
    views and noise of camera and tracker are drawn again; the robot stays the same.
    """
    poses = truth["plane"].to_numpy(), vectors(truth, "command")
    measured = [
        plane_sizes(replace(twin, labels=("draws", number)), *poses, draw) for number, draw in enumerate(errors, 1)
    ]
    rows = []
    for name in measured[0]:
        low, median, high = np.percentile([sizes[name] for sizes in measured], [5.0, 50.0, 95.0], axis=0)
        shares = {"low": low, "median": median, "high": high}
        columns = {f"{size}_{share}_mm": values[k] for k, size in enumerate(_SIZES) for share, values in shares.items()}
        rows.append({"variant": name, "draws": len(errors)} | columns)
    return pd.DataFrame(rows)


def other_robots(twin, truth, errors, spread):
    """Rows of `delta_robots`: errors on the plane over robots with drawn zero and length errors.

    truth, errors: as in `other_draws`; the robots use the draws in turn, since their cameras see nearly the same dots.
    Every size of length errors has the same zero errors, directions and noise. spread: the configuration's
    `delta.spread`: number of robots, 1 sigma of their zero errors and of all lengths (several values).
    """
    poses, rows = (truth["plane"].to_numpy(), vectors(truth, "command")), []
    for length in spread["lengths_mm"]:
        measured = []
        for number in range(spread["robots"]):
            robot = replace(twin, labels=("robots", number))
            unit = robot.generator().standard_normal(len(twin.deviations))
            robot = replace(robot, deviations=unit * np.where(np.arange(len(unit)) < 3, spread["zero_rad"], length))
            measured.append(plane_sizes(robot, *poses, errors[number % len(errors)]))
        for name in measured[0]:
            median, high = np.percentile([sizes[name] for sizes in measured], [50.0, 90.0], axis=0)
            columns = {"plane_median_mm": median[0], "plane_high_mm": high[0]}
            columns |= {"base_median_mm": median[2], "base_high_mm": high[2]}
            rows.append({"variant": name, "length_error_mm": length, "robots": len(measured)} | columns)
    return pd.DataFrame(rows)


def plane_sizes(twin, planes, command_mm, draw):
    """Sizes (4,), as in `_SIZES`, of a robot's errors on the plane before ("none") and after every variant, by name.

    draw: errors (n, 3) of the optical centres by source.
    """
    places = twin.drive(command_mm)
    seen = Seen(planes, command_mm, places + draw["centre"], places + draw["one_rotation"], places)
    zero_rad = {"none": None}
    for variant in VARIANTS:
        zero_rad[variant.name] = variant.zero_errors(twin.mechanism, *variant.places(twin, seen))
    sizes = {}
    for name, fed_back in zero_rad.items():
        plane, base = (np.linalg.norm(e, axis=1) for e in twin.plane_errors(fed_back, twin.generator("plane", name)))
        sizes[name] = [plane.mean(), plane.max(), base.mean(), base.max()]
    return sizes
