"""The zero calibrations of the Delta: from images to optical centres, every variant's fit, and what it leaves. Lengths
in mm, angles in rad.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from rrru.fit.least_squares import least_squares
from rrru.fit.residuals import Residuals
from rrru.plant.tracker import measure
from rrru.studies.delta import vision
from rrru.studies.delta.twin import pose_commands
from rrru.studies.delta.zero_offset import Distances, Heights, Shape, step_fit, taken_for_errors

_SCALE_ERROR = 1e-4
CAMERA_PARAMETERS = ["focal_x_px", "focal_y_px", "centre_x_px", "centre_y_px", "k1", "k2", "p1", "p2", "rms_px"]
# columns of `delta_centres` by the prefix of their errors in `delta_poses`
FOUND = {"": "centre", "one_rotation_": "one_rotation"}


@dataclass(frozen=True)
class Variant:
    """One way to find the zero errors.

    source: images, one_rotation (images of a camera that is known not to turn), true_centres (for comparison only) or
    tracker; measure: distances, shape, positions or heights; planes: one or two; step: the paper's single linear step
    instead of a fit that has converged.
    """

    name: str
    source: str
    measure: str
    planes: str
    step: bool = False


VARIANTS = (
    Variant("paper", "images", "distances", "one", step=True),
    Variant("converged", "images", "distances", "one"),
    Variant("two_heights", "images", "distances", "two"),
    Variant("shape", "images", "shape", "one"),
    Variant("shape_two_heights", "images", "shape", "two"),
    Variant("one_rotation", "one_rotation", "distances", "one"),
    Variant("one_rotation_two_heights", "one_rotation", "distances", "two"),
    Variant("one_rotation_shape", "one_rotation", "shape", "one"),
    Variant("true_centres", "true_centres", "distances", "one"),
    Variant("true_centres_two_heights", "true_centres", "distances", "two"),
    Variant("tracker_heights", "tracker", "heights", "one"),
    Variant("tracker_positions", "tracker", "positions", "one"),
)


def calibrate_camera(images, section):
    """CameraModel from images (n, height, width) of tilted views."""
    target = section["target"]
    views = [vision.read_dots(image, f"tilted view {k}") for k, image in enumerate(images, 1)]
    return vision.calibrate_camera(views, images.shape[:0:-1], target["pitch_mm"], target["diameter_mm"])


def find_centres(images, model, section):
    """Rows of `delta_centres` and `delta_dots` from images (n, height, width) of the poses and a calibrated camera."""
    target, (planes, command) = section["target"], pose_commands(section)
    planes, command = planes[: len(images)], command[: len(images)]
    seen = [vision.read_dots(image, f"pose {k}") for k, image in enumerate(images, 1)]
    poses = [vision.camera_pose(model, dots, target["pitch_mm"], target["diameter_mm"]) for dots in seen]
    kinds = {"centre": poses, "one_rotation": vision.with_one_rotation(model, seen, poses, target["pitch_mm"])}
    raw = {name: np.array([pose.centre_mm for pose in kind]) for name, kind in kinds.items()}
    places = {name: vision.join_places(centre, command, target["pitch_mm"]) for name, centre in raw.items()}
    shift = np.rint((places["centre"] - raw["centre"])[:, :2] / target["pitch_mm"])
    number = np.arange(1, len(images) + 1)
    centres = pd.DataFrame(
        {
            "pose": number,
            "plane": planes,
            **{f"command_{axis}_mm": command[:, k] for k, axis in enumerate("xyz")},
            **{f"{name}_{axis}_mm": place[:, k] for name, place in places.items() for k, axis in enumerate("xyz")},
            "dots": [len(dots.number) for dots in seen],
            "reprojection_rms_px": [pose.rms_px for pose in poses],
        }
    )
    rows = np.concatenate(
        [np.column_stack([dots.centre_px, dots.number + moved]) for dots, moved in zip(seen, shift, strict=True)]
    )
    dots = pd.DataFrame(rows, columns=["x_px", "y_px", "column", "row"]).astype({"column": int, "row": int})
    return centres, dots.assign(pose=np.repeat(number, centres["dots"]))


def camera_numbers(model):
    """Rows of `delta_lens` from a calibrated CameraModel."""
    found = [
        model.matrix[0, 0],
        model.matrix[1, 1],
        model.matrix[0, 2],
        model.matrix[1, 2],
        *model.distortion,
        model.rms_px,
    ]
    return pd.DataFrame({"parameter": CAMERA_PARAMETERS, "found": found})


def pose_errors(centres, truth):
    """Rows of `delta_poses`: centres found in the images against the true ones, the origin's shift taken off."""
    errors = {f"{name}error": columns(centres, column) - columns(truth, "true") for name, column in FOUND.items()}
    return centres[
        ["pose", "plane", "command_x_mm", "command_y_mm", "command_z_mm", "dots", "reprojection_rms_px"]
    ].assign(
        **{
            f"{name}_{axis}_mm": (error - error.mean(axis=0))[:, k]
            for name, error in errors.items()
            for k, axis in enumerate("xyz")
        }
    )


