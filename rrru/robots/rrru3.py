"""3-RRRU translational parallel robot (paper A): the nominal model of its controller.

Robot frame: origin at the centre of the static platform, z DOWN. Leg i stands at azimuth phi_i; with u the radial and v
the tangential coordinate of the platform's centre in leg i,

    X = u + r - R - L1 cos(theta),  Z = z - L1 sin(theta),  rho = L2 + sqrt(L3^2 - v^2),
    X^2 + Z^2 - rho^2 = 0                                                                           (eq. 8)

R and r enter only as r - R: of the 14 published errors, tied across the legs to 8, 7 can be identified. Lengths in mm,
angles in rad.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np

from rrru.arrays import FloatArray
from rrru.kinematics.chain import Poses
from rrru.kinematics.compiled import CompiledObjective
from rrru.kinematics.dynamics import Masses, arm_load
from rrru.kinematics.legs import Joint, Leg, Legs, Parts, X, Y, Z, turn_about
from rrru.kinematics.point_masses import DriveMotion
from rrru.robots import rrru3_kernels as kernels
from rrru.robots import rrru3_objective
from rrru.robots.three_legs import LEGS, Deviation, ThreeLegs, of_each, of_each_leg, of_three_legs, points, three_drives

ELBOW_SIGN = {"out": -1.0, "in": 1.0}
_LINKS, _SEATS = (1, 2, 3), ("foot", "elbow", "knee", "wrist", "cross", "platform")
# columns of the legs' numbers: offset of the drive's angle, L1, L2, L3, r - R
_DRIVES = of_each_leg("dtheta", 0, "rad")
_OWN_LINKS = {f"dL{leg}{link}": Deviation(link, leg) for leg in LEGS for link in _LINKS}
_TIED_LINKS = {f"dL{link}": Deviation(link) for link in _LINKS}
_RADII = {"dR": Deviation(4, factor=-1.0, site=("foot", 0)), "dr": Deviation(4)}
# R and r shift every leg by the same r - R and are not identifiable separately: da = dr - dR replaces both
_COMBINED = {"da": Deviation(4, share=2.0)}


@dataclass(frozen=True)
class Rrru3(ThreeLegs):
    """The robot with its nominal dimensions and the choice of its parameters.

    Dimensions in mm as in paper A, Table 2; parameter_set: published (14), tied (8), identifiable (7) or zero (3).
    """

    L1_mm: float = 400.0
    L2_mm: float = 100.0
    L3_mm: float = 800.0
    R_mm: float = 400.0
    r_mm: float = 400.0
    azimuth_rad: tuple[float, float, float] = (0.0, 2.0 * np.pi / 3.0, 4.0 * np.pi / 3.0)
    parameter_set: str = "identifiable"
    # ASSUME the paper prints no search bounds; these hold Table 6 read in radians (0.0201 rad) and twice the largest
    # printed length error
    angle_limit_rad: float = 0.03
    length_limit_mm: float = 4.0
    name: str = field(default="rrru3", init=False)

    TRACKED = RICHEST = "identifiable"  # by measured positions
    DIMENSIONS = ("L1_mm", "L2_mm", "L3_mm", "R_mm", "r_mm")
    DEVIATIONS = _DRIVES | _OWN_LINKS | _TIED_LINKS | _RADII | _COMBINED
    PARAMETER_NAMES: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "published": (*_DRIVES, *_OWN_LINKS, *_RADII),
        "tied": (*_DRIVES, *_TIED_LINKS, *_RADII),
        "identifiable": (*_DRIVES, *_TIED_LINKS, *_COMBINED),
        "zero": (*_DRIVES,),
    }
    SOURCE = "paper A, section 2.2; bounds assumed"
    COLUMN_SITES = (
        *((("drive", 4, -1.0),), (("elbow", 0, 1.0),), (("knee", 0, 1.0),), (("wrist", 0, 1.0),)),
        (("platform", 0, -1.0),),
    )
    up = (0.0, 0.0, -1.0)  # z points down
    parts = Parts(
        drives=three_drives("rad", 4, -1.0),
        feet=of_three_legs("foot"),
        links={f"dL{link}_leg": of_each(place) for link, place in ((1, "elbow"), (2, "knee"), (3, "wrist"))},
        members=of_each("wrist"),
        held_from=of_three_legs("elbow"),
    )

    @property
    def characteristic_length_mm(self) -> float:
        """Length that makes deviations of angles comparable with those of lengths."""
        return self.L1_mm

    @property
    def reach_mm(self) -> float:
        """Length of a stretched leg."""
        return self.L1_mm + self.L2_mm + self.L3_mm

    @cached_property
    def legs(self) -> Legs:
        """The chains: drive, then joints 2 to 5, the axes of the first, second and fifth across the leg's plane."""
        chains = []
        for leg, azimuth in zip(LEGS, self.azimuth_rad, strict=True):
            root = turn_about(Z, azimuth)
            joints = (
                Joint(f"leg {leg} root", turn=root),
                Joint(f"leg {leg} foot", shift_mm=self.R_mm * X),
                Joint(f"leg {leg} drive", "R", -Y, drive=leg - 1),
                Joint(f"leg {leg} elbow", "R", -Y, self.L1_mm * X, home=np.pi / 2.0),
                Joint(f"leg {leg} knee", "R", Z, self.L2_mm * X),
                Joint(f"leg {leg} wrist", "R", Z, self.L3_mm * X),
                Joint(f"leg {leg} cross", "R", -Y, home=-np.pi / 2.0),
                Joint(f"leg {leg} platform", shift_mm=-self.r_mm * X),
            )
            chains.append(Leg(f"leg {leg}", joints, end_turn=root.T))
        return Legs(tuple(chains), np.zeros(3), (self.L2_mm + self.L3_mm) * Z)

    @cached_property
    def nominal_legs(self) -> FloatArray:
        """Numbers of the legs (3, 5) without deviations."""
        return np.tile([0.0, self.L1_mm, self.L2_mm, self.L3_mm, self.r_mm - self.R_mm], (3, 1))

    def inverse(
        self, position_mm: FloatArray, deviations: FloatArray | None = None, elbow: str | Sequence[str] = "out"
    ) -> FloatArray:
        """Drive angles (n, 3) in rad for positions (n, 3) in mm; NaN where a leg cannot reach (eqs. 5, 6).

        `elbow` is "out" (the robot's assembly), "in", or one of these per leg.
        """
        return self.inverse_of_legs(position_mm, self.numbers(deviations), elbow)

    def inverse_of_legs(
        self, position_mm: FloatArray, legs: FloatArray, elbow: str | Sequence[str] = "out"
    ) -> FloatArray:
        """Drive angles (n, 3) in rad for positions (n, 3) in mm under leg numbers (3, 5)."""
        position = points(position_mm)
        signs = np.array([ELBOW_SIGN[e] for e in ((elbow,) * 3 if isinstance(elbow, str) else elbow)])
        u, v = self.radial_tangential(position)
        reach = u + legs[:, 4]
        d = np.hypot(reach, position[:, 2:])
        with np.errstate(invalid="ignore", divide="ignore"):
            rho = legs[:, 2] + np.sqrt(legs[:, 3] ** 2 - v**2)
            cosine = (legs[:, 1] ** 2 + d**2 - rho**2) / (2.0 * legs[:, 1] * d)
            # beyond the reach arccos gives NaN, which is the mask the callers rely on
            return np.asarray(np.arctan2(position[:, 2:], reach) + signs * np.arccos(cosine) - legs[:, 0])

    def forward(
        self, theta_rad: FloatArray, deviations: FloatArray | None = None, guess_mm: FloatArray | None = None
    ) -> FloatArray:
        """Positions (n, 3) in mm of drive angles (n, 3); NaN where Newton does not converge (eq. 8).

        `guess_mm` (n, 3) selects the assembly; without it Newton starts from the lower intersection of three spheres,
        see `guess`.
        """
        batch = None if deviations is None else np.asarray(deviations)[None]
        return np.asarray(self.forward_batch(theta_rad, batch, guess_mm)[0])

    def forward_batch(
        self, theta_rad: FloatArray, deviations: FloatArray | None = None, guess_mm: FloatArray | None = None
    ) -> FloatArray:
        """Positions (m, n, 3) in mm of n drive-angle triples under m vectors of deviations (m, p); see `forward`."""
        legs = self.numbers(deviations) if deviations is not None else self.numbers()[None]
        return self.forward_of_legs(theta_rad, legs, guess_mm)

    def guess(self, theta_rad: FloatArray, _targets: Sequence[str] | None = None) -> FloatArray:
        """Positions (n, 3) in mm of the nominal robot if joints 2 and 3 stood at one point: where three spheres meet.

        With rho = L2 + L3 on every leg each closure is a sphere about the elbow, shifted by r - R. Where the spheres do
        not meet, the point nearest to all three is taken.
        """
        theta = points(theta_rad)
        cx, cy = self.azimuth_cos_sin
        radial = self.L1_mm * np.cos(theta) - (self.r_mm - self.R_mm)
        centre = np.stack([radial * cx, radial * cy, self.L1_mm * np.sin(theta)], axis=-1)
        first, second, third = centre[:, 0], centre[:, 1], centre[:, 2]
        b, c = second - first, third - first
        normal = np.cross(b, c)
        area = np.linalg.norm(normal, axis=1, keepdims=True)
        # the circumcentre of the elbows is as far from each of them
        across = (b**2).sum(1, keepdims=True) * c - (c**2).sum(1, keepdims=True) * b
        offset = np.cross(across, normal) / (2.0 * area**2)
        height = np.sqrt(np.maximum((self.L2_mm + self.L3_mm) ** 2 - (offset**2).sum(1, keepdims=True), 0.0))
        down = np.where(normal[:, 2:] < 0.0, -1.0, 1.0)
        return np.asarray(first + offset + down * normal / area * height)

    def forward_of_legs(
        self, theta_rad: FloatArray, legs: FloatArray, guess_mm: FloatArray | None = None
    ) -> FloatArray:
        """Positions (m, n, 3) in mm of drive angles (n, 3) under m sets of leg numbers (m, 3, 5)."""
        theta = points(theta_rad)
        start = self.guess(theta) if guess_mm is None else points(guess_mm)
        solved = kernels.forward(
            np.ascontiguousarray(legs, dtype=float),
            self.azimuth_cos_sin,
            np.ascontiguousarray(np.cos(theta).T),
            np.ascontiguousarray(np.sin(theta).T),
            np.ascontiguousarray(start.T),
        )
        return solved.transpose(0, 2, 1)

    def mean_distance(
        self, theta_rad: FloatArray, nominal_mm: FloatArray, measured_mm: FloatArray
    ) -> CompiledObjective:
        """CompiledObjective: mean distance from measured positions (n, 3) in mm, near the nominal ones (n, 3)."""
        arrays = rrru3_objective.arrays(self, points(theta_rad), nominal_mm, measured_mm)
        return CompiledObjective(rrru3_objective.kernel(), *arrays)

    def closure(
        self, position_mm: FloatArray, theta_rad: FloatArray, deviations: FloatArray | None = None
    ) -> FloatArray:
        """Left sides (n, 3) of eq. (8) in mm^2, zero where position and drive angles fit."""
        big_x, big_z, _, rho, _, _ = self._chain(position_mm, theta_rad, self.numbers(deviations))
        return big_x**2 + big_z**2 - rho**2

    def closure_jacobians(
        self, position_mm: FloatArray, theta_rad: FloatArray, deviations: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives of the closures by the position (n, 3, 3) in mm and by the legs' numbers (n, 3, 5)."""
        legs = self.numbers(deviations)
        big_x, big_z, side, rho, s, angle = self._chain(position_mm, theta_rad, legs)
        cx, cy = self.azimuth_cos_sin
        by_position = 2.0 * np.stack([big_x * cx - side * cy, big_x * cy + side * cx, big_z], axis=-1)
        arm, forearm = legs[:, 1], legs[:, 3]
        across = arm * (big_x * np.sin(angle) - big_z * np.cos(angle))
        along = -(big_x * np.cos(angle) + big_z * np.sin(angle))
        return by_position, 2.0 * np.stack([across, along, -rho, -rho * forearm / s, big_x], axis=-1)

    def passive_angles(
        self, position_mm: FloatArray, theta_rad: FloatArray, deviations: FloatArray | None = None
    ) -> FloatArray:
        """Angles (n, 3 legs, 4) of joints 2 to 5 in rad; theta3 = arcsin(v / L3) keeps the sign that eq. (6) loses.

        Joint 4 undoes joint 3 and joint 5 undoes joints 1 and 2, so that the platform does not turn.
        """
        legs = self.numbers(deviations)
        big_x, big_z, _, _, _, angle = self._chain(position_mm, theta_rad, legs)
        _, v = self.radial_tangential(points(position_mm))
        plane = np.arctan2(big_z, big_x)
        second = np.arctan2(np.sin(plane - angle), np.cos(plane - angle))
        third = np.arcsin(v / legs[:, 3])
        return np.stack([second, third, -third, -(angle + second)], axis=-1)

    @property
    def seats(self) -> tuple[str, ...]:
        """Sites of the axes that a manufacturer may have set wrongly; joint 1's is on the foot."""
        return tuple(f"leg {leg} {kind}" for leg in LEGS for kind in _SEATS)

    def passive_near(self, position_mm: FloatArray, theta_rad: FloatArray) -> FloatArray:
        """Angles (n, 12) of joints 2 to 5 of every leg near positions (n, 3), of the nominal robot there."""
        return self.passive_angles(position_mm, self.inverse(position_mm)).reshape(-1, 12)

    def own_load(self, masses: Masses, motion: DriveMotion, _poses: Poses, gravity_mm_s2: FloatArray) -> FloatArray:
        """Torques (n, 3) in N mm of the arms' own masses about their drives; see `rrru.kinematics.dynamics`."""
        cosine, sine = self.azimuth_cos_sin
        outward, down = gravity_mm_s2[0] * cosine + gravity_mm_s2[1] * sine, gravity_mm_s2[2]
        pulls = np.cos(motion[0]) * down - np.sin(motion[0]) * outward
        return arm_load(masses, self.L1_mm, pulls, motion[2])

    def constraint_moments(
        self, position_mm: FloatArray, theta_rad: FloatArray, deviations: FloatArray | None = None
    ) -> FloatArray:
        """Unit directions (n, 3 legs, 3) about which each leg keeps the platform from turning.

        b_i = t_i x a_3i, where t_i is the direction of joints 1, 2 and 5 and a_3i that of joints 3 and 4; it points
        from joint 2 along L2.
        """
        passive = self.passive_angles(position_mm, theta_rad, deviations)
        plane = np.asarray(theta_rad, dtype=float) + self.numbers(deviations)[:, 0] + passive[..., 0]
        cx, cy = self.azimuth_cos_sin
        return np.stack([np.cos(plane) * cx, np.cos(plane) * cy, np.sin(plane)], axis=-1)

    def _chain(
        self, position_mm: FloatArray, theta_rad: FloatArray, legs: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
        """X, Z, rho v / s, rho, s and the true drive angle of every leg at every point, each (n, 3)."""
        position = points(position_mm)
        angle = points(theta_rad) + legs[:, 0]
        u, v = self.radial_tangential(position)
        with np.errstate(invalid="ignore"):
            s = np.sqrt(legs[:, 3] ** 2 - v**2)
        rho = legs[:, 2] + s
        big_x = u + legs[:, 4] - legs[:, 1] * np.cos(angle)
        big_z = position[:, 2:] - legs[:, 1] * np.sin(angle)
        return big_x, big_z, rho * v / s, rho, s, angle
