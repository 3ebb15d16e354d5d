"""What every calibration method minimises: signed differences between measured and model positions of its points."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rrru.errors import FitError
from rrru.fit.least_squares import last_kept
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
            if (bad := np.flatnonzero(~np.isfinite(getattr(self, name)).all(axis=1))).size:
                where = f"{bad.size} of {len(self)} points, the first is point {bad[0] + 1}"
                raise FitError(f"{name} is not finite at {where}")
        if (lost := np.flatnonzero(np.isnan(self.nominal_mm).any(axis=1))).size:
            where = f"{lost.size} of {len(self)} poses, the first is point {lost[0] + 1}"
            raise FitError(f"the nominal robot cannot take {where}")

    def __len__(self):
        return len(self.actuators)

    @cached_property
    def nominal_mm(self):
        """Model positions (n, 3) without deviations."""
        return self.mechanism.forward(self.actuators, guess_mm=self.start_mm)

    @cached_property
    def _kernel_arguments(self):
        """Arrays of the 3-RRRU's compiled objective that do not change with the deviations, component first."""
        slope = self.mechanism.parameter_jacobian(self.nominal_mm, self.actuators)
        arrays = (np.cos(self.actuators), np.sin(self.actuators), self.nominal_mm, slope, self.measured_mm)
        return (self.mechanism.azimuth_cos_sin, *(np.ascontiguousarray(array.T) for array in arrays))

    @last_kept
    def model(self, deviations):
        """Model positions (n, 3) in mm under deviations (p,)."""
        return self.mechanism.forward(self.actuators, deviations, self.nominal_mm)

    def residual(self, deviations):
        """Measured minus model positions (n, 3) in mm under deviations (p,)."""
        return self.measured_mm - self.model(deviations)

    def jacobian(self, deviations):
        """Derivative (n, 3, p) of the residual by the deviations."""
        return -self.mechanism.parameter_jacobian(self.model(deviations), self.actuators, deviations)

    def mean_distance(self, deviations):
        """Paper A, eq. (11): mean distance (m,) in mm for deviations (m, p); inf where the model leaves the reach."""
        deviations = np.ascontiguousarray(deviations, dtype=float)
        legs = self.mechanism.legs(deviations)
        if isinstance(self.mechanism, Rrru3):
            return kernels.mean_distance(deviations, legs, *self._kernel_arguments)
        ends, links = self.mechanism.ends(self.actuators, legs[:, None]), legs[..., self.mechanism.LINK]
        return kernels.tripod_mean_distance(*map(np.ascontiguousarray, (ends, links, self.measured_mm)))
