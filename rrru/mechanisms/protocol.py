"""What every mechanism offers to calibration and plant, and the mechanisms by name. Lengths in mm, angles in rad."""

from dataclasses import fields
from typing import Protocol

import numpy as np

from rrru.errors import ConfigError
from rrru.mechanisms.rrru3 import Rrru3
from rrru.parameters import ParameterSet


class Mechanism(Protocol):
    """A parallel robot as its controller believes it to be, with small errors of its numbers."""

    name: str
    parameters: ParameterSet

    def inverse(self, position_mm: np.ndarray, errors: np.ndarray | None = None) -> np.ndarray:
        """Actuator values (n, k) for positions (n, 3); NaN where out of reach."""

    def forward(self, actuators: np.ndarray, errors: np.ndarray | None = None, guess_mm: np.ndarray | None = None) -> np.ndarray:
        """Positions (n, 3) for actuator values (n, k); NaN where there is none near the guess."""

    def actuator_jacobian(self, position_mm: np.ndarray, actuators: np.ndarray, errors: np.ndarray | None = None) -> np.ndarray:
        """Derivative (n, 3, k) of the position by the actuator values."""

    def error_jacobian(self, position_mm: np.ndarray, actuators: np.ndarray, errors: np.ndarray | None = None) -> np.ndarray:
        """Derivative (n, 3, p) of the position by the errors."""


MECHANISMS = {"rrru3": Rrru3}


def make_mechanism(name, section, **options):
    """The mechanism of one `robots:` entry of the configuration; raises ConfigError for an unknown robot or key."""
    if name not in MECHANISMS:
        raise ConfigError(f"unknown robot {name!r}; known: {', '.join(MECHANISMS)}")
    kind = MECHANISMS[name]
    known = {f.name for f in fields(kind) if f.init}
    for key in section:
        if key not in known:
            raise ConfigError(f"robot {name}: unknown key {key!r}; known: {', '.join(sorted(known))}")
    return kind(**section, **options)
