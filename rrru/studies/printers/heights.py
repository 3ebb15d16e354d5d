"""Heights and distances as measurements of a calibration: what a probe and calipers see, one number per reading."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rrru.errors import FitError
from rrru.kept import last_kept


@dataclass(frozen=True)
class HeightResiduals:
    """Readings of a robot without points: heights of its platform, and distances between two of its places.

    mechanism: its `parameters` are fitted. height_actuators (n, 3) with height_mm (n,); distance_actuators (m, 2, 3)
    with distance_mm (m,). height_weight: what a squared height counts against a squared distance. Fits
    `rrru.fit.least_squares`, with one axis instead of three. Raises FitError where a number is not finite or the
    nominal robot cannot take a place.
    """

    mechanism: object
    height_actuators: np.ndarray
    height_mm: np.ndarray
    distance_actuators: np.ndarray
    distance_mm: np.ndarray
    height_weight: float = 1.0

    def __post_init__(self):
        if not np.isfinite(self.measured_mm).all():
            raise FitError("a height or a distance is not finite")
        lost = np.flatnonzero(~np.isfinite(self.predicted_mm(self.mechanism.parameters.nominal)))
        if lost.size:
            raise FitError(
                f"the nominal robot cannot take {lost.size} of {len(self)} readings' places, "
                f"the first is reading {lost[0] + 1}"
            )

    def __len__(self):
        return len(self.height_mm) + len(self.distance_mm)

    @cached_property
    def measured_mm(self):
        """Readings (n + m,): the heights, then the distances."""
        return np.concatenate([self.height_mm, self.distance_mm])

    @cached_property
    def root_weight(self):
        """Factor (n + m,) of every reading's residual."""
        return np.where(np.arange(len(self)) < len(self.height_mm), np.sqrt(self.height_weight), 1.0)

    @cached_property
    def actuators(self):
        """Actuator values (n + 2 m, 3) of all places: the heights', then the distances' first and second ones."""
        return np.concatenate([self.height_actuators, self.distance_actuators[:, 0], self.distance_actuators[:, 1]])

    @last_kept
    def places(self, deviations):
        """Where the robot stands, (n + 2 m, 3), at `actuators` under deviations (p,)."""
        return self.mechanism.forward(self.actuators, deviations)

    def predicted_mm(self, deviations):
        """Readings (n + m,) of the robot under deviations (p,)."""
        n, m = len(self.height_mm), len(self.distance_mm)
        places = self.places(deviations)
        return np.concatenate([places[:n, 2], np.linalg.norm(places[n : n + m] - places[n + m :], axis=1)])

    def gradient(self, places):
        """Derivative (n + m, n + 2 m, 3) of the readings by the places (n + 2 m, 3) at which the robot stands."""
        n, m = len(self.height_mm), len(self.distance_mm)
        between = places[n : n + m] - places[n + m :]
        slope = np.zeros((n + m, n + 2 * m, 3))
        slope[np.arange(n), np.arange(n), 2] = 1.0
        pairs = np.arange(n, n + m)
        slope[pairs, pairs] = between / np.linalg.norm(between, axis=1, keepdims=True)
        slope[pairs, pairs + m] = -slope[pairs, pairs]
        return slope

    def residual(self, deviations):
        """Measured less predicted readings times the roots of their weights, (n + m, 1), under deviations (p,)."""
        return (self.root_weight * (self.measured_mm - self.predicted_mm(deviations)))[:, None]

    def jacobian(self, deviations):
        """Derivative (n + m, 1, p) of the residual by the deviations."""
        places = self.places(deviations)
        moved = self.mechanism.parameter_jacobian(places, self.actuators, deviations)
        return -self.root_weight[:, None, None] * np.einsum("rna,nap->rp", self.gradient(places), moved)[:, None]

    def without(self, reading):
        """The same residuals less one reading, counted from 0 over the heights and then the distances."""
        heights, distances = np.split(np.arange(len(self)) != reading, [len(self.height_mm)])
        return replace(
            self,
            height_actuators=self.height_actuators[heights],
            height_mm=self.height_mm[heights],
            distance_actuators=self.distance_actuators[distances],
            distance_mm=self.distance_mm[distances],
        )
