"""What every calibration method minimises: signed differences between measured and model positions of its points."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rrru.errors import FitError
from rrru.fit.least_squares import last_kept
from rrru.robots.robot import Robot


@dataclass(frozen=True)
class Residuals:
    """Points of a calibration.

    mechanism: its `parameters` are fitted; actuators, measured_mm, start_mm: (n, 3) actuator values, measured positions
    and positions near which the model's are found (the commanded ones). Raises FitError where a number is not finite.
    """

    mechanism: Robot
    actuators: np.ndarray
    measured_mm: np.ndarray
    start_mm: np.ndarray

    def __post_init__(self) -> None:
        for name in ("actuators", "measured_mm", "start_mm"):
            if (bad := np.flatnonzero(~np.isfinite(getattr(self, name)).all(axis=1))).size:
                where = f"{bad.size} of {len(self)} points, the first is point {bad[0] + 1}"
                raise FitError(f"{name} is not finite at {where}")
        if (lost := np.flatnonzero(np.isnan(self.nominal_mm).any(axis=1))).size:
            where = f"{lost.size} of {len(self)} poses, the first is point {lost[0] + 1}"
            raise FitError(f"the nominal robot cannot take {where}")

    def __len__(self) -> int:
        return len(self.actuators)

    @cached_property
    def nominal_mm(self) -> np.ndarray:
        """Model positions (n, 3) without deviations."""
        return self.mechanism.forward(self.actuators, guess_mm=self.start_mm)

    @last_kept
    def model(self, deviations: np.ndarray) -> np.ndarray:
        """Model positions (n, 3) in mm under deviations (p,)."""
        return self.mechanism.forward(self.actuators, deviations, self.nominal_mm)

    def residual(self, deviations: np.ndarray) -> np.ndarray:
        """Measured minus model positions (n, 3) in mm under deviations (p,)."""
        return self.measured_mm - self.model(deviations)

    def jacobian(self, deviations: np.ndarray) -> np.ndarray:
        """Derivative (n, 3, p) of the residual by the deviations."""
        return -self.mechanism.parameter_jacobian(self.model(deviations), self.actuators, deviations)

    @cached_property
    def mean_distance(self) -> Callable:
        """Objective of paper A, eq. (11): callable, deviations (m, p) to mean distances (m,) in mm, inf out of reach.

        Where the mechanism offers it, a CompiledObjective.
        """
        return self.mechanism.mean_distance(self.actuators, self.nominal_mm, self.measured_mm)
