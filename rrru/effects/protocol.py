"""What an effect is: a physical law that knows the motion and says what it changes, and where. Lengths mm, angles rad, forces N."""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from rrru.parameters import ParameterSet

GRAVITY_MM_S2 = 9806.65


@dataclass(frozen=True)
class Motion:
    """What the robot does at the n sampled points, as far as an effect may need it.

    theta_rad (n, 3): commanded drive angles; path_theta_rad (N, 3): the same along everything that is driven, path_index (n,): rows of
    the sampled points in it; force_n (n, 3): force with which each leg pushes the platform along force_direction (n, 3 legs, 3).
    """

    theta_rad: np.ndarray
    path_theta_rad: np.ndarray
    path_index: np.ndarray
    force_n: np.ndarray
    force_direction: np.ndarray

    def __len__(self):
        return len(self.theta_rad)


@dataclass(frozen=True)
class Contribution:
    """What one effect changes at the n points: added to the drive angles (n, 3) and to the U-joint centres (n, 3 legs, 3), robot frame."""

    drive_rad: np.ndarray | float = 0.0
    joint_mm: np.ndarray | float = 0.0

    def __add__(self, other):
        return Contribution(self.drive_rad + other.drive_rad, self.joint_mm + other.joint_mm)


class Effect(Protocol):
    """One physical effect."""

    name: str
    parameters: ParameterSet

    def contribute(self, motion: Motion, values: np.ndarray) -> Contribution:
        """Changes at the points of a motion under parameter values (p,)."""


@dataclass(frozen=True)
class ActiveEffect:
    """An effect together with its parameter values by name; absent values are nominal."""

    effect: Effect
    values: dict = field(default_factory=dict)

    def contribute(self, motion):
        """Changes at the points of a motion."""
        return self.effect.contribute(motion, self.effect.parameters.vector(self.values))
