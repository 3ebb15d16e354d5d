"""What all mechanisms here share: three legs, each with one closure, and a platform that follows them. mm, rad."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from rrru.errors import ConfigError, UnreachableError
from rrru.parameters import LEGS, Parameter, ParameterSet


@dataclass(frozen=True)
class Deviation:
    """How a parameter changes the legs' numbers: by a factor, in a column of one leg (1 to 3) or of all (0).

    share: its bound, as a share of the mechanism's limit for angles or lengths.
    """

    column: int
    leg: int = 0
    unit: str = "mm"
    factor: float = 1.0
    share: float = 1.0


def of_each_leg(name, column, unit="mm"):
    """Deviations of one number of every leg: name1, name2 and name3."""
    return {f"{name}{leg}": Deviation(column, leg, unit) for leg in LEGS}


class ThreeLegs:
    """Base of the mechanisms, which add `inverse`, `closure_jacobians`, `azimuth_rad`, both limits and `parameter_set`.

    DIMENSIONS: fields that must be positive; DEVIATIONS: parameters by name; PARAMETER_NAMES: sets of them by name;
    SOURCE: of the parameters; nominal_legs (3, k): numbers of the legs, the first what an actuator's value adds to.
    """

    DIMENSIONS = ()
    DEVIATIONS: ClassVar = {}
    PARAMETER_NAMES: ClassVar = {}
    SOURCE = ""

    def __post_init__(self):
        for key in (*self.DIMENSIONS, "angle_limit_rad", "length_limit_mm"):
            if not getattr(self, key) > 0.0:
                raise ConfigError(f"{self.name}: {key} is {getattr(self, key)}; allowed: a positive number")
        if self.parameter_set not in self.PARAMETER_NAMES:
            known = ", ".join(self.PARAMETER_NAMES)
            raise ConfigError(f"{self.name}: parameter_set is {self.parameter_set!r}; allowed: {known}")

    @cached_property
    def parameters(self):
        """The parameters of the chosen set, nominally zero: the meaning of every vector of deviations (p,)."""
        limits = {"rad": self.angle_limit_rad, "mm": self.length_limit_mm}
        named = {name: self.DEVIATIONS[name] for name in self.PARAMETER_NAMES[self.parameter_set]}
        bounds = {name: one.share * limits[one.unit] for name, one in named.items()}
        return ParameterSet(
            tuple(
                Parameter(name, one.unit, 0.0, -bounds[name], bounds[name], self.SOURCE, one.leg)
                for name, one in named.items()
            )
        )

    @cached_property
    def leg_map(self):
        """Derivative of the legs' numbers by the parameters, shape (3, k, p)."""
        return np.stack([self.leg_changes({name: 1.0}) for name in self.parameters.names], axis=-1)

    def leg_changes(self, values):
        """Changes (3, k) of the legs' numbers by values of any of DEVIATIONS; a leg's own replaces that of all legs."""
        result = np.zeros(self.nominal_legs.shape)
        for name, value in sorted(values.items(), key=lambda item: self.DEVIATIONS[item[0]].leg):
            one = self.DEVIATIONS[name]
            if one.leg:
                result[one.leg - 1, one.column] = one.factor * value
            else:
                result[:, one.column] += one.factor * value
        return result

    @cached_property
    def azimuth_cos_sin(self):
        """Cosines and sines of the legs' azimuths, shape (2, 3)."""
        return np.array([np.cos(self.azimuth_rad), np.sin(self.azimuth_rad)])

    @cached_property
    def leg_axes(self):
        """Frames of the legs, radial, tangential and along z, as rows of (3 legs, 3 axes, 3)."""
        (cosine, sine), zero = self.azimuth_cos_sin, np.zeros(3)
        up = np.broadcast_to([0.0, 0.0, 1.0], (3, 3))
        return np.stack([np.stack([cosine, sine, zero], axis=-1), np.stack([-sine, cosine, zero], axis=-1), up], axis=1)

    @property
    def radial(self):
        """Outward unit vectors (3 legs, 3)."""
        return self.leg_axes[:, 0]

    @property
    def tangent(self):
        """Tangential unit vectors (3 legs, 3), from x towards y."""
        return self.leg_axes[:, 1]

    def radial_tangential(self, position):
        """Coordinates u and v (n, 3 legs) of points (n, 3) along the legs' radial and tangential directions."""
        (cosine, sine), x, y = self.azimuth_cos_sin, position[:, :1], position[:, 1:2]
        return x * cosine + y * sine, y * cosine - x * sine

    def legs(self, deviations=None):
        """Numbers of the legs, shape (..., 3, k), under deviations of shape (..., p)."""
        if deviations is None:
            return self.nominal_legs
        return self.nominal_legs + np.einsum("lcp,...p->...lc", self.leg_map, np.asarray(deviations, dtype=float))

    def require_reachable(self, position_mm, deviations=None):
        """Actuator values as `inverse` gives them; raises UnreachableError naming the first point out of reach."""
        values = self.inverse(position_mm, deviations)
        bad = np.flatnonzero(np.isnan(values).any(axis=1))
        if bad.size:
            x, y, z = np.asarray(position_mm, dtype=float)[bad[0]]
            legs = ", ".join(str(i + 1) for i in np.flatnonzero(np.isnan(values[bad[0]])))
            raise UnreachableError(
                f"point {bad[0] + 1} at ({x:.3f}, {y:.3f}, {z:.3f}) mm is out of reach of leg {legs}; "
                f"{bad.size} of {len(values)} points cannot be reached"
            )
        return values

    def leg_jacobian(self, position_mm, actuators, deviations=None):
        """Derivative of the position by the legs' numbers, shape (n, 3 axes, 3 legs, k)."""
        by_position, by_leg = self.closure_jacobians(position_mm, actuators, deviations)
        return -np.einsum("nal,nlc->nalc", np.linalg.inv(by_position), by_leg)

    def actuator_jacobian(self, position_mm, actuators, deviations=None):
        """Derivative of the position by the actuator values, shape (n, 3, 3)."""
        return self.leg_jacobian(position_mm, actuators, deviations)[..., 0]

    def parameter_jacobian(self, position_mm, actuators, deviations=None):
        """Derivative of the position by the parameters, shape (n, 3, p)."""
        return np.einsum("nalc,lcp->nap", self.leg_jacobian(position_mm, actuators, deviations), self.leg_map)


def points(array):
    """The argument as a float array of shape (n, 3); raises ValueError for another shape."""
    array = np.asarray(array, dtype=float)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"expected shape (n, 3), got {array.shape}")
    return array
