"""Positions of targets that an instrument measures, with the orientations that it measures at the same stops.

    residual = measured - predicted,    n rows of positions in mm, then k rows of rotation vectors times an arm

The arm, in mm per rad, is the positions' noise over the orientations'. All rows are in mm and have one noise. Positions
and orientations are one kind because both come from one solution of the closed loops, which takes most of the time.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from rrru.arrays import FloatArray
from rrru.cache import last_cached
from rrru.errors import FitError
from rrru.kinematics.chain import Poses
from rrru.kinematics.readings import Readings, reading_residual
from rrru.kinematics.robot import Robot


@dataclass(frozen=True)
class TargetPositions:
    """Targets seen at n poses.

    mechanism: its `parameters` are estimated; actuators (n, K), measured_mm, start_mm: (n, 3) actuator values, measured
    positions and positions near which the tool's are found (the commanded ones); readings: the measured positions
    together with all other readings, None where only the tool's positions were read. Raises FitError where a number is
    not finite or the nominal robot cannot take a pose.
    """

    # ASSUME a laser tracker on a small machine; a calibration takes the campaign's noise
    default_sd: ClassVar[float] = 0.02
    unit: ClassVar[str] = "mm"

    mechanism: Robot
    actuators: FloatArray
    measured_mm: FloatArray
    start_mm: FloatArray
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
    def nominal_mm(self) -> FloatArray:
        """Model positions (n, 3) of the tool without deviations."""
        return self.mechanism.forward(self.actuators, guess_mm=self.start_mm)

    @last_cached
    def model(self, deviations: FloatArray) -> FloatArray:
        """Model positions (n, 3) in mm of the tool under deviations (p,)."""
        if self.mechanism.closed_form:
            return self.mechanism.forward(self.actuators, deviations, self.nominal_mm)
        return self.mechanism.measured(*self._poses(deviations))

    @cached_property
    def _nominal_poses(self) -> Poses:
        """Poses without deviations."""
        return self.mechanism.solve(self.actuators, self.start_mm)

    @last_cached
    def _poses(self, deviations: FloatArray) -> tuple[Poses, FloatArray]:
        """Poses and twists under deviations (p,)."""
        twists = self.mechanism.twists(deviations)
        return self.mechanism.model.solve(self.actuators, self._nominal_poses, twists), twists

    def residual(self, values: FloatArray, /) -> FloatArray:
        """Measured minus predicted (m, 3) in mm at deviations (p,), see `rrru.kinematics.readings.lacking`."""
        if self.readings is None:
            return self.measured_mm - self.model(values)
        return reading_residual(self.mechanism, self.readings, *self._poses(values))

    @last_cached
    def jacobian(self, deviations: FloatArray) -> FloatArray:
        """Derivative (m, 3, p) of the residual by the deviations (p,)."""
        if self.readings is None and self.mechanism.closed_form:
            return -self.mechanism.parameter_jacobian(self.model(deviations), self.actuators, deviations)
        poses, twists = self._poses(deviations)
        at = self.mechanism.map(self.actuators, poses, twists, self.readings)
        columns: FloatArray = at.columns(self.mechanism.directions)
        return -columns

    @cached_property
    def mean_distance(self) -> Callable[[FloatArray], FloatArray]:
        """Objective of paper A, eq. (11): callable, deviations (m, p) to mean distances (m,) in mm, inf out of reach.

        Where the mechanism offers it, a CompiledObjective. Orientations count as distances at the readings' arm.
        """
        if self.readings is None:
            return self.mechanism.mean_distance(self.actuators, self.nominal_mm, self.measured_mm)

        def evaluate(deviations: FloatArray) -> FloatArray:
            off = np.array([np.linalg.norm(self.residual(row), axis=1) for row in deviations])
            return np.where(np.isfinite(off).all(axis=1), off.mean(axis=1), np.inf)

        return evaluate


@dataclass(frozen=True)
class TargetHeights(TargetPositions):
    """Heights alone of targets, z of the robot's base frame."""

    def residual(self, values: FloatArray, /) -> FloatArray:
        """Measured minus predicted heights (n, 1) in mm."""
        return super().residual(values)[:, 2:]

    def jacobian(self, values: FloatArray, /) -> FloatArray:
        """Derivative (n, 1, p) of the residual."""
        return super().jacobian(values)[:, 2:]
