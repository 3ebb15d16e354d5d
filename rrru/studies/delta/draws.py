"""New random errors of the optical centres without rendering: another plate, other tilted views, other pixel noise.

The dots of a plate give one set of errors, partly common to all poses; another plate gives others. The images of the
dots are computed exactly, the noise of their centres is that of the configured images, and camera and poses are
calibrated from them as from images. Lengths in mm, angles in rad.
"""

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from rrru.campaign.measurements import vectors
from rrru.studies.delta import vision
from rrru.studies.delta.views import scene
from rrru.studies.delta.virtual_delta import twin

# least distance in pixels between a complete dot and the image's edge
_EDGE_PX = 5.0


def centre_noise_px(config, truth, dots):
    """RMS error per axis of the dots' centres in `delta_dots` relative to the configured lens and plate."""
    view, seen = scene(config), dots.groupby("pose")
    steps = []
    for pose, place in zip(truth["pose"], view.pose_places(truth), strict=True):
        found = seen.get_group(pose)[["x_px", "y_px"]].to_numpy()
        distance, _ = cKDTree(seen_dots(view, *place).centre_px).query(found)
        # excludes dots at the image's edge that only one of both counts as complete
        steps.append(distance[distance < 1.0])
    return float(np.sqrt((np.concatenate(steps) ** 2).mean() / 2.0))


def seen_dots(view, rotation, translation_mm, noise_px=0.0, generator=None):
    """Complete dots of the scene's target in the camera's image, numbered from the first dot.

    rotation (3, 3), translation_mm (3,): from the target's frame to the camera's. noise_px: 1 sigma per axis.
    """
    camera, target = view.camera, view.target
    number = np.indices((target.rows, target.columns))[::-1].reshape(2, -1).T
    flat = target.pitch_mm * number + target.offsets_mm.reshape(-1, 2)
    place = np.column_stack([flat, np.zeros(len(flat))]) @ rotation.T + translation_mm
    pixel = camera.project(place)
    margin = (target.diameter_mm / 2.0 * camera.focal_px / place[:, 2] + _EDGE_PX)[:, None]
    whole = ((pixel >= margin) & (pixel <= np.array([camera.width_px, camera.height_px]) - 1.0 - margin)).all(axis=1)
    model = vision.CameraModel(camera.matrix, camera.distortion, 0.0)
    lattice, turn = vision.Lattice(target.pitch_mm, target.diameter_mm), Rotation.from_matrix(rotation).as_rotvec()
    centre = pixel[whole] + model.centre_bias(number[whole], turn, translation_mm, lattice)
    if noise_px > 0.0:
        centre = centre + noise_px * generator.standard_normal(centre.shape)
    return vision.Dots(centre, number[whole])


def drawn_errors(config, truth, noise_px, count, label):
    """Errors (n, 3) of the optical centres of `delta_truth` by how they are found, for `count` draws of the chain."""
    robot, view = twin(config), scene(config)
    camera, target = view.camera, view.target
    size, lattice = (camera.width_px, camera.height_px), vision.Lattice(target.pitch_mm, target.diameter_mm)

    def draw(number):
        drawn, generator = view.with_plate(robot.generator("target", label, number)), robot.generator(label, number)
        tilted = [seen_dots(drawn, *place, noise_px, generator) for place in drawn.tilted_places(generator)]
        model = vision.calibrate_camera(tilted, size, lattice)
        seen = [seen_dots(drawn, *place, noise_px, generator) for place in drawn.pose_places(truth)]
        return {
            name: np.array([pose.centre_mm for pose in poses]) - vectors(truth, "true")
            for name, poses in vision.camera_poses(model, seen, lattice).items()
        }

    return [draw(number) for number in range(1, count + 1)]
