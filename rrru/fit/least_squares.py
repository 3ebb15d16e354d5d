"""Least squares on the residuals of a calibration, with everything that says how far to trust the answer."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rrru.errors import FitError
from rrru.estimation.starts import starting_values
from rrru.fit.identifiability import Identifiability, analyse, analyse_columns, parameter_scale
from rrru.parameters import ParameterSet
from rrru.robots.readings import Readings

if TYPE_CHECKING:
    from rrru.fit.residuals import Residuals

# first and second derivative of scipy's loss functions rho(z), z the squared residual in units of the loss scale
_DERIVATIVES = {
    "linear": lambda z: (np.ones_like(z), np.zeros_like(z)),
    "soft_l1": lambda z: ((1.0 + z) ** -0.5, -0.5 * (1.0 + z) ** -1.5),
    "huber": lambda z: (
        np.where(z <= 1.0, 1.0, np.maximum(z, 1.0) ** -0.5),
        np.where(z <= 1.0, 0.0, -0.5 * np.maximum(z, 1.0) ** -1.5),
    ),
    "cauchy": lambda z: (1.0 / (1.0 + z), -1.0 / (1.0 + z) ** 2),
}
LOSSES = tuple(_DERIVATIVES)


@dataclass(frozen=True)
class Fit:
    """Fitted deviations (p,) of the parameters and what belongs to them.

    standard_errors (p,): NaN for a parameter at a bound, inf for one that the points do not see. noise_mm: noise per
    axis that they assume, from where `noise_from` says ("given", "residuals"). evaluations: of all residuals.
    residual_mm (m, 3): positions, and after them orientations where `readings` have any.
    """

    parameters: ParameterSet
    deviations: np.ndarray
    residual_mm: np.ndarray
    noise_mm: float
    noise_from: str
    at_bound: np.ndarray
    standard_errors: np.ndarray
    identifiability: Identifiability
    evaluations: int
    readings: Readings | None = None

    @property
    def _lacking_mm(self) -> np.ndarray:
        """The residual (n, 3) of the positions."""
        return self.residual_mm[: len(self.readings) if self.readings else None]

    @property
    def distance_mm(self) -> np.ndarray:
        """Distances (n,) of the positions."""
        return np.linalg.norm(self._lacking_mm, axis=1)

    @property
    def rms_mm(self) -> float:
        """Root mean square of the distances."""
        return float(np.sqrt((self._lacking_mm**2).sum(axis=1).mean()))

    @property
    def mean_mm(self) -> float:
        """Mean distance: the objective of paper A."""
        return float(self.distance_mm.mean())

    @property
    def turn_rms_rad(self) -> float:
        """Root mean square angle that the orientations are off by, NaN where none was read."""
        if self.readings is None or not len(self.readings.turned):
            return np.nan
        turns = self.residual_mm[len(self.readings) :] / self.readings.arm_mm
        return float(np.sqrt((turns**2).sum(axis=1).mean()))


def least_squares(
    residuals: "Residuals", noise_mm: float | None = None, loss: str = "linear", loss_scale_mm: float = 0.1
) -> Fit:
    """Fit within the parameters' bounds that minimises the sum of squares of the signed residuals; see `minimise`.

    noise_mm: known noise per axis; None estimates it from the residuals, and so does a value that the residuals clearly
    exceed, since standard errors from the instrument alone would then promise too much. Under a robust loss the noise
    is the median absolute residual's and standard errors are those of an M-estimator (Huber, Robust Statistics, 1981,
    section 7.6).
    """
    return make_fit(residuals, *minimise(residuals, loss, loss_scale_mm), noise_mm, loss, loss_scale_mm)


def minimise(residuals: "Residuals", loss: str = "linear", loss_scale_mm: float = 0.1) -> tuple[np.ndarray, int]:
    """Deviations (p,) within the bounds of the least sum of squares, and how many evaluations the search took.

    loss: one of LOSSES, with the residual size `loss_scale_mm` at which a robust loss begins to bend. The search moves
    only along directions that the points see; the others keep the start's value, see `rrru.estimation.starts`. Raises
    FitError, carrying scipy's result, where there are fewer equations than parameters or the search fails.
    """
    parameters = residuals.mechanism.parameters
    equations = residuals.residual(parameters.nominal).size
    if equations < len(parameters):
        raise FitError(f"{len(residuals)} points give {equations} equations; allowed: at least {len(parameters)}")
    origin, evaluations = starting_values(residuals)
    start = analyse(residuals.mechanism, residuals.jacobian(origin))
    seen = (start.directions[: start.rank] * start.scale).T
    linear = loss == "linear"
    options = {"loss": loss, "f_scale": 1.0 if linear else loss_scale_mm}
    # in the directions' own coordinates the problem is well scaled; the box of the bounds holds only where every
    # direction is seen
    scale = start.singular_values[0] / start.singular_values[: start.rank]
    solution = _search(
        residuals, origin, seen, np.zeros(start.rank), scale, method="lm" if linear else "trf", **options
    )
    deviations, evaluations = origin + seen @ solution.x, evaluations + int(solution.nfev)
    if start.rank == len(parameters) and not parameters.hold(deviations):
        inside, bounds = parameters.inside(deviations), (parameters.low, parameters.high)
        solution = _search(residuals, 0.0, np.eye(len(parameters)), inside, start.scale, bounds=bounds, **options)
        deviations, evaluations = solution.x, evaluations + int(solution.nfev)
    if not (solution.success and np.isfinite(deviations).all()):
        raise FitError(f"least squares did not converge: {solution.message}", solution)
    return deviations, evaluations


def _search(
    residuals: "Residuals",
    origin: np.ndarray | float,
    directions: np.ndarray,
    start: np.ndarray,
    scale: np.ndarray,
    **options: Any,
) -> Any:
    """Scipy's result q (k,) of the least squares over deviations origin + directions (p, k) q, from a start (k,)."""
    from scipy import optimize

    return optimize.least_squares(
        lambda q: residuals.residual(origin + directions @ q).ravel(),
        start,
        jac=lambda q: residuals.jacobian(origin + directions @ q).reshape(-1, len(directions)) @ directions,
        x_scale=scale,
        xtol=1e-10,
        # rounding of the sum of squares is not far below
        ftol=1e-12,
        gtol=1e-12,
        **options,
    )


