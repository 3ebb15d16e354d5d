"""Inclinations of the platform against gravity: an inclinometer's roll and pitch.

With u the direction against gravity in the robot's frame when the base is level, B = Rx(a) Ry(b) the base's tilt, R the
platform's orientation in the robot's frame and M the sensor's on the platform, the sensor sees

    s = M' R' B' u,    roll = atan2(s_y, s_z),    pitch = atan2(-s_x, hypot(s_y, s_z))

(Pedley, Tilt sensing using a three-axis accelerometer, Freescale application note AN3461, 2013, eqs. 25 and 26). An
instrument whose frame is registered to the robot alone does not determine B; readings against gravity do.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, cast

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.arrays import FloatArray
from rrru.cache import last_cached
from rrru.errors import FitError
from rrru.estimation.parameters import Block
from rrru.kinematics.chain import Poses
from rrru.kinematics.legs import WORLD
from rrru.kinematics.measurement_jacobian import ReadingMap
from rrru.kinematics.readings import Readings, orientation
from rrru.kinematics.robot import Robot

_X, _Y, _Z = np.eye(3)
# a sensor whose axis is so near to gravity's plane has no roll
_MIN_COSINE = 1e-6


def base_tilt(sd_rad: float) -> Block:
    """Block of the base's tilt: angles about its x, then its y, with a normal prior of mean 0."""
    return Block.of("base_tilt", ("base_tilt_x", "base_tilt_y"), ("rad", "rad"), sd_rad)


@dataclass(frozen=True, eq=False)
class Inclinations:
    """Inclinations of the platform at n poses; its values are the mechanism's deviations (p,), then the base's tilt.

    mechanism; actuators (n, K); measured_rad (n, 2): roll and pitch; start_mm (n, 3): positions near which the tool's
    are found; sensor_turn (3, 3): the sensor's axes in the platform's frame, by default such that it reads zero at the
    home pose on a level base. Raises FitError where a number is not finite.
    """

    mechanism: Robot
    actuators: FloatArray
    measured_rad: FloatArray
    start_mm: FloatArray
    sensor_turn: FloatArray | None = None

    # a dual-axis MEMS inclinometer of the better kind: 0.003 degrees of noise (# ASSUME)
    default_sd: ClassVar[float] = 5e-5
    unit: ClassVar[str] = "rad"

    def __post_init__(self) -> None:
        for name in ("actuators", "measured_rad", "start_mm"):
            if (bad := np.flatnonzero(~np.isfinite(getattr(self, name)).all(axis=1))).size:
                where = f"{bad.size} of {len(self)} poses, the first is pose {bad[0] + 1}"
                raise FitError(f"{name} is not finite at {where}; leave these poses out")

    def __len__(self) -> int:
        return len(self.actuators)

    @cached_property
    def sensor(self) -> FloatArray:
        """The sensor's axes (3, 3) in the platform's frame."""
        if self.sensor_turn is not None:
            return self.sensor_turn
        up = np.asarray(self.mechanism.up, dtype=float)
        about = np.cross(up, _Z)
        angle = np.arctan2(np.linalg.norm(about), up @ _Z)
        axis = about / np.linalg.norm(about) if np.any(about) else _X
        level = Rotation.from_rotvec(angle * axis).as_matrix()
        return np.asarray((level @ self.mechanism.legs.home_turn).T)

    @cached_property
    def _nominal_poses(self) -> Poses:
        """Poses without deviations."""
        return self.mechanism.solve(self.actuators, self.start_mm)

    @cached_property
    def _directions(self) -> FloatArray:
        """Twists (sites, 6, p) of the parameters, those of the instrument's frame left out."""
        result = self.mechanism.directions.copy()
        result[self.mechanism.legs.site_numbers[WORLD]] = 0.0
        return np.asarray(result)

    @last_cached
    def _poses(self, deviations: FloatArray) -> tuple[Poses, FloatArray]:
        """Poses and twists, in the robot's frame, at deviations (p,)."""
        twists = (self._directions @ deviations)[None]
        return self.mechanism.model.solve(self.actuators, self._nominal_poses, twists), twists

    def _up_in_base(self, tilt: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Direction (3,) against gravity in the frame of a base with tilt (2,), and its derivative (3, 2)."""
        up = np.asarray(self.mechanism.up, dtype=float)
        about_x, about_y = (Rotation.from_rotvec(a * axis).as_matrix() for a, axis in zip(tilt, (_X, _Y), strict=True))
        seen = about_y.T @ about_x.T @ up
        return seen, np.stack([about_y.T @ about_x.T @ np.cross(up, _X), np.cross(seen, _Y)], axis=1)

    def _up_in_sensor(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Direction (n, 3) against gravity as the sensor sees it at values (p + 2,), and its orientation (n, 3, 3)."""
        turn = orientation(self.mechanism, *self._poses(values[:-2])) @ self.sensor
        return self._up_in_base(values[-2:])[0] @ turn, turn

    def residual(self, values: FloatArray, /) -> FloatArray:
        """Measured minus predicted angles (n, 2) in rad, between -pi and pi, at values (p + 2,)."""
        x, y, z = self._up_in_sensor(values)[0].T
        level = np.hypot(y, z)
        off = self.measured_rad - np.stack([np.arctan2(y, z), np.arctan2(-x, level)], axis=1)
        off[level < _MIN_COSINE] = np.nan
        return np.asarray((off + np.pi) % (2.0 * np.pi) - np.pi)

    def jacobian(self, values: FloatArray, /) -> FloatArray:
        """Derivative (n, 2, p + 2) of the residual by the values."""
        seen, turn = self._up_in_sensor(values)
        up, by_tilt = self._up_in_base(values[-2:])
        poses, twists = self._poses(values[:-2])
        readings = Readings(self.start_mm, turn=np.tile(np.eye(3), (len(self), 1, 1)), characteristic_length_mm=1.0)
        # readings of orientations have this kind of map
        at = cast(ReadingMap, self.mechanism.map(self.actuators, poses, twists, readings))
        turned = at.turn_columns(self._directions)
        # a platform that turns by w sees the direction u turn by -w
        by_turn = np.cross(up, turned.transpose(0, 2, 1)).transpose(0, 2, 1)
        moved = np.concatenate([by_turn, np.tile(by_tilt, (len(self), 1, 1))], axis=2)
        # components of the direction in the sensor's axes, and their derivatives
        x, y, z = seen.T[:, :, None]
        dx, dy, dz = (turn.transpose(0, 2, 1) @ moved).transpose(1, 0, 2)
        level = np.hypot(y, z)
        roll, pitch = (z * dy - y * dz) / level**2, (x * (y * dy + z * dz) / level - level * dx) / (x**2 + level**2)
        return -np.stack([roll, pitch], axis=1)
