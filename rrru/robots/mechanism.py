"""What every mechanism offers to calibration and plant, and the mechanisms by name. Lengths in mm, angles in rad."""

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any, Protocol

import numpy as np

from rrru.errors import ConfigError
from rrru.parameters import ParameterSet
from rrru.robots.delta import Delta
from rrru.robots.ptt3 import Ptt3
from rrru.robots.rrru3 import Rrru3

Array = np.ndarray


class Mechanism(Protocol):
    """A parallel robot as its controller believes it to be, with small deviations of its numbers.

    drive_unit: "rad" or "mm", unit of an actuator value; TRACKED: the set of parameters that measured positions
    identify; angle_arm_mm: the length that makes angles comparable with lengths; lengths_mm (5,):
    nominal R, L1, L2, L3, r as effects count them, 0 for what a robot does not have.
    """

    name: str
    parameters: ParameterSet
    drive_unit: str
    TRACKED: str
    angle_arm_mm: float
    lengths_mm: Array

    def inverse(self, position_mm: Array, deviations: Array | None = None, elbow: str = "out") -> Array:
        """Actuator values (n, k) for positions (n, 3) in an assembly ("out", "in"); NaN where out of reach."""

    def forward(self, actuators: Array, deviations: Array | None = None, guess_mm: Array | None = None) -> Array:
        """Positions (n, 3) for actuator values (n, k); NaN where there is none near the guess."""

    def forward_batch(self, actuators: Array, deviations: Array, guess_mm: Array | None = None) -> Array:
        """Positions (m, n, 3) for n actuator triples under m vectors of deviations (m, p)."""

    def mean_distance(self, actuators: Array, nominal_mm: Array, measured_mm: Array) -> Callable:
        """Mean distances (m,) to measured positions (n, 3) of deviations (m, p); a CompiledObjective if it has one."""

    def actuator_jacobian(self, position_mm: Array, actuators: Array, deviations: Array | None = None) -> Array:
        """Derivative (n, 3, k) of the position by the actuator values."""

    def parameter_jacobian(self, position_mm: Array, actuators: Array, deviations: Array | None = None) -> Array:
        """Derivative (n, 3, p) of the position by the parameters."""

    def closure_jacobians(self, position_mm: Array, actuators: Array, deviations: Array | None = None) -> tuple:
        """Derivatives of the legs' closures by the position (n, 3, 3) and by the legs' numbers (n, 3, k)."""

    def constraint_moments(self, position_mm: Array, actuators: Array, deviations: Array | None = None) -> Array:
        """Unit directions (n, 3 legs, 3) about which each leg keeps the platform from turning."""


MECHANISMS = {"rrru3": Rrru3, "ptt3": Ptt3, "delta": Delta}


def identifiable_truth(mechanism: Any, values: Mapping[str, float]) -> dict[str, float]:
    """Mapping of the mechanism's parameters, no two of which act alike, from values of any of its DEVIATIONS.

    Absent ones are zero; NaN for a number that stands for all legs where theirs differ.
    """
    changes, result = mechanism.leg_changes(values), {}
    for name in mechanism.parameters.names:
        one = mechanism.DEVIATIONS[name]
        legs = changes[:, one.column] / one.factor
        result[name] = float(legs[one.leg - 1] if one.leg or (legs == legs[0]).all() else np.nan)
    return result


def make_mechanism(name: str, section: Mapping[str, float], **options: Any) -> Mechanism:
    """The mechanism of one `robots:` entry of the configuration; raises ConfigError for an unknown robot or key.

    Angles of the entry are in degrees, with keys that end in _deg.
    """
    if name not in MECHANISMS:
        raise ConfigError(f"unknown robot {name!r}; known: {', '.join(MECHANISMS)}")
    kind = MECHANISMS[name]
    section = {
        key.replace("_deg", "_rad"): float(np.radians(value)) if key.endswith("_deg") else value
        for key, value in section.items()
    }
    known = {f.name for f in fields(kind) if f.init}
    for key in section:
        if key not in known:
            raise ConfigError(f"robot {name}: unknown key {key!r}; known: {', '.join(sorted(known))}")
    return kind(**section, **options)
