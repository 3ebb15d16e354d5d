"""What every calibration method minimises: signed differences between what was read at its points and the model."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rrru.errors import FitError
from rrru.kept import last_kept
from rrru.robots.readings import Readings, lacking
from rrru.robots.robot import Robot
from rrru.robots.walk import Poses


@dataclass(frozen=True)
class Residuals:
    """Points of a calibration.

    mechanism: its `parameters` are fitted; actuators (n, K), measured_mm, start_mm: (n, 3) actuator values, measured
    positions and positions near which the tool's are found (the commanded ones); readings: the measured positions with
    what else was read, None where these are all, of the tool. Raises FitError where a number is not finite.
    """

    mechanism: Robot
    actuators: np.ndarray
    measured_mm: np.ndarray
    start_mm: np.ndarray
    readings: Readings | None = None

    def __post_init__(self) -> None:
        for name in ("actuators", "measured_mm", "start_mm"):
            if (bad := np.flatnonzero(~np.isfinite(getattr(self, name)).all(axis=1))).size:
                where = f"{bad.size} of {len(self.actuators)} points, the first is point {bad[0] + 1}"
                raise FitError(f"{name} is not finite at {where}")
        if (lost := np.flatnonzero(np.isnan(self.nominal_mm).any(axis=1))).size:
            where = f"{lost.size} of {len(self.actuators)} poses, the first is point {lost[0] + 1}"
            raise FitError(f"the nominal robot cannot take {where}")

    def __len__(self) -> int:
        return len(self.actuators) if self.readings is None else len(self.readings.rows)

    @cached_property
    def nominal_mm(self) -> np.ndarray:
        """Model positions (n, 3) of the tool without deviations."""
        return self.mechanism.forward(self.actuators, guess_mm=self.start_mm)

    @last_kept
    def model(self, deviations: np.ndarray) -> np.ndarray:
        """Model positions (n, 3) in mm of the tool under deviations (p,)."""
        if self.mechanism.closed_form:
            return self.mechanism.forward(self.actuators, deviations, self.nominal_mm)
        return self.mechanism.measured(*self._poses(deviations))

    @cached_property
    def _nominal_poses(self) -> Poses:
        """Poses without deviations."""
        return self.mechanism.solve(self.actuators, self.start_mm)

    @last_kept
    def _poses(self, deviations: np.ndarray) -> tuple[Poses, np.ndarray]:
        """Poses and twists under deviations (p,)."""
        twists = self.mechanism.twists(deviations)
        return self.mechanism.model.solve(self.actuators, self._nominal_poses, twists), twists

    def residual(self, deviations: np.ndarray) -> np.ndarray:
        """What was read minus the model (m, 3) in mm under deviations (p,), see `rrru.robots.readings.lacking`."""
        if self.readings is None:
            return self.measured_mm - self.model(deviations)
        return lacking(self.mechanism, self.readings, *self._poses(deviations))

    def jacobian(self, deviations: np.ndarray) -> np.ndarray:
        """Derivative (m, 3, p) of the residual by the deviations."""
        if self.readings is None and self.mechanism.closed_form:
            return -self.mechanism.parameter_jacobian(self.model(deviations), self.actuators, deviations)
        poses, twists = self._poses(deviations)
        at = self.mechanism.map(self.actuators, poses, twists, self.readings)
        return -at.columns(self.mechanism.directions)

    @cached_property
    def mean_distance(self) -> Callable:
        """Objective of paper A, eq. (11): callable, deviations (m, p) to mean distances (m,) in mm, inf out of reach.

        Where the mechanism offers it, a CompiledObjective. Orientations count as distances at the readings' arm.
        """
        if self.readings is None:
            return self.mechanism.mean_distance(self.actuators, self.nominal_mm, self.measured_mm)

        def evaluate(deviations: np.ndarray) -> np.ndarray:
            off = np.array([np.linalg.norm(self.residual(one), axis=1) for one in deviations])
            return np.where(np.isfinite(off).all(axis=1), off.mean(axis=1), np.inf)

        return evaluate
