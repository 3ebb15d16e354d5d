"""Calibration: a robot's parameters by least squares, with standard errors and identifiability.

Least squares is the limit of maximum a posteriori estimation for vanishing noise: the readings decide all combinations
of parameters that they determine, and the prior decides the others. The prior is the weak one that the parameters'
bounds state, see `Block.geometry`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from rrru.arrays import FloatArray
from rrru.calibration.identifiability import Identifiability, analyse, analyse_columns, parameter_scale
from rrru.campaign.outliers import robust_sd
from rrru.errors import FitError
from rrru.estimation.estimate import Estimate
from rrru.estimation.explain import explain_end
from rrru.estimation.observations.target_positions import TargetPositions
from rrru.estimation.parameters import Block, Parameters
from rrru.estimation.problem import Problem, WhiteNoise
from rrru.estimation.solver import SolverOptions, estimate_at, solve
from rrru.estimation.starts import starting_values
from rrru.kinematics.readings import Readings
from rrru.parameters import ParameterSet

# a nanometre, below what any instrument resolves: with this noise the prior decides what the readings do not determine
_VANISHING_SD_MM = 1e-6
# in standard deviations of that noise: the search ends where a full step moves all predictions by a picometre
_OPTIONS = SolverOptions(step_tolerance=1e-3, max_iterations=60)
# noise of the best instruments
_FINE_NOISE_MM = 0.01
# influence psi(r) and its slope of the robust losses, from their squared residual z in units of the loss scale
_SLOPES: dict[str, Callable[[FloatArray], tuple[FloatArray, FloatArray]]] = {
    "soft_l1": lambda z: ((1.0 + z) ** -0.5, -0.5 * (1.0 + z) ** -1.5),
    "huber": lambda z: (
        np.where(z <= 1.0, 1.0, np.maximum(z, 1.0) ** -0.5),
        np.where(z <= 1.0, 0.0, -0.5 * np.maximum(z, 1.0) ** -1.5),
    ),
    "cauchy": lambda z: (1.0 / (1.0 + z), -1.0 / (1.0 + z) ** 2),
}


@dataclass(frozen=True)
class Calibration:
    """Estimated deviations of a robot's parameters, their standard errors and identifiability.

    estimate: under vanishing noise. standard_errors (p,): NaN for a parameter at a bound, inf for one that the readings
    do not determine. noise_mm: noise per axis that they assume; noise_from: its source ("given", "residuals").
    """

    estimate: Estimate
    noise_mm: float
    noise_from: str
    standard_errors: FloatArray
    identifiability: Identifiability

    def at(self, deviations: npt.ArrayLike, message: str, observations: Any = None) -> Self:
        """The same noise and standard errors about other deviations (p,), whose origin the message states.

        observations: other readings of the robot, by default its own.
        """
        observations = self.observations if observations is None else observations
        return replace(self, estimate=estimate_deviations_at(observations, deviations, message, 1))

    @property
    def observations(self) -> Any:
        """The readings that were fitted."""
        return self.estimate.problem.observations

    @property
    def parameters(self) -> ParameterSet:
        """The robot's parameters."""
        parameters: ParameterSet = self.observations.mechanism.parameters
        return parameters

    @property
    def deviations(self) -> FloatArray:
        """Estimated deviations (p,)."""
        return self.estimate.values

    @property
    def at_bound(self) -> npt.NDArray[np.bool_]:
        """Which parameters (p,) are at a bound."""
        return self.parameters.at_bound(self.deviations)

    @property
    def evaluations(self) -> int:
        """Evaluations of all residuals."""
        return self.estimate.end.evaluations

    @property
    def residual_mm(self) -> FloatArray:
        """Residuals (m, 3) of the positions, and after them of the orientations where any were read."""
        return self.estimate.residual

    @cached_property
    def readings(self) -> Readings | None:
        """The Readings besides positions of the tool; distances, heights and the like have none."""
        return self.observations.readings if isinstance(self.observations, TargetPositions) else None

    @property
    def _position_residual_mm(self) -> FloatArray:
        """The residual (n, 3) of the positions."""
        return self.residual_mm[: len(self.readings) if self.readings else None]

    @property
    def distance_mm(self) -> FloatArray:
        """Distances (n,) of the positions."""
        return np.asarray(np.linalg.norm(self._position_residual_mm, axis=1))

    @property
    def rms_mm(self) -> float:
        """Root mean square of the distances."""
        return float(np.sqrt((self._position_residual_mm**2).sum(axis=1).mean()))

    @property
    def mean_mm(self) -> float:
        """Mean distance: the objective of paper A."""
        return float(self.distance_mm.mean())

    @property
    def turn_rms_rad(self) -> float:
        """Root mean square of the orientations' residual angles, NaN where none was read."""
        if self.readings is None or not len(self.readings.oriented):
            return np.nan
        turns = self.residual_mm[len(self.readings) :] / self.readings.characteristic_length_mm
        return float(np.sqrt((turns**2).sum(axis=1).mean()))


