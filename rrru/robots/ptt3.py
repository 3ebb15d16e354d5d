"""3-PTT translational parallel robot (paper B) and, with upright rails, the linear delta: nominal model.

Three carriages run on rails at the azimuths phi_i, screw-driven; two bars of length L side by side, on ball joints, tie
each to the platform. Robot frame: origin at the static platform's centre in the plane of the rails' zero marks, x
along the first rail, z UP. The rails rise outwards by the inclination gamma: 0 is paper B's robot, a right angle the
linear delta, whose carriages run upright. With the outward direction e_i, the slider position b_i along d_i and a = R -
r,

    E_i = a e_i + b_i d_i,   d_i = cos(gamma) e_i + sin(gamma) z,   |P - E_i|^2 = L^2               (eq. 1)
    b_i = -w_i . d_i + sqrt((w_i . d_i)^2 - |w_i|^2 + L^2),   w_i = a e_i - P                       (eq. 2)

the root whose carriage stands outside of (gamma = 0) or above (upright) the platform. For gamma = 0, with the radial
and tangential coordinates u, v of P, b_i = u_i - a + D_i, D_i = sqrt(L^2 - v_i^2 - Z^2), and J of db = J dp (eqs. 4,
10) has the determinant

    det J = -Z kappa / (D_1 D_2 D_3),   (i, j, k) cyclic,
    kappa = sum_i [ sqrt(3)/2 (D_j D_k + v_j v_k) + (v_k D_j - v_j D_k) / 2 ]

# ASSUME The scan has lost eqs. (1) to (9) and Table 1; these are ours. R and r enter only as R - r, and along
horizontal rails an error of R - r is a common one of the sliders. Lengths in mm, angles in rad.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np

from rrru.arrays import FloatArray
from rrru.errors import ConfigError
from rrru.kinematics.chain import Poses
from rrru.kinematics.dynamics import PER_NEWTON, Masses
from rrru.kinematics.legs import Joint, Leg, Legs, Parts, X, Y, Z, turn_about
from rrru.kinematics.point_masses import DriveMotion
from rrru.robots.three_legs import LEGS, Deviation, of_each_leg, of_three_legs, points, three_drives
from rrru.robots.tripod import BARS, Tripod, pair_of_bars

# columns of the legs' numbers: offset of the slider, L, a = R - r; azimuth, rise and swing of the rail
_SLIDERS, _LINKS = of_each_leg("db", 0), of_each_leg("dL", 1)
_RAILS = of_each_leg("dphi", 3, "rad") | of_each_leg("rise", 4, "rad") | of_each_leg("swing", 5, "rad")
# the first two azimuths only: heights and distances do not determine the base's rotation, so the third is fixed
_BASE = ("da", "dphi1", "dphi2")


@dataclass(frozen=True)
class Ptt3(Tripod):
    """The robot with its nominal dimensions in mm and its parameter_set, a key of PARAMETER_NAMES.

    rail_inclination_rad: 0 horizontal rails, pi / 2 upright ones. "tied" leaves out a = R - r, which is confounded with
    the sliders' zero offsets for horizontal rails.
    """

    L_mm: float = 350.0  # ASSUME this and the next two: Table 1 is lost
    R_mm: float = 300.0
    r_mm: float = 60.0
    spacing_mm: float = 60.0  # ASSUME distance of a link's two bars; as r_mm it acts on the platform's tilt only
    rail_inclination_rad: float = 0.0
    azimuth_rad: tuple[float, float, float] = (0.0, 2.0 * np.pi / 3.0, 4.0 * np.pi / 3.0)
    parameter_set: str = "tied"
    angle_limit_rad: float = 0.05
    length_limit_mm: float = 10.0
    name: str = field(default="ptt3", init=False)

    LINK = 1
    TRACKED = "tied"
    RICHEST = "rails"
    DIMENSIONS = ("L_mm", "R_mm", "r_mm", "spacing_mm")
    DEVIATIONS = _SLIDERS | _LINKS | _RAILS | {"dL": Deviation(1), "da": Deviation(2)}
    PARAMETER_NAMES: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "zero": (*_SLIDERS,),
        "tied": (*_SLIDERS, "dL"),
        "legs": (*_SLIDERS, *_LINKS),
        "rails": (*_SLIDERS, *_LINKS, *(f"{kind}{leg}" for leg in LEGS for kind in ("dphi", "rise", "swing"))),
        "heights": (*_BASE, *_SLIDERS),
        "distances": (*_BASE, *_SLIDERS, *_LINKS),
    }
    SOURCE = "paper B, 2.2; bounds assumed"
    # ASSUME the ball joints stay level and side by side on a rail with another direction: a turn before the drive is
    # undone behind it. Only a = R - r is known: an azimuth turns it about the platform's joint
    COLUMN_SITES = (
        *((("drive", 0, 1.0),), (("a bar", 0, 1.0), ("b bar", 0, 1.0)), (("foot", 0, 1.0),)),
        *((("azimuth", 5, 1.0), ("bracket", 5, -1.0)), (("foot", 4, -1.0), ("upright", 4, 1.0))),
        (("rail", 5, 1.0), ("carriage", 5, -1.0)),
    )
    parts = Parts(
        drives=three_drives("mm", 0),
        feet=of_three_legs("foot"),
        links={"dL_leg": BARS},
        members=BARS,
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.rail_inclination_rad <= np.pi / 2.0 + 1e-12:
            raise ConfigError(f"ptt3: rail_inclination_rad is {self.rail_inclination_rad}; allowed: 0 to pi / 2")

    @property
    def characteristic_length_mm(self) -> float:
        """Length that makes deviations of angles comparable with those of lengths."""
        return self.R_mm

    @property
    def reach_mm(self) -> float:
        """Length of a link."""
        return self.L_mm

    @cached_property
    def legs(self) -> Legs:
        """Six bars, two on every carriage, side by side."""
        rise = turn_about(-Y, self.rail_inclination_rad)
        bars: list[Leg] = []
        for leg, azimuth, (zero, link, offset, *_) in zip(LEGS, self.azimuth_rad, self.nominal_legs, strict=True):
            root = turn_about(Z, azimuth)
            carriage = (
                Joint(f"leg {leg} root", turn=root),
                Joint(f"leg {leg} azimuth", shift_mm=self.r_mm * X),
                Joint(f"leg {leg} foot", shift_mm=offset * X),
                Joint(f"leg {leg} rail", turn=rise),
                Joint(f"leg {leg} drive", "P", X, zero * X, drive=leg - 1),
                Joint(f"leg {leg} carriage"),
                Joint(f"leg {leg} upright", turn=rise.T),
                Joint(f"leg {leg} bracket"),
            )
            bars += pair_of_bars(leg, carriage, root, (link, self.r_mm, self.spacing_mm))
        return Legs(tuple(bars), np.full(3, self.L_mm / 2.0))

    @cached_property
    def nominal_legs(self) -> FloatArray:
        """Numbers of the legs (3, 6) without deviations."""
        return np.tile([0.0, self.L_mm, self.R_mm - self.r_mm, 0.0, 0.0, 0.0], (3, 1))

    def inverse_of_legs(self, position_mm: FloatArray, legs: FloatArray, sign: float) -> FloatArray:
        """Slider positions (n, 3) in mm under leg numbers (3, 6) by the root of that sign (eq. 2); NaN out of reach."""
        outward, _, rail = self._directions(legs)
        w = legs[:, 2, None] * outward - points(position_mm)[:, None, :]
        along = (w * rail).sum(axis=-1)
        with np.errstate(invalid="ignore"):
            # beyond the reach the root gives NaN, which is the mask the callers rely on
            root = np.sqrt(along**2 - (w**2).sum(axis=-1) + legs[:, self.LINK] ** 2)
            return np.asarray(-along + sign * root - legs[:, 0])

    def ends(self, slider_mm: FloatArray, legs: FloatArray) -> FloatArray:
        """Links' driven ends less the platform's radius, (..., n, 3 legs, 3) in mm, for slider positions (n, 3)."""
        outward, _, rail = self._directions(legs)
        return legs[..., 2, None] * outward + (slider_mm + legs[..., 0])[..., None] * rail

    def end_rates(self, slider_mm: FloatArray, legs: FloatArray) -> FloatArray:
        """Derivative (n, 3 legs, 3 axes, 6) of `ends` by the legs' numbers (3, 6)."""
        outward, sideways, rail = self._directions(legs)
        along = (slider_mm + legs[:, 0])[..., None]
        rise, swing = self.rail_inclination_rad + legs[:, 4, None], legs[:, 5, None]
        shape = np.broadcast_shapes(along.shape, rail.shape)
        columns = [
            rail,
            np.zeros(3),
            outward,
            legs[:, 2, None] * sideways + along * (np.cos(swing) * np.cos(rise) * sideways - np.sin(swing) * outward),
            along * np.cos(swing) * (np.cos(rise) * Z - np.sin(rise) * outward),
            along * (np.cos(swing) * sideways - np.sin(swing) * (np.cos(rise) * outward + np.sin(rise) * Z)),
        ]
        return np.stack([np.broadcast_to(column, shape) for column in columns], axis=-1)

    def rails(self, deviations: FloatArray | None = None) -> FloatArray:
        """Unit directions (3 legs, 3) in which the sliders count up."""
        return self._directions(self.numbers(deviations))[2]

    def own_load(self, masses: Masses, motion: DriveMotion, _poses: Poses, gravity_mm_s2: FloatArray) -> FloatArray:
        """Forces (n, 3) in N of the carriages' own masses along their rails; see `rrru.kinematics.dynamics`."""
        along = self.rails() @ gravity_mm_s2
        return (masses.arm_kg + 0.5 * masses.forearm_kg) * (along - motion[2]) / PER_NEWTON

    def jacobian(
        self, position_mm: FloatArray, slider_mm: FloatArray, deviations: FloatArray | None = None
    ) -> FloatArray:
        """J (n, 3, 3) of db = J dp, exact at slider positions that fit the position (eqs. 4, 10)."""
        link = self.link_directions(position_mm, slider_mm, deviations)
        return np.asarray(link / (link * self.rails(deviations)).sum(axis=-1, keepdims=True))

    def determinant_factors(self, position_mm: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Z, kappa and D (3) of det J = -Z kappa / (D_1 D_2 D_3), each over n points, D (n, 3); horizontal rails only.

        Raises ConfigError for other rails.
        """
        if self.rail_inclination_rad != 0.0:
            rise = self.rail_inclination_rad
            raise ConfigError(f"the factors of det J hold for horizontal rails, not for {rise} rad")
        position = points(position_mm)
        _, v = self.radial_tangential(position)
        with np.errstate(invalid="ignore"):
            d = np.sqrt(self.L_mm**2 - v**2 - position[:, 2:] ** 2)
        kappa = np.zeros(len(position))
        for j, k in ((1, 2), (2, 0), (0, 1)):
            across = v[:, k] * d[:, j] - v[:, j] * d[:, k]
            kappa += np.sqrt(0.75) * (d[:, j] * d[:, k] + v[:, j] * v[:, k]) + 0.5 * across
        return position[:, 2], kappa, d

    def _directions(self, legs: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Outward, sideways and rail direction of every leg, each (..., 3 legs, 3), under leg numbers (..., 3, 6)."""
        azimuth, swing = np.asarray(self.azimuth_rad) + legs[..., 3], legs[..., 5, None]
        rise = self.rail_inclination_rad + legs[..., 4, None]
        zero = np.zeros_like(azimuth)
        outward = np.stack([np.cos(azimuth), np.sin(azimuth), zero], axis=-1)
        sideways = np.stack([-np.sin(azimuth), np.cos(azimuth), zero], axis=-1)
        upright = np.cos(rise) * outward + np.sin(rise) * Z
        return outward, sideways, np.cos(swing) * upright + np.sin(swing) * sideways
