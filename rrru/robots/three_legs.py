"""Common base of robots with a closed form: three legs, each with one closure, and a platform that follows. mm, rad.

A leg's frame has x outwards, y to the side and z as the robot's; a site's name is its leg's and what it is.
"""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import numpy.typing as npt

from rrru.arrays import FloatArray
from rrru.errors import ConfigError
from rrru.kinematics import singularity, workspace
from rrru.kinematics.legs import Drive, unit_twist
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

# numbers of the legs
LEGS = (1, 2, 3)


@dataclass(frozen=True)
class Deviation:
    """Change of the legs' numbers by a parameter: by a factor, in a column of one leg (1 to 3) or of all (0).

    share: its bound, as a share of the robot's limit for angles or lengths; site: where it acts and on which component
    of the twist, where that is not its column's site.
    """

    column: int
    leg: int = 0
    unit: str = "mm"
    factor: float = 1.0
    share: float = 1.0
    site: tuple[str, int] | None = None


def of_each_leg(name: str, column: int, unit: str = "mm") -> dict[str, Deviation]:
    """Deviations of one number of every leg: name1, name2 and name3."""
    return {f"{name}{leg}": Deviation(column, leg, unit) for leg in LEGS}


def of_three_legs(site: str) -> tuple[str, ...]:
    """Names of a site of the three legs."""
    return tuple(f"leg {leg} {site}" for leg in LEGS)


def of_each(site: str) -> tuple[tuple[str, ...], ...]:
    """Names of a site of the three legs, each a group of its own."""
    return tuple((name,) for name in of_three_legs(site))


def three_drives(unit: str, component: int, factor: float = 1.0) -> tuple[Drive, ...]:
    """The Drives of three legs, which turn or slide by one component of the twists at their sites "drive"."""
    column = "theta{}_rad" if unit == "rad" else "slider{}_mm"
    twist = unit_twist(component, factor)
    return tuple(Drive(column.format(leg), unit, f"leg {leg} drive", twist) for leg in LEGS)


