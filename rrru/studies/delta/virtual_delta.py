"""The Delta of the vision study: its twin, its commands, and the errors on the plane by a tracker. mm and rad.

Errors are given in two frames. The paper's calibration frame o-xyz (1.1) is defined by driving the robot: origin at its
position for the command (0, 0, 0), x axis towards its position for a command along x, and the position for a command
along y in the xy plane. ASSUME it is defined again before and after the calibration. The other one is the frame of the
robot's base, which a tracker measures from the drive axes.
"""

from dataclasses import dataclass

import numpy as np

from rrru.errors import ConfigError
from rrru.robots.catalogue import make_mechanism
from rrru.robots.delta import Delta
from rrru.seeds import stream
from rrru.simulation.tracker import measure


@dataclass(frozen=True)
class Poses:
    """Poses of the images: counts and half_mm along x and y of a grid at z_mm; half of it again at second_z_mm."""

    counts: tuple[int, int]
    half_mm: tuple[float, float]
    z_mm: float
    second_z_mm: float

    def commands(self):
        """Planes' names (n,) and commands (n, 3) of every pose with an image, in the order driven.

        The paper's poses, spread evenly over its plane ("first"), in rows of alternating direction for short steps;
        then every second one at a second height ("second"), backwards, for a short step between the planes.
        """
        x, y = (np.linspace(-half, half, count) for half, count in zip(self.half_mm, self.counts, strict=True))
        rows = [np.column_stack([x[:: (-1) ** r], np.full(len(x), y[r])]) for r in range(len(y))]
        field = np.concatenate(rows)
        first, second = (
            np.column_stack([flat, np.full(len(flat), z)])
            for flat, z in ((field, self.z_mm), (field[::-2], self.second_z_mm))
        )
        return np.repeat(["first", "second"], [len(first), len(second)]), np.concatenate([first, second])


@dataclass(frozen=True)
class DeltaTwin:
    """A virtual Delta and its tasks.

    mechanism: the controller's model, with the drives' zero errors as parameters; truth: the same robot with every
    leg's lengths as parameters, and its true deviations (12,); plane_mm (n, 3): where errors are evaluated; axes_mm (3,
    3): commands that define the calibration frame; tracker_noise_mm: 1 sigma per axis; labels: of the repetition of the
    study, each with its own noise.
    """

    mechanism: Delta
    truth: Delta
    deviations: np.ndarray
    plane_mm: np.ndarray
    axes_mm: np.ndarray
    tracker_noise_mm: float
    seed: int
    labels: tuple = ()

    @property
    def zero_errors_rad(self):
        """The drives' true zero errors (3,)."""
        return self.deviations[:3]

    def generator(self, *labels):
        """Random stream of the study for a purpose."""
        return stream(self.seed, "delta", *self.labels, *labels)

    def positions(self, actuators):
        """True positions (n, 3), base frame, at the drive angles (n, 3) that its controller commands."""
        return self.truth.forward(actuators, self.deviations)

    def drive(self, command_mm, zero_rad=None):
        """True positions (n, 3), base frame, for commands (n, 3) with corrected zero errors (3,)."""
        return self.positions(self.mechanism.require_reachable(command_mm, zero_rad))

    def plane_errors(self, zero_rad, generator):
        """Errors (n, 3) on the plane in the calibration frame and in the base's, as a tracker measures; see `drive`."""
        command = np.concatenate([self.axes_mm, self.plane_mm])
        measured = measure(self.drive(command, zero_rad), self.tracker_noise_mm, generator)
        in_calibration_frame = in_own_frame(measured[:3], measured[3:])
        return in_calibration_frame - self.plane_mm, measured[3:] - self.plane_mm


def twin(config):
    """The twin of the configuration's `delta` section; raises ConfigError for a command out of reach."""
    section, sets = config["delta"], ("zero", "legs")
    mechanism, truth = (make_mechanism("delta", config["robots"]["delta"], parameter_set=name) for name in sets)
    result = DeltaTwin(
        mechanism,
        truth,
        truth.parameters.vector(section["errors"]),
        disc(**section["plane"]),
        section["plane"]["z_mm"] * np.array([0.0, 0.0, 1.0]) + section["plane"]["radius_mm"] * np.eye(3, k=-1),
        section["tracker_noise_mm"],
        config["seed"],
    )
    for key, command in (("plane", result.plane_mm), ("poses", Poses(**section["poses"]).commands()[1])):
        if not np.isfinite(result.positions(mechanism.inverse(command))).all():
            raise ConfigError(f"delta.{key}: a point is out of the robot's reach")
    return result


def disc(radius_mm, step_mm, z_mm):
    """Points (n, 3) of a square grid within a circle about the origin of a horizontal plane."""
    side = step_mm * np.arange(-np.floor(radius_mm / step_mm), np.floor(radius_mm / step_mm) + 1.0)
    x, y = (axis.ravel() for axis in np.meshgrid(side, side))
    inside = np.hypot(x, y) <= radius_mm * (1.0 + 1e-9)
    return np.column_stack([x, y, np.full(len(x), z_mm)])[inside]


def in_own_frame(axes_mm, places_mm):
    """Places (n, 3) in the frame of axes_mm (3, 3): its origin, a point on x, and one in the xy plane with y > 0."""
    x = axes_mm[1] - axes_mm[0]
    z = np.cross(x, axes_mm[2] - axes_mm[0])
    frame = np.array([x, np.cross(z, x), z])
    return (places_mm - axes_mm[0]) @ (frame / np.linalg.norm(frame, axis=1, keepdims=True)).T