def residuals(variant, mechanism, command_mm, actuators, places_mm):
    """What a variant fits: residuals of the mechanism at actuators (n, 3) for places (n, 3) seen in the variant's
    frame.
    """
    if variant.measure == "distances":
        return Distances(mechanism, actuators, places_mm, alike=variant.step)
    if variant.measure == "shape":
        return Shape(mechanism, actuators, places_mm)
    kind = Heights if variant.measure == "heights" else Residuals
    return kind(mechanism, actuators, places_mm, command_mm)


def fit(variant, mechanism, command_mm, places_mm):
    """Fit of a variant to places (n, 3) for commands (n, 3), the covariance (3, 3) of its errors in rad^2, and its
    residuals.
    """
    points = residuals(variant, mechanism, command_mm, mechanism.require_reachable(command_mm), places_mm)
    if variant.step:
        return *step_fit(points), points
    result = least_squares(points)
    return result, result.identifiability.covariance(result.noise_mm), points


def paper_fit(mechanism, centres):
    """The paper's zero errors (3,) from rows of `delta_centres` on its plane."""
    return fit(VARIANTS[0], mechanism, columns(centres, "command"), columns(centres, "centre"))[0].deviations


def chosen(variant, planes):
    """Which poses (n,) a variant uses: the whole first plane, or every other pose of it and the second plane."""
    first = planes == "first"
    return first if variant.planes == "one" else ~first | (np.cumsum(first) % 2 == 1)


def places(variant, twin, centres, truth):
    """Commands (n, 3) and places (n, 3) that a variant is given, each in its source's frame."""
    used = chosen(variant, truth["plane"].to_numpy())
    command = columns(truth, "command")[used]
    if variant.source == "tracker":
        return command, measure(twin.drive(command), twin.tracker_noise_mm, twin.generator("tracker", variant.name))
    table, name = {
        "images": (centres, "centre"),
        "one_rotation": (centres, "one_rotation"),
        "true_centres": (truth, "true"),
    }[variant.source]
    return command, columns(table, name)[used]


def study(twin, centres, truth, length_error_mm):
    """Rows of `delta_calibrations`, `delta_observability` and `delta_points` for every variant, and before any.

    length_error_mm: 1 sigma of every length's error that nobody knows of, for what it does to the zero errors.
    """
    points = [_points(twin, "none", None)]
    calibrations = [
        {"variant": "none", "source": "none", "measure": "none", "planes": "none", "poses": 0} | _sizes(points[0])
    ]
    directions = []
    for variant in VARIANTS:
        command, seen = places(variant, twin, centres, truth)
        result, covariance, fitted = fit(variant, twin.mechanism, command, seen)
        points.append(_points(twin, variant.name, result.deviations))
        legs = residuals(variant, twin.truth, command, fitted.actuators, seen).jacobian(twin.truth.parameters.nominal)[
            ..., 3:
        ]
        # a longer arm changes the model, which the fit sees as measured less model with the other sign
        lengths = taken_for_errors(fitted, -legs)
        calibrations.append(
            _calibration(variant, twin, result, len(command), length_error_mm * lengths) | _sizes(points[-1])
        )
        directions.append(_directions(variant, result.identifiability, covariance, lengths, _scale(variant, fitted)))
    return pd.DataFrame(calibrations), pd.concat(directions, ignore_index=True), pd.concat(points, ignore_index=True)


