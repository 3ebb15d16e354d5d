"""What the Delta's camera takes: where target and camera really are, and the images. Lengths in mm, angles in rad.

The robot's calibration frame has z upwards; the target lies below with its own z upwards too; the camera looks down,
its columns along -y. How camera and target stand exactly nobody knows but this module: the study reads images only.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from rrru.plant.camera import Camera, Target, render
from rrru.studies.delta.twin import pose_commands, twin

_LOOKING_DOWN = np.diag([1.0, -1.0, -1.0])


@dataclass(frozen=True)
class Scene:
    """Camera, target and how they stand.

    camera_turn (3, 3): columns are the camera's axes in the robot's frame; target_turn (3, 3) likewise, and
    target_place_mm (3,) its origin there; mount_mm (3,): optical centre less platform centre; distance_mm: optical
    centre above the target at the first plane.
    """

    camera: Camera
    target: Target
    camera_turn: np.ndarray
    target_turn: np.ndarray
    target_place_mm: np.ndarray
    mount_mm: np.ndarray
    distance_mm: float


def scene(config, labels=()):
    """The scene of the configuration's `delta` section, with another plate for other labels."""
    section = config["delta"]
    given, mount, plate = dict(section["camera"]), section["mount"], dict(section["target"])
    for key in ("centre_offset_px", "distortion"):
        given[key] = tuple(given[key])
    turns = [Rotation.from_rotvec(part["turn_deg"], degrees=True).as_matrix() for part in (mount, plate)]
    generator = twin(config).generator("target", *labels)
    offsets = plate.pop("dot_error_mm") * generator.standard_normal((plate["rows"], plate["columns"], 2))
    plate.pop("turn_deg")
    target = Target(**plate, offsets_mm=offsets)
    offset = np.array(mount["offset_mm"])
    # the dots' middle lies below the camera when the platform is in the middle of its poses
    middle = offset + np.array([0.0, 0.0, section["poses"]["z_mm"] - section["distance_mm"]])
    place = middle - turns[1] @ target.middle_mm
    return Scene(Camera(**given), target, turns[0] @ _LOOKING_DOWN, turns[1], place, offset, section["distance_mm"])


def true_poses(config):
    """Rows of `delta_truth`: the commands of every photographed pose and where the optical centre really is in the
    target's frame.
    """
    view, robot = scene(config), twin(config)
    planes, command = pose_commands(config["delta"])
    centre = (robot.drive(command) + view.mount_mm - view.target_place_mm) @ view.target_turn
    return pd.DataFrame(
        {
            "pose": np.arange(1, len(command) + 1),
            "plane": planes,
            **{f"command_{axis}_mm": command[:, k] for k, axis in enumerate("xyz")},
            **{f"true_{axis}_mm": centre[:, k] for k, axis in enumerate("xyz")},
        }
    )


def pose_places(view, truth):
    """Rotation (3, 3) and translation (3,) from the target's frame to the camera's at every pose of `true_poses`."""
    rotation = view.camera_turn.T @ view.target_turn
    return [(rotation, -rotation @ centre) for centre in truth[[f"true_{axis}_mm" for axis in "xyz"]].to_numpy()]


def pose_images(config, truth):
    """Images (n, height, width) of every pose of `true_poses`."""
    view, generator = scene(config), twin(config).generator("pose images")
    return np.stack([render(view.camera, view.target, *place, generator) for place in pose_places(view, truth)])


def true_camera(config):
    """The true numbers that `delta_lens` estimates, in its order; NaN for what has none."""
    camera = scene(config).camera
    return np.array([camera.focal_px, camera.focal_px, *camera.centre_px, *camera.distortion, np.nan])


def tilted_images(config):
    """Images (n, height, width) of the target from all sides, taken by hand before the camera is mounted."""
    view, generator = scene(config), twin(config).generator("tilted images")
    places = tilted_places(view, config["delta"]["tilted_views"], generator)
    return np.stack([render(view.camera, view.target, *place, generator) for place in places])


def tilted_places(view, tilted, generator):
    """Rotation (3, 3) and translation (3,) from the target's frame to the camera's of one tilted view after the
    other.
    """
    for side in 2.0 * np.pi * np.arange(tilted["count"]) / tilted["count"]:
        about = np.radians(tilted["tilt_deg"]) * np.array([np.cos(side), np.sin(side), 0.0])
        rotation = Rotation.from_rotvec(about).as_matrix() @ _LOOKING_DOWN
        # ASSUME by hand: a tenth nearer or farther, aimed a few dots off the middle
        distance = view.distance_mm * generator.uniform(0.9, 1.1)
        aim = view.target.middle_mm + np.append(generator.uniform(-60.0, 60.0, 2), 0.0)
        yield rotation, [0.0, 0.0, distance] - rotation @ aim