def calibrate(
    observations: Any, noise_mm: float | None = None, loss: str = "linear", loss_scale_mm: float = 0.1
) -> Calibration:
    """Calibration within the parameters' bounds that minimises the sum of squares; see `estimate_deviations`.

    noise_mm: known noise per axis; None estimates it from the residuals, and so does a value that the residuals clearly
    exceed, since standard errors from the instrument alone would then promise too much. Under a robust loss the noise
    is the median absolute residual's and standard errors are those of an M-estimator (Huber, Robust Statistics, 1981,
    section 7.6).
    """
    return assess(estimate_deviations(observations, loss, loss_scale_mm), noise_mm)


def estimate_deviations(
    observations: Any, loss: str = "linear", loss_scale_mm: float = 0.1, geometry: Block | None = None
) -> Estimate:
    """The Estimate of the deviations (p,) of the observed mechanism by least squares, within its bounds.

    Where the readings hardly determine some combinations, the search under vanishing noise follows a curved valley and
    does not converge. It is then repeated under the noise of the best instruments, which leaves these to the prior.

    loss: one of `rrru.estimation.solver.LOSSES`, with the residual `loss_scale_mm` at which a robust loss begins to
    bend; geometry: Block with the prior of the deviations, by default the one that their bounds state. Combinations of
    parameters that the readings do not determine stay at their prior mean. Raises FitError, with
    the Estimate as its result, where there are fewer equations than parameters or the search does not converge.
    """
    parameters = observations.mechanism.parameters
    equations = observations.residual(parameters.nominal).size
    if equations < len(parameters):
        raise FitError(f"{len(observations)} points give {equations} equations; allowed: at least {len(parameters)}")
    start, evaluations = starting_values(observations)
    found = solve(least_squares_problem(observations, loss, loss_scale_mm, geometry=geometry), [start], _OPTIONS)
    if not found.end.converged:
        found = solve(least_squares_problem(observations, loss, loss_scale_mm, _FINE_NOISE_MM, geometry), [start])
    if not found.end.converged:
        raise FitError(explain_end(found, "the calibration"), found)
    return replace(found, end=replace(found.end, evaluations=found.end.evaluations + evaluations))


def estimate_deviations_at(observations: Any, deviations: npt.ArrayLike, message: str, evaluations: int) -> Estimate:
    """The Estimate of deviations (p,), the result of another search with its message and number of evaluations."""
    return estimate_at(least_squares_problem(observations), deviations, message, evaluations)


def least_squares_problem(
    observations: Any,
    loss: str = "linear",
    loss_scale_mm: float = 0.1,
    noise_mm: float = _VANISHING_SD_MM,
    geometry: Block | None = None,
) -> Problem:
    """The Problem whose solution is the least sum of squares, or of a robust loss that bends at `loss_scale_mm`."""
    parameters = Parameters((geometry or Block.geometry(observations.mechanism.parameters),))
    return Problem(observations, parameters, WhiteNoise(noise_mm), loss, loss_scale_mm / noise_mm)


def assess(estimate: Estimate, noise_mm: float | None = None) -> Calibration:
    """The Calibration of an Estimate of `estimate_deviations` or of its namesake; noise_mm as in `calibrate`."""
    observations: Any = estimate.problem.observations
    mechanism, parameters = observations.mechanism, observations.mechanism.parameters
    residual, jacobian = estimate.residual, estimate.jacobian
    identifiability, free = analyse(mechanism, jacobian), np.flatnonzero(~parameters.at_bound(estimate.values))
    freedom = max(residual.size - min(identifiability.rank, len(free)), 1)
    robust = estimate.problem.loss != "linear"
    estimated = robust_sd(residual) if robust else float(np.sqrt((residual**2).sum() / freedom))
    noise, noise_from = estimated, "residuals"
    # three standard deviations of an estimated standard deviation
    if noise_mm is not None and estimated <= noise_mm * (1.0 + 3.0 / np.sqrt(2.0 * freedom)):
        noise, noise_from = noise_mm, "given"
    standard_errors = np.full(len(parameters), np.nan)
    if not len(free):
        return Calibration(estimate, noise, noise_from, standard_errors, identifiability)
    names, scale, columns = np.array(parameters.names)[free], parameter_scale(mechanism)[free], jacobian[..., free]
    reduced = analyse_columns(names, scale, columns)
    if robust:
        z = (estimate.standardized_residual / estimate.problem.loss_scale) ** 2
        first, second = _SLOPES[estimate.problem.loss](z)
        standard_errors[free] = reduced.robust_standard_errors(columns, first * residual, first + 2.0 * z * second)
    else:
        standard_errors[free] = reduced.standard_errors(noise)
    return Calibration(estimate, noise, noise_from, standard_errors, identifiability)
