"""Images of the Delta's camera, and the true poses of target and camera. Lengths in mm, angles in rad.

The robot's calibration frame has z upwards; the target is below it, also with z upwards; the camera looks down, with
its columns along -y. Only this module has the true poses of camera and target: the study reads images only.
"""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from rrru.campaign.measurements import vector_columns, vectors
from rrru.simulation.camera import Camera, Target, render
from rrru.studies.delta.virtual_delta import Poses, twin

_LOOKING_DOWN = np.diag([1.0, -1.0, -1.0])


@dataclass(frozen=True)
class Scene:
    """Camera, target and their poses.

    camera_turn (3, 3): columns are the camera's axes in the robot's frame; target_turn (3, 3) likewise, and
    target_place_mm (3,) its origin there; mount_mm (3,): optical centre minus platform centre; distance_mm: optical
    centre above the target at the first plane; dot_error_mm: 1 sigma of the dots' places; tilted_count, tilt_deg: views
    for the camera's own calibration. Places of the camera are rotations (3, 3) and translations (3,) from the target's
    frame to the camera's.
    """

    camera: Camera
    target: Target
    camera_turn: np.ndarray
    target_turn: np.ndarray
    target_place_mm: np.ndarray
    mount_mm: np.ndarray
    distance_mm: float
    dot_error_mm: float
    tilted_count: int
    tilt_deg: float

    def with_plate(self, generator):
        """The scene with new random errors of the plate's dots."""
        size = self.target.rows, self.target.columns, 2
        offsets = self.dot_error_mm * generator.standard_normal(size)
        return replace(self, target=replace(self.target, offsets_mm=offsets))

    def pose_places(self, truth):
        """Places of the camera at every pose of `delta_truth`."""
        rotation = self.camera_turn.T @ self.target_turn
        return [(rotation, -rotation @ centre) for centre in vectors(truth, "true")]

    def tilted_places(self, generator):
        """Places of the camera around the target, held by hand before it is mounted."""
        for side in 2.0 * np.pi * np.arange(self.tilted_count) / self.tilted_count:
            about = np.radians(self.tilt_deg) * np.array([np.cos(side), np.sin(side), 0.0])
            rotation = Rotation.from_rotvec(about).as_matrix() @ _LOOKING_DOWN
            # ASSUME errors by hand: a tenth of the distance, a few dots in direction
            distance = self.distance_mm * generator.uniform(0.9, 1.1)
            aim = self.target.middle_mm + np.append(generator.uniform(-60.0, 60.0, 2), 0.0)
            yield rotation, [0.0, 0.0, distance] - rotation @ aim

    def images(self, places, generator):
        """Images (n, height, width) taken at places of the camera."""
        return np.stack([render(self.camera, self.target, *place, generator) for place in places])


def scene(config):
    """The scene of the configuration's `delta` section."""
    section = config["delta"]
    given, mount, plate, tilted = (dict(section[key]) for key in ("camera", "mount", "target", "tilted_views"))
    given |= {key: tuple(given[key]) for key in ("centre_offset_px", "distortion")}
    mount_turn, turn = (Rotation.from_rotvec(part.pop("turn_deg"), degrees=True).as_matrix() for part in (mount, plate))
    dot_error, offset, above = plate.pop("dot_error_mm"), np.array(mount["offset_mm"]), section["distance_mm"]
    target = Target(**plate, offsets_mm=None)
    # the middle of the dots is below the camera when the platform is in the middle of its poses
    place = offset + np.array([0.0, 0.0, section["poses"]["z_mm"] - above]) - turn @ target.middle_mm
    turns = mount_turn @ _LOOKING_DOWN, turn
    bare = Scene(Camera(**given), target, *turns, place, offset, above, dot_error, tilted["count"], tilted["tilt_deg"])
    return bare.with_plate(twin(config).generator("target"))


def true_poses(config):
    """Rows of `delta_truth`: commands of every photographed pose, and true optical centres."""
    view = scene(config)
    planes, command = Poses(**config["delta"]["poses"]).commands()
    centre = (twin(config).drive(command) + view.mount_mm - view.target_place_mm) @ view.target_turn
    pose = pd.DataFrame({"pose": np.arange(1, len(command) + 1), "plane": planes})
    return pose.assign(**vector_columns("command", command), **vector_columns("true", centre))


def true_camera(config):
    """The true numbers that `delta_lens` estimates, in its order; NaN for those without a true value."""
    camera = scene(config).camera
    return np.array([camera.focal_px, camera.focal_px, *camera.centre_px, *camera.distortion, np.nan])
