"""From the Delta's images to tables of its camera and optical centres. Lengths in mm, angles in rad."""

import numpy as np
import pandas as pd

from rrru.campaign.measurements import vector_columns, vectors
from rrru.studies.delta import vision

_CAMERA_PARAMETERS = ("focal_x_px", "focal_y_px", "centre_x_px", "centre_y_px", "k1", "k2", "p1", "p2", "rms_px")


def calibrate_camera(images, lattice):
    """CameraModel from images (n, height, width) of tilted views."""
    views = [vision.read_dots(image, f"tilted view {k}") for k, image in enumerate(images, 1)]
    return vision.calibrate_camera(views, images.shape[:0:-1], lattice)


def find_centres(images, planes, command_mm, model, lattice):
    """Rows of `delta_centres` and `delta_dots` from images (n, height, width) of the poses and a calibrated camera.

    planes (n,), command_mm (n, 3): of the commanded poses.
    """
    seen = [vision.read_dots(image, f"pose {k}") for k, image in enumerate(images, 1)]
    poses = vision.camera_poses(model, seen, lattice)
    raw = {name: np.array([pose.centre_mm for pose in kind]) for name, kind in poses.items()}
    places = {name: vision.join_places(centre, command_mm, lattice.pitch_mm) for name, centre in raw.items()}
    shift = np.rint((places["centre"] - raw["centre"])[:, :2] / lattice.pitch_mm)
    centres = pd.DataFrame(
        {"pose": np.arange(1, len(images) + 1), "plane": planes}
        | vector_columns("command", command_mm)
        | vector_columns("centre", places["centre"])
        | vector_columns("one_rotation", places["one_rotation"])
        | {
            "dots": [len(dots.number) for dots in seen],
            "reprojection_rms_px": [pose.rms_px for pose in poses["centre"]],
        }
    )
    number = np.concatenate([dots.number + moved for dots, moved in zip(seen, shift, strict=True)]).astype(int)
    x, y = np.concatenate([dots.centre_px for dots in seen]).T
    pose = np.repeat(centres["pose"], centres["dots"]).to_numpy()
    return centres, pd.DataFrame({"pose": pose, "column": number[:, 0], "row": number[:, 1], "x_px": x, "y_px": y})


def camera_numbers(model):
    """Rows of `delta_lens` from a calibrated CameraModel."""
    matrix = model.matrix
    values = [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *model.distortion, model.rms_px]
    return pd.DataFrame({"parameter": _CAMERA_PARAMETERS, "found": values})


def pose_errors(centres, truth):
    """Rows of `delta_poses`: centres found in the images minus the true ones, without the origin's common shift."""
    rows = centres[["pose", "plane", *vector_columns("command", np.empty((0, 3))), "dots", "reprojection_rms_px"]]
    for prefix, name in (("error", "centre"), ("one_rotation_error", "one_rotation")):
        error = vectors(centres, name) - vectors(truth, "true")
        rows = rows.assign(**vector_columns(prefix, error - error.mean(axis=0)))
    return rows
