"""Heights by a probe and distances between two places by calipers, one number per reading.

Both are one kind because a printer's calibration weighs them against each other by one factor.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Self

import numpy as np

from rrru.arrays import FloatArray
from rrru.cache import last_cached
from rrru.errors import FitError
from rrru.kinematics.robot import Robot


@dataclass(frozen=True)
class ProbedHeights:
    """Readings of a robot without points: heights of its platform, and distances between two of its places.

    mechanism: its `parameters` are estimated. height_actuators (n, 3) with height_mm (n,); distance_actuators (m, 2, 3)
    with distance_mm (m,). height_weight: what a squared height counts against a squared distance. Raises FitError where
    a number is not finite or the nominal robot cannot take a place.
    """

    mechanism: Robot
    height_actuators: FloatArray
    height_mm: FloatArray
    distance_actuators: FloatArray
    distance_mm: FloatArray
    height_weight: float = 1.0

    # ASSUME how well a probe repeats; a calibration takes what the residuals show
    default_sd: ClassVar[float] = 0.01
    unit: ClassVar[str] = "mm"

    def __post_init__(self) -> None:
        if not np.isfinite(self.measured_mm).all():
            raise FitError("a height or a distance is not finite")
        lost = np.flatnonzero(~np.isfinite(self.predicted_mm(self.mechanism.parameters.nominal)))
        if lost.size:
            raise FitError(
                f"the nominal robot cannot take {lost.size} of {len(self)} readings' places, "
                f"the first is reading {lost[0] + 1}"
            )

    def __len__(self) -> int:
        return len(self.height_mm) + len(self.distance_mm)

    @cached_property
    def measured_mm(self) -> FloatArray:
        """Readings (n + m,): the heights, then the distances."""
        return np.concatenate([self.height_mm, self.distance_mm])

    @cached_property
    def root_weight(self) -> FloatArray:
        """Factor (n + m,) of every reading's residual."""
        return np.where(np.arange(len(self)) < len(self.height_mm), np.sqrt(self.height_weight), 1.0)

    @cached_property
    def actuators(self) -> FloatArray:
        """Actuator values (n + 2 m, 3) of all places: the heights', then the distances' first and second ones."""
        return np.concatenate([self.height_actuators, self.distance_actuators[:, 0], self.distance_actuators[:, 1]])

    @last_cached
    def places(self, deviations: FloatArray) -> FloatArray:
        """Positions (n + 2 m, 3) of the robot at `actuators` under deviations (p,)."""
        return self.mechanism.forward(self.actuators, deviations)

    def predicted_mm(self, deviations: FloatArray) -> FloatArray:
        """Readings (n + m,) of the robot under deviations (p,)."""
        n, m = len(self.height_mm), len(self.distance_mm)
        places = self.places(deviations)
        return np.concatenate([places[:n, 2], np.linalg.norm(places[n : n + m] - places[n + m :], axis=1)])

    def gradient(self, places: FloatArray) -> FloatArray:
        """Derivative (n + m, n + 2 m, 3) of the readings by the robot's positions (n + 2 m, 3)."""
        n, m = len(self.height_mm), len(self.distance_mm)
        between = places[n : n + m] - places[n + m :]
        slope = np.zeros((n + m, n + 2 * m, 3))
        slope[np.arange(n), np.arange(n), 2] = 1.0
        pairs = np.arange(n, n + m)
        slope[pairs, pairs] = between / np.linalg.norm(between, axis=1, keepdims=True)
        slope[pairs, pairs + m] = -slope[pairs, pairs]
        return slope

    def residual(self, values: FloatArray, /) -> FloatArray:
        """Measured minus predicted readings times the roots of their weights, (n + m, 1) in mm, at deviations (p,)."""
        return (self.root_weight * (self.measured_mm - self.predicted_mm(values)))[:, None]

    def jacobian(self, values: FloatArray, /) -> FloatArray:
        """Derivative (n + m, 1, p) of the residual by the deviations (p,)."""
        places = self.places(values)
        moved = self.mechanism.parameter_jacobian(places, self.actuators, values)
        slope: FloatArray = np.einsum("rna,nap->rp", self.gradient(places), moved)
        return -(self.root_weight[:, None] * slope)[:, None]

    def without(self, reading: int) -> Self:
        """The same residuals less one reading, counted from 0 over the heights and then the distances."""
        heights, distances = np.split(np.arange(len(self)) != reading, [len(self.height_mm)])
        return replace(
            self,
            height_actuators=self.height_actuators[heights],
            height_mm=self.height_mm[heights],
            distance_actuators=self.distance_actuators[distances],
            distance_mm=self.distance_mm[distances],
        )
