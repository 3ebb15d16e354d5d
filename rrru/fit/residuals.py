"""What every calibration method minimises: signed differences between measured and model positions of one set of
points.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rrru.errors import FitError
from rrru.robots import rrru3_kernels as kernels
from rrru.robots.rrru3 import Rrru3


@dataclass(frozen=True)
class Residuals:
    """Points of a calibration.

    mechanism: its `parameters` are fitted; actuators, measured_mm, start_mm: (n, 3) actuator values, measured positions
    and positions near which the model's are found (the commanded ones). Raises FitError where a number is not finite.
    """

    mechanism: object
    actuators: np.ndarray
    measured_mm: np.ndarray
    start_mm: np.ndarray

    def __post_init__(self):
        for name in ("actuators", "measured_mm", "start_mm"):
            bad = np.flatnonzero(~np.isfinite(getattr(self, name)).all(axis=1))
            if bad.size:
                raise FitError(
                    f"{name} is not finite at {bad.size} of {len(self)} points, the first is point {bad[0] + 1}"
                )
        lost = np.flatnonzero(np.isnan(self.nominal_mm).any(axis=1))
        if lost.size:
            raise FitError(
                f"the nominal robot cannot take {lost.size} of {len(self)} poses, the first is point {lost[0] + 1}"
            )

    def __len__(self):
        return len(self.actuators)

    @cached_property
    def nominal_mm(self):
        """Model positions (n, 3) without errors."""
        return self.mechanism.forward(self.actuators, guess_mm=self.start_mm)

    @cached_property
    def _kernel_arguments(self):
        """Arrays of the compiled objective that do not change with the errors."""
        slope = self.mechanism.parameter_jacobian(self.nominal_mm, self.actuators)
        return (
            self.mechanism.azimuth_cos_sin,
            np.ascontiguousarray(np.cos(self.actuators).T),
            np.ascontiguousarray(np.sin(self.actuators).T),
            np.ascontiguousarray(self.nominal_mm.T),
            np.ascontiguousarray(slope.transpose(2, 1, 0)),
            np.ascontiguousarray(self.measured_mm.T),
        )

    @cached_property
    def _measured(self):
        """Measured positions (n, 3) as the compiled objective needs them."""
        return np.ascontiguousarray(self.measured_mm, dtype=float)

    def model(self, deviations):
        """Model positions (n, 3) in mm under deviations (p,)."""
        return self.mechanism.forward(self.actuators, deviations, self.nominal_mm)

    def residual(self, deviations):
        """Measured minus model positions (n, 3) in mm under deviations (p,)."""
        return self.measured_mm - self.model(deviations)

    def jacobian(self, deviations):
        """Derivative (n, 3, p) of the residual with respect to the errors."""
        return -self.mechanism.parameter_jacobian(self.model(deviations), self.actuators, deviations)

    def mean_distance(self, deviations):
        """Objective of paper A, eq. (11): mean distance (m,) in mm for deviations (m, p); inf where the model leaves the
        reach.
        """
        deviations = np.ascontiguousarray(deviations, dtype=float)
        if not isinstance(self.mechanism, Rrru3):
            legs = self.mechanism.legs(deviations)
            ends = np.ascontiguousarray(self.mechanism.ends(self.actuators, legs[:, None]))
            return kernels.tripod_mean_distance(
                ends, np.ascontiguousarray(legs[..., self.mechanism.LINK]), self._measured
            )
        return kernels.mean_distance(deviations, self.mechanism.legs(deviations), *self._kernel_arguments)