def make_fit(
    residuals: "Residuals",
    deviations: np.ndarray,
    evaluations: int,
    noise_mm: float | None = None,
    loss: str = "linear",
    loss_scale_mm: float = 0.1,
) -> Fit:
    """Fit of deviations (p,) that a search has come to; see `least_squares` for the other arguments."""
    mechanism, parameters = residuals.mechanism, residuals.mechanism.parameters
    residual, jacobian = residuals.residual(deviations), residuals.jacobian(deviations)
    ident, at_bound = analyse(mechanism, jacobian), parameters.at_bound(deviations)
    free = np.flatnonzero(~at_bound)
    freedom = max(residual.size - min(ident.rank, len(free)), 1)
    # the median absolute value of a standard normal number is 0.6745
    robust = loss != "linear"
    estimated = float(np.median(np.abs(residual)) / 0.6745 if robust else np.sqrt((residual**2).sum() / freedom))
    noise, noise_from = estimated, "residuals"
    # three standard deviations of an estimated standard deviation
    if noise_mm is not None and estimated <= noise_mm * (1.0 + 3.0 / np.sqrt(2.0 * freedom)):
        noise, noise_from = noise_mm, "given"
    standard_errors = np.full(len(deviations), np.nan)
    names, scale, jacobian = np.array(parameters.names)[free], parameter_scale(mechanism)[free], jacobian[..., free]
    reduced = analyse_columns(names, scale, jacobian)
    if robust:
        z = (residual / loss_scale_mm) ** 2
        first, second = _DERIVATIVES[loss](z)
        standard_errors[free] = reduced.robust_standard_errors(jacobian, first * residual, first + 2.0 * z * second)
    else:
        standard_errors[free] = reduced.standard_errors(noise)
    # distances, heights and the like have none
    readings = getattr(residuals, "readings", None)
    return Fit(
        parameters, deviations, residual, noise, noise_from, at_bound, standard_errors, ident, evaluations, readings
    )
