"""Rotary Delta robot: the nominal model of its controller, after paper C (`docs/sister-studies.md`).

Frame of the static platform O-XYZ: the three drive axes lie in the plane Z = 0, z UP, leg i at the structure angle
beta_i = -pi/6 + 2 pi (i-1)/3, so that Y points to the second drive axis. The calibration frame o-xyz has the same
directions and its origin where the platform stands at zero drive angles, in the middle of the workspace:

    r = a_i + l1 u_i + l2 w_i                                                                       (eq. 1)
    u_i = Rot(Z, beta_i - pi/2) Rot(x_i, -theta_i) e_2 = cos(theta_i) e_i - sin(theta_i) z          (eq. 2)

with w_i the direction of the forearm, e_i the outward direction and |a_i| = a the base's radius less the platform's:
the platform counts as a point. theta > 0 lowers the arm. To first order an error of the drives moves the platform by

    w_i . dr = l1 w_i . (du_i / dtheta_i) dtheta_i,   dr = J dtheta                                 (eqs. 3-6)

Equations (1) and (3) to (6) are not legible in the scan of the paper and are reconstructed from its text. Lengths in
mm, angles in rad.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np

from rrru.arrays import FloatArray
from rrru.errors import ConfigError
from rrru.kinematics.chain import Poses
from rrru.kinematics.dynamics import Masses, arm_load
from rrru.kinematics.legs import Joint, Leg, Legs, Parts, X, Y, Z, turn_about
from rrru.kinematics.point_masses import DriveMotion
from rrru.robots.three_legs import LEGS, Deviation, of_each, of_each_leg, of_three_legs, points, three_drives
from rrru.robots.tripod import BARS, Tripod, pair_of_bars

# columns of the legs' numbers (3, 4): offset of the drive's angle in rad; l1, l2 and a in mm
_OWN = of_each_leg("dtheta", 0, "rad"), of_each_leg("dl1_", 1), of_each_leg("dl2_", 2), of_each_leg("da_", 3)
_COMMON = {"dl1": Deviation(1), "dl2": Deviation(2), "da": Deviation(3)}


@dataclass(frozen=True)
class Delta(Tripod):
    """The robot with its nominal dimensions in mm.

    parameter_set: "zero": 3 zero offsets; "tied": these and errors of l1, l2 and a that all legs share; "legs": zero
    offsets and errors of l1, l2 and a of each leg, 12 in all.
    """

    # ASSUME this and the next two: the paper gives no dimensions
    l1_mm: float = 375.0
    l2_mm: float = 900.0
    a_mm: float = 125.0
    # the platform's radius and the distance of an arm's two bars: where these are equal, they act on its tilt only
    platform_mm: float = 60.0
    spacing_mm: float = 120.0
    azimuth_rad: tuple[float, float, float] = (-np.pi / 6.0, np.pi / 2.0, 7.0 * np.pi / 6.0)
    parameter_set: str = "zero"
    angle_limit_rad: float = 0.05
    length_limit_mm: float = 10.0
    name: str = field(default="delta", init=False)

    LINK = 2
    TRACKED = "tied"
    RICHEST = "legs"
    DIMENSIONS = ("l1_mm", "l2_mm", "a_mm", "platform_mm", "spacing_mm")
    DEVIATIONS = _OWN[0] | _OWN[1] | _OWN[2] | _OWN[3] | _COMMON
    PARAMETER_NAMES: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "zero": (*_OWN[0],),
        "tied": (*_OWN[0], *_COMMON),
        "legs": (*_OWN[0], *_OWN[1], *_OWN[2], *_OWN[3]),
    }
    SOURCE = "paper C, 1.1; bounds assumed"
    COLUMN_SITES = (
        (("drive", 4, 1.0),),
        (("elbow", 0, 1.0),),
        (("a bar", 0, 1.0), ("b bar", 0, 1.0)),
        (("foot", 0, 1.0),),
    )
    parts = Parts(
        drives=three_drives("rad", 4),
        feet=of_three_legs("foot"),
        links={"dL1_leg": of_each("elbow"), "dL3_leg": BARS},
        members=BARS,
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.l2_mm > self.a_mm + self.l1_mm:
            raise ConfigError(
                f"delta: l2_mm is {self.l2_mm}; allowed: more than a_mm + l1_mm, else no pose has level arms"
            )

    @property
    def characteristic_length_mm(self) -> float:
        """The arm's length: it makes errors of angles comparable with those of lengths."""
        return self.l1_mm

    @property
    def reach_mm(self) -> float:
        """Length of a stretched leg in mm, arm and forearm."""
        return self.l1_mm + self.l2_mm

    @cached_property
    def legs(self) -> Legs:
        """Six legs that end in bars, two on the elbow of every arm, side by side."""
        bars: list[Leg] = []
        for leg, azimuth in zip(LEGS, self.azimuth_rad, strict=True):
            root = turn_about(Z, azimuth)
            arm = (
                Joint(f"leg {leg} root", shift_mm=self.origin_depth_mm * Z, turn=root),
                Joint(f"leg {leg} foot", shift_mm=(self.a_mm + self.platform_mm) * X),
                Joint(f"leg {leg} drive", "R", Y, drive=leg - 1),
                Joint(f"leg {leg} elbow", shift_mm=self.l1_mm * X),
            )
            bars += pair_of_bars(leg, arm, root, (self.l2_mm, self.platform_mm, self.spacing_mm))
        return Legs(tuple(bars), np.zeros(3))

    @property
    def origin_depth_mm(self) -> float:
        """Depth in mm of the calibration frame's origin below the drive axes: the platform's at zero drive angles."""
        return float(np.sqrt(self.l2_mm**2 - (self.a_mm + self.l1_mm) ** 2))

    @cached_property
    def nominal_legs(self) -> FloatArray:
        """Numbers of the legs (3, 4) without deviations."""
        return np.tile([0.0, self.l1_mm, self.l2_mm, self.a_mm], (3, 1))

    def inverse_of_legs(self, position_mm: FloatArray, legs: FloatArray, sign: float) -> FloatArray:
        """Drive angles (n, 3) in rad under leg numbers (3, 4), elbows outwards for sign 1; NaN where out of reach."""
        position = points(position_mm)
        u, v = self.radial_tangential(position)
        depth = self.origin_depth_mm - position[:, 2:]
        inward = u - legs[:, 3]
        d = np.hypot(inward, depth)
        with np.errstate(invalid="ignore", divide="ignore"):
            cosine = (legs[:, 1] ** 2 + d**2 + v**2 - legs[:, 2] ** 2) / (2.0 * legs[:, 1] * d)
            # beyond the reach arccos gives NaN, which is the mask the callers rely on
            return np.asarray(np.arctan2(depth, inward) - sign * np.arccos(cosine) - legs[:, 0])

    def ends(self, theta_rad: FloatArray, legs: FloatArray) -> FloatArray:
        """Elbows moved inwards by the platform's radius, (..., n, 3 legs, 3) in mm, at angles (n, 3)."""
        angle = theta_rad + legs[..., 0]
        reach = legs[..., 3] + legs[..., 1] * np.cos(angle)
        height = self.origin_depth_mm - legs[..., 1] * np.sin(angle)
        return np.asarray(reach[..., None] * self.radial + height[..., None] * Z)

    def end_rates(self, theta_rad: FloatArray, legs: FloatArray) -> FloatArray:
        """Derivative (n, 3 legs, 3 axes, 4) of `ends` by the legs' numbers (3, 4)."""
        angle = theta_rad + legs[:, 0]
        cosine, sine = np.cos(angle)[..., None], np.sin(angle)[..., None]
        turned = -legs[:, 1, None] * (sine * self.radial + cosine * Z)
        columns = [turned, cosine * self.radial - sine * Z, np.zeros(3), self.radial]
        return np.stack([np.broadcast_to(column, turned.shape) for column in columns], axis=-1)

    def own_load(self, masses: Masses, motion: DriveMotion, _poses: Poses, gravity_mm_s2: FloatArray) -> FloatArray:
        """Torques (n, 3) in N mm of the arms' own masses about their drives; see `rrru.kinematics.dynamics`."""
        # component of gravity in the direction in which an end of an arm moves
        pulls = -np.cos(motion[0]) * gravity_mm_s2[2] - np.sin(motion[0]) * (self.radial @ gravity_mm_s2)
        return arm_load(masses, self.l1_mm, pulls, motion[2])