class ThreeLegs(Robot):
    """Base of the mechanisms, which add `inverse`, `closure_jacobians`, `azimuth_rad`, both limits and `parameter_set`.

    DIMENSIONS: fields that must be positive; DEVIATIONS: parameters by name; PARAMETER_NAMES: sets of them by name;
    SOURCE: of the parameters; nominal_legs (3, k): numbers of the legs, the first the offset of an actuator's value;
    COLUMN_SITES: by column where a change acts: sites of a leg, each with the component of its twist and a factor.
    """

    DIMENSIONS: ClassVar[tuple[str, ...]] = ()
    DEVIATIONS: ClassVar[Mapping[str, Deviation]] = {}
    PARAMETER_NAMES: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    SOURCE = ""
    COLUMN_SITES: ClassVar[tuple[tuple[tuple[str, int, float], ...], ...]] = ()
    SEARCHED = "tied"
    drive_range = None
    closed_form = True
    azimuth_rad: tuple[float, float, float]
    parameter_set: str
    angle_limit_rad: float
    length_limit_mm: float

    if TYPE_CHECKING:

        @property
        def nominal_legs(self) -> FloatArray:
            """Numbers of the legs (3, k) without deviations."""

    @abstractmethod
    def closure_jacobians(
        self, position_mm: FloatArray, actuators: FloatArray, deviations: FloatArray | None = None, /
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives of the closures by the position (n, 3, 3) in mm and by the legs' numbers (n, 3, k)."""

    @abstractmethod
    def constraint_moments(
        self, position_mm: FloatArray, actuators: FloatArray, deviations: FloatArray | None = None, /
    ) -> FloatArray:
        """Unit directions (n, 3 legs, 3) about which each leg keeps the platform from turning."""

    def __post_init__(self) -> None:
        for key in (*self.DIMENSIONS, "angle_limit_rad", "length_limit_mm"):
            if not getattr(self, key) > 0.0:
                raise ConfigError(f"{self.name}: {key} is {getattr(self, key)}; allowed: a positive number")
        if self.parameter_set not in self.PARAMETER_NAMES:
            known = ", ".join(self.PARAMETER_NAMES)
            raise ConfigError(f"{self.name}: parameter_set is {self.parameter_set!r}; allowed: {known}")

    @cached_property
    def parameters(self) -> ParameterSet:
        """The parameters of the chosen set, nominally zero: the meaning of every vector of deviations (p,)."""
        limits = {"rad": self.angle_limit_rad, "mm": self.length_limit_mm}
        named = {name: self.DEVIATIONS[name] for name in self.PARAMETER_NAMES[self.parameter_set]}
        bounds = {name: deviation.share * limits[deviation.unit] for name, deviation in named.items()}
        return ParameterSet(
            tuple(
                Parameter(name, deviation.unit, 0.0, -bounds[name], bounds[name], self.SOURCE, deviation.leg)
                for name, deviation in named.items()
            )
        )

    @cached_property
    def leg_map(self) -> FloatArray:
        """Derivative of the legs' numbers by the parameters, shape (3, k, p)."""
        return np.stack([self.leg_changes({name: 1.0}) for name in self.parameters.names], axis=-1)

    @property
    def size_mm(self) -> float:
        """Sum of the robot's lengths."""
        # every mechanism is a dataclass, this class is none
        names = [f.name for f in fields(self) if f.name.endswith("_mm")]  # type: ignore[arg-type]
        return float(sum(np.sum(np.abs(getattr(self, name))) for name in names))

    @property
    def farthest_mm(self) -> float:
        """Distance of the farthest reachable point from the origin."""
        return workspace.farthest_mm(self)

    def identifiable(self, values: dict[str, float]) -> dict[str, float]:
        """Mapping of the parameters, no two of which act alike, from values of any of DEVIATIONS; absent ones are zero.

        NaN for a parameter common to all legs where the legs differ.
        """
        changes, result = self.leg_changes(values), {}
        for name in self.parameters.names:
            deviation = self.DEVIATIONS[name]
            legs = changes[:, deviation.column] / deviation.factor
            result[name] = float(legs[deviation.leg - 1] if deviation.leg or (legs == legs[0]).all() else np.nan)
        return result

    def leg_changes(self, values: Mapping[str, float]) -> FloatArray:
        """Changes (3, k) of the legs' numbers by values of any of DEVIATIONS; a leg's own replaces that of all legs."""
        result = np.zeros(self.nominal_legs.shape)
        for name, value in sorted(values.items(), key=lambda item: self.DEVIATIONS[item[0]].leg):
            deviation = self.DEVIATIONS[name]
            if deviation.leg:
                result[deviation.leg - 1, deviation.column] = deviation.factor * value
            else:
                result[:, deviation.column] += deviation.factor * value
        return result

    @property
    def deviation_names(self) -> tuple[str, ...]:
        """Names of the deviations that `twists_of` knows: those of all sets."""
        return tuple(self.DEVIATIONS)

    def twists_of(self, values: Mapping[str, float]) -> FloatArray:
        """Twists (1, sites, 6) by values of any of DEVIATIONS."""
        placed = [(place, value) for name, value in values.items() if (place := self.DEVIATIONS[name].site)]
        changes = self.leg_changes({name: value for name, value in values.items() if not self.DEVIATIONS[name].site})
        result, numbers = np.zeros((1, len(self.legs.sites), 6)), self.legs.site_numbers
        for leg in LEGS:
            for change, sites in zip(changes[leg - 1], self.COLUMN_SITES, strict=True):
                for site, component, factor in sites:
                    result[0, numbers[f"leg {leg} {site}"], component] += factor * change
            for (site, component), value in placed:
                result[0, numbers[f"leg {leg} {site}"], component] += value
        return result

    @cached_property
    def directions(self) -> FloatArray:
        """Twists (sites, 6, p) that a unit of each parameter makes."""
        return np.stack([self.twists_of({name: 1.0})[0] for name in self.parameters.names], axis=-1)

    @cached_property
    def azimuth_cos_sin(self) -> FloatArray:
        """Cosines and sines of the legs' azimuths, shape (2, 3)."""
        return np.array([np.cos(self.azimuth_rad), np.sin(self.azimuth_rad)])

    @cached_property
    def radial(self) -> FloatArray:
        """Outward unit vectors (3 legs, 3)."""
        cosine, sine = self.azimuth_cos_sin
        return np.stack([cosine, sine, np.zeros(3)], axis=-1)

    @cached_property
    def tangent(self) -> FloatArray:
        """Tangential unit vectors (3 legs, 3), from x towards y."""
        cosine, sine = self.azimuth_cos_sin
        return np.stack([-sine, cosine, np.zeros(3)], axis=-1)

    def radial_tangential(self, position: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Coordinates u and v (n, 3 legs) of points (n, 3) along the legs' radial and tangential directions."""
        (cosine, sine), x, y = self.azimuth_cos_sin, position[:, :1], position[:, 1:2]
        return x * cosine + y * sine, y * cosine - x * sine

    def numbers(self, deviations: FloatArray | None = None) -> FloatArray:
        """Numbers of the legs, shape (..., 3, k), under deviations of shape (..., p)."""
        if deviations is None:
            return self.nominal_legs
        change = np.einsum("lcp,...p->...lc", self.leg_map, np.asarray(deviations, dtype=float))
        return np.asarray(self.nominal_legs + change)

    def singularities(
        self, position_mm: FloatArray, actuators: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Translational and constraint measure and constraint determinant, each (n,); see
        `rrru.kinematics.singularity`.
        """
        return (
            singularity.translational_measure(self, position_mm, actuators),
            singularity.constraint_measure(self, position_mm, actuators),
            singularity.constraint_determinant(self, position_mm, actuators),
        )

    def leg_jacobian(
        self, position_mm: FloatArray, actuators: FloatArray, deviations: FloatArray | None = None
    ) -> FloatArray:
        """Derivative of the position by the legs' numbers, shape (n, 3 axes, 3 legs, k)."""
        by_position, by_leg = self.closure_jacobians(position_mm, actuators, deviations)
        return np.linalg.inv(by_position)[..., None] * -by_leg[:, None]

    def actuator_jacobian(
        self, position_mm: FloatArray, actuators: FloatArray, deviations: FloatArray | None = None
    ) -> FloatArray:
        """Derivative of the position by the actuator values, shape (n, 3, 3)."""
        return self.leg_jacobian(position_mm, actuators, deviations)[..., 0]

    def parameter_jacobian(
        self, position_mm: FloatArray, actuators: FloatArray, deviations: FloatArray | None = None
    ) -> FloatArray:
        """Derivative of the position by the parameters, shape (n, 3, p)."""
        by_legs = self.leg_jacobian(position_mm, actuators, deviations)
        return by_legs.reshape(*by_legs.shape[:2], -1) @ self.leg_map.reshape(-1, self.leg_map.shape[-1])


def points(array: npt.ArrayLike) -> FloatArray:
    """The argument as a float array of shape (n, 3); raises ValueError for another shape."""
    array = np.asarray(array, dtype=float)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"expected shape (n, 3), got {array.shape}")
    return array
