"""Least squares on the residuals of a calibration, with everything that says how far to trust the answer."""

from dataclasses import dataclass

import numpy as np
from scipy import optimize

from rrru.errors import FitError
from rrru.fit.identifiability import Identifiability, analyse, analyse_columns, parameter_scale

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
    """Fitted deviations (p,) and what belongs to them.

    standard_deviations (p,): NaN for a parameter at a bound, inf for one that the points do not see. noise_mm: noise per
    axis that they assume, from where `noise_from` says ("given", "residuals"). evaluations: of all residuals.
    """

    deviations: np.ndarray
    residual_mm: np.ndarray
    noise_mm: float
    noise_from: str
    at_bound: np.ndarray
    standard_errors: np.ndarray
    identifiability: Identifiability
    evaluations: int

    @property
    def rms_mm(self):
        """Root mean square of the distances."""
        return float(np.sqrt((self.residual_mm**2).sum(axis=1).mean()))

    @property
    def mean_mm(self):
        """Mean distance: the objective of paper A."""
        return float(np.linalg.norm(self.residual_mm, axis=1).mean())


def least_squares(residuals, noise_mm=None, loss="linear", loss_scale_mm=0.1):
    """Errors within the parameters' bounds that minimise the sum of squares of the signed residuals (analytic
    Jacobian).

    noise_mm: known noise per axis; None estimates it from the residuals, and so does a value that the residuals clearly
    exceed, since standard errors from the instrument alone would then promise too much. loss: one of LOSSES, with the
    residual size `loss_scale_mm` at which a robust loss begins to bend; its noise is the median absolute residual's and
    its standard errors are those of an M-estimator (Huber, Robust Statistics, 1981, section 7.6). The fit moves only
    along directions that the points see; the others keep their nominal value. Raises FitError, carrying scipy's result,
    where there are fewer equations than parameters or the search fails.
    """
    parameters = residuals.mechanism.parameters
    equations = residuals.residual(parameters.nominal).size
    if equations < len(parameters):
        raise FitError(f"{len(residuals)} points give {equations} equations; allowed: at least {len(parameters)}")
    start = analyse(residuals.mechanism, residuals.jacobian(parameters.nominal))
    seen = (start.directions[: start.rank] * start.scale).T
    linear = loss == "linear"
    options = {"loss": loss, "f_scale": 1.0 if linear else loss_scale_mm, "xtol": 1e-12, "ftol": 1e-14, "gtol": 1e-12}
    # in the directions' own coordinates the problem is well scaled; the box of the bounds holds only where every
    # direction is seen
    solution = optimize.least_squares(
        lambda q: residuals.residual(parameters.nominal + seen @ q).ravel(),
        np.zeros(start.rank),
        jac=lambda q: residuals.jacobian(parameters.nominal + seen @ q).reshape(-1, len(parameters)) @ seen,
        method="lm" if linear else "trf",
        x_scale=start.singular_values[0] / start.singular_values[: start.rank],
        **options,
    )
    deviations, evaluations = parameters.nominal + seen @ solution.x, int(solution.nfev)
    if start.rank == len(parameters) and not parameters.hold(deviations):
        solution = optimize.least_squares(
            lambda e: residuals.residual(e).ravel(),
            parameters.inside(deviations),
            jac=lambda e: residuals.jacobian(e).reshape(-1, len(parameters)),
            bounds=(parameters.low, parameters.high),
            x_scale=start.scale,
            **options,
        )
        deviations, evaluations = solution.x, evaluations + int(solution.nfev)
    if not (solution.success and np.isfinite(deviations).all()):
        raise FitError(f"least squares did not converge: {solution.message}", solution)
    return make_fit(residuals, deviations, evaluations, noise_mm, loss, loss_scale_mm)


def make_fit(residuals, deviations, evaluations, noise_mm=None, loss="linear", loss_scale_mm=0.1):
    """Fit of deviations (p,) that a search has found; see `least_squares` for the other arguments."""
    mechanism = residuals.mechanism
    residual, jacobian = residuals.residual(deviations), residuals.jacobian(deviations)
    identifiability = analyse(mechanism, jacobian)
    at_bound = mechanism.parameters.at_bound(deviations)
    free = np.flatnonzero(~at_bound)
    freedom = max(residual.size - min(identifiability.rank, len(free)), 1)
    estimated = float(np.sqrt((residual**2).sum() / freedom))
    if loss != "linear":
        # the median absolute value of a standard normal number is 0.6745
        estimated = float(np.median(np.abs(residual)) / 0.6745)
    # three standard deviations of an estimated standard deviation
    given = noise_mm is not None and estimated <= noise_mm * (1.0 + 3.0 / np.sqrt(2.0 * freedom))
    noise = noise_mm if given else estimated
    standard_errors = np.full(len(deviations), np.nan)
    reduced = analyse_columns(
        [mechanism.parameters.names[k] for k in free], parameter_scale(mechanism)[free], jacobian[..., free]
    )
    if loss == "linear":
        standard_errors[free] = reduced.standard_errors(noise)
    else:
        z = (residual / loss_scale_mm) ** 2
        first, second = _DERIVATIVES[loss](z)
        standard_errors[free] = reduced.robust_standard_errors(
            jacobian[..., free], first * residual, first + 2.0 * z * second
        )
    return Fit(
        deviations,
        residual,
        noise,
        "given" if given else "residuals",
        at_bound,
        standard_errors,
        identifiability,
        evaluations,
    )