def columns(table, name):
    """Positions (n, 3) that a table holds under a name."""
    return table[[f"{name}_{axis}_mm" for axis in "xyz"]].to_numpy()


def _calibration(variant, twin, result, poses, lengths_rad):
    """The fit's columns of `delta_calibrations`; lengths_rad (3, q): what one sigma of every length does to the zero
    errors.
    """
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
    for k, name in enumerate(twin.mechanism.parameters.names):
        row |= {f"{name}_true_rad": twin.zero_errors_rad[k], f"{name}_found_rad": result.deviations[k]}
        row |= {
            f"{name}_error_rad": result.deviations[k] - twin.zero_errors_rad[k],
            f"{name}_standard_error_rad": result.standard_errors[k],
        }
        row[f"{name}_length_error_rad"] = np.linalg.norm(lengths_rad[k])
    return row


def _scale(variant, fitted):
    """Zero errors (3,) by which a fit answers to a target that is too large by `_SCALE_ERROR`; NaN without a target."""
    if variant.source == "tracker":
        return np.full(3, np.nan)
    larger = residuals(variant, fitted.mechanism, None, fitted.actuators, fitted.measured_mm * (1.0 + _SCALE_ERROR))
    zero = fitted.mechanism.parameters.nominal
    return taken_for_errors(fitted, (larger.residual(zero) - fitted.residual(zero))[..., None])[:, 0]


def _directions(variant, found, covariance, lengths, scale):
    """Rows of `delta_observability`: combinations of the zero errors from the best seen to the worst, and what is
    mistaken for them.

    found: the Identifiability; covariance (3, 3) in rad^2; lengths (3, q), scale (3,): zero errors from lengths and
    from the target's scale.
    """
    common = found.directions.sum(axis=1) ** 2 / 3.0
    return pd.DataFrame(
        {
            "variant": variant.name,
            "direction": [1, 2, 3],
            **{f"weight_{name}": found.directions[:, k] for k, name in enumerate(found.names)},
            "common_share": common,
            "kind": np.where(common > 0.5, "common", "differential"),
            "singular_value": found.singular_values,
            "standard_error_rad": np.sqrt(np.einsum("da,ab,db->d", found.directions, covariance, found.directions)),
            "per_length_rad_mm": np.linalg.norm(found.directions @ lengths, axis=1),
            "per_scale_rad": np.abs(found.directions @ scale),
        }
    )


def _points(twin, variant, found):
    """Rows of `delta_points` when the zero errors `found` (3,) are fed back."""
    errors = dict(zip(("error", "base_error"), twin.plane_errors(found, twin.generator("plane", variant)), strict=True))
    return pd.DataFrame(
        {
            "variant": variant,
            "point": np.arange(1, len(twin.plane_mm) + 1),
            **{f"command_{axis}_mm": twin.plane_mm[:, k] for k, axis in enumerate("xyz")},
            **{f"{name}_{axis}_mm": error[:, k] for name, error in errors.items() for k, axis in enumerate("xyz")},
            **{f"{name}_mm": np.linalg.norm(error, axis=1) for name, error in errors.items()},
        }
    )


def _sizes(points):
    """Mean and largest error of rows of `delta_points` in both frames."""
    return {
        f"{frame}_{name}_mm": points[column].agg(name)
        for frame, column in (("plane", "error_mm"), ("base", "base_error_mm"))
        for name in ("mean", "max")
    }
