"""The optical centres' errors drawn anew without rendering: another plate, other tilted views, other pixel noise.
Lengths in mm, angles in rad.

One plate's dots give one set of errors, which all poses share in part; another plate gives others. Where the lens puts
the dots is computed exactly, the noise of their centres is the one that the configured images show, and camera and
poses are calibrated from them as from images.
"""

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from rrru.studies.delta import fits, views, vision
from rrru.studies.delta.twin import twin

# pixels of bright plate that a dot needs between itself and the image's edge to count as whole
_EDGE_PX = 5.0


def centre_noise_px(config, truth, dots):
    """RMS per axis of the dots' centres in `delta_dots` off where the configured lens puts the configured plate's
    dots.
    """
    view, found = views.scene(config), dots.groupby("pose")
    steps = []
    for pose, place in zip(truth["pose"], views.pose_places(view, truth), strict=True):
        own = found.get_group(pose)[["x_px", "y_px"]].to_numpy()
        distance, _ = cKDTree(seen_dots(view, *place).centre_px).query(own)
        # dots at the image's edge that only one of both counts as whole are as far away as a neighbour
        steps.append(distance[distance < 1.0])
    return float(np.sqrt((np.concatenate(steps) ** 2).mean() / 2.0))


def drawn_errors(config, truth, noise_px, count, label):
    """Errors (n, 3) of the optical centres of `delta_truth` by name, as in `fits.FOUND`, for each of `count` draws of
    the whole chain.
    """
    return [_one(config, truth, noise_px, (label, number)) for number in range(1, count + 1)]


def seen_dots(view, rotation, translation_mm, noise_px=0.0, generator=None):
    """Dots of the scene's target as the camera sees them whole, numbered from the first dot, with normal noise of
    `noise_px` per axis.

    rotation (3, 3), translation_mm (3,): from the target's frame to the camera's.
    """
    camera, target = view.camera, view.target
    number = np.indices((target.rows, target.columns))[::-1].reshape(2, -1).T
    flat = target.pitch_mm * number + target.offsets_mm.reshape(-1, 2)
    place = np.column_stack([flat, np.zeros(len(flat))]) @ rotation.T + translation_mm
    pixel = camera.project(place)
    room = (target.diameter_mm / 2.0 * camera.focal_px / place[:, 2] + _EDGE_PX)[:, None]
    whole = ((pixel >= room) & (pixel <= np.array([camera.width_px, camera.height_px]) - 1.0 - room)).all(axis=1)
    dots = vision.Dots(pixel[whole], number[whole])
    matrix = np.array(
        [[camera.focal_px, 0.0, camera.centre_px[0]], [0.0, camera.focal_px, camera.centre_px[1]], [0.0, 0.0, 1.0]]
    )
    turn, shift = Rotation.from_matrix(rotation).as_rotvec(), np.asarray(translation_mm)
    lens = matrix, np.array(camera.distortion)
    centre = dots.centre_px + vision.centre_bias(*lens, dots, turn, shift, target.pitch_mm, target.diameter_mm)
    if noise_px > 0.0:
        centre = centre + noise_px * generator.standard_normal(centre.shape)
    return vision.Dots(centre, dots.number)


def _one(config, truth, noise_px, labels):
    """Errors (n, 3) by name of one draw."""
    generator, section = twin(config).generator(*labels), config["delta"]
    view, plate = views.scene(config, labels), section["target"]
    size = view.camera.width_px, view.camera.height_px
    tilted = [
        seen_dots(view, *place, noise_px, generator)
        for place in views.tilted_places(view, section["tilted_views"], generator)
    ]
    model = vision.calibrate_camera(tilted, size, plate["pitch_mm"], plate["diameter_mm"])
    seen = [seen_dots(view, *place, noise_px, generator) for place in views.pose_places(view, truth)]
    poses = [vision.camera_pose(model, dots, plate["pitch_mm"], plate["diameter_mm"]) for dots in seen]
    kinds = {"centre": poses, "one_rotation": vision.with_one_rotation(model, seen, poses, plate["pitch_mm"])}
    return {
        name: np.array([pose.centre_mm for pose in kind]) - fits.columns(truth, "true") for name, kind in kinds.items()
    }
