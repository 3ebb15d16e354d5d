"""Least squares and least mean distance on the residuals of a calibration, with everything that says how far to trust the answer."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import optimize

from rrru.calibrate.identifiability import Identifiability, analyse
from rrru.errors import FitError

_OUT_OF_REACH_MM = 1e6
LOSSES = ("linear", "soft_l1", "huber", "cauchy")


@dataclass(frozen=True)
class Fit:
    """Fitted errors (p,) and what belongs to them; `noise_mm` is the noise per axis that the standard errors assume."""

    errors: np.ndarray
    residual_mm: np.ndarray
    noise_mm: float
    noise_from: str
    at_bound: np.ndarray
    identifiability: Identifiability
    evaluations: int

    @property
    def standard_errors(self):
        """Standard errors (p,) in the parameters' units."""
        return self.identifiability.standard_errors(self.noise_mm)

    @property
    def rms_mm(self):
        """Root mean square of the distances."""
        return float(np.sqrt((self.residual_mm**2).sum(axis=1).mean()))

    @property
    def mean_mm(self):
        """Mean distance: the objective of paper A."""
        return float(np.linalg.norm(self.residual_mm, axis=1).mean())


def least_squares(residuals, noise_mm=None, loss="linear", loss_scale_mm=0.1):
    """Errors within the parameters' bounds that minimise the sum of squares of the signed residuals (analytic Jacobian).

    noise_mm: known noise per axis; None estimates it from the residuals, and so does a value that the residuals clearly exceed, since
    standard errors from the instrument alone would then promise too much. loss: one of LOSSES, with the residual size `loss_scale_mm` at which
    a robust loss begins to bend. The fit moves only along directions that the points see; the others keep their nominal value.
    Raises FitError, carrying scipy's result, where there are fewer equations than parameters or the search fails.
    """
    parameters = residuals.mechanism.parameters
    start = analyse(residuals.mechanism, residuals.jacobian(parameters.nominal))
    if 3 * len(residuals) < len(parameters):
        raise FitError(f"{len(residuals)} points give {3 * len(residuals)} equations; allowed: at least {len(parameters)}")
    seen = (start.directions[: start.rank] * start.scale).T
    full = start.rank == len(parameters)
    # in the directions' own coordinates the problem is well scaled; the box of the bounds holds only where every direction is seen
    linear = loss == "linear"
    solution = optimize.least_squares(
        lambda q: residuals.residual(parameters.nominal + seen @ q).ravel(),
        np.zeros(start.rank),
        jac=lambda q: residuals.jacobian(parameters.nominal + seen @ q).reshape(-1, len(parameters)) @ seen,
        method="lm" if linear else "trf",
        x_scale=start.singular_values[0] / start.singular_values[: start.rank],
        loss=loss,
        f_scale=1.0 if linear else loss_scale_mm,
        xtol=1e-12,
        ftol=1e-14,
        gtol=1e-12,
    )
    errors = parameters.nominal + seen @ solution.x
    outside = (errors < parameters.low) | (errors > parameters.high)
    if full and outside.any():
        solution = _bounded(residuals, parameters, start, errors, loss, loss_scale_mm)
        errors = solution.x
    if not (solution.success and np.isfinite(errors).all()):
        raise FitError(f"least squares did not converge: {solution.message}", solution)
    residual = residuals.residual(errors)
    freedom = max(residual.size - start.rank, 1)
    estimated = float(np.sqrt((residual**2).sum() / freedom))
    # three standard deviations of an estimated standard deviation
    given = noise_mm is not None and estimated <= noise_mm * (1.0 + 3.0 / np.sqrt(2.0 * freedom))
    return Fit(
        errors=errors,
        residual_mm=residual,
        noise_mm=noise_mm if given else estimated,
        noise_from="given" if given else "residuals",
        at_bound=np.isclose(errors, parameters.low, rtol=1e-6, atol=0.0)
        | np.isclose(errors, parameters.high, rtol=1e-6, atol=0.0)
        | outside,
        identifiability=analyse(residuals.mechanism, residuals.jacobian(errors)),
        evaluations=int(solution.nfev),
    )


def _bounded(residuals, parameters, start, errors, loss, loss_scale_mm):
    """The same fit inside the box of the bounds, for the case that the free optimum lies outside."""
    return optimize.least_squares(
        lambda e: residuals.residual(e).ravel(),
        np.clip(errors, parameters.low, parameters.high) * (1.0 - 1e-6),
        jac=lambda e: residuals.jacobian(e).reshape(-1, len(parameters)),
        bounds=(parameters.low, parameters.high),
        x_scale=start.scale,
        loss=loss,
        f_scale=loss_scale_mm if loss != "linear" else 1.0,
    )


def least_mean_distance(residuals, start):
    """Errors (p,) near `start` (p,) that minimise the mean distance, and the minimum in mm: the optimum that the GA searches.

    Newton steps in a trust region with the exact gradient and the Hessian of the distances without the model's own curvature, which is
    smaller by residual over link length. Raises FitError, carrying scipy's result, where the search fails.
    """
    mechanism = residuals.mechanism
    ident = analyse(mechanism, residuals.jacobian(start))
    # whitened coordinates: one unit along each seen direction moves the points by 1 mm on average
    seen = (ident.directions[: ident.rank] * ident.scale).T / ident.singular_values[: ident.rank] * np.sqrt(len(residuals))

    @lru_cache(maxsize=1)
    def parts(key):
        errors = start + seen @ np.frombuffer(key)
        residual = residuals.residual(errors)
        if not np.isfinite(residual).all():
            # a trial step left the reach: a value that the trust region turns away from
            return np.full(len(residuals), _OUT_OF_REACH_MM), np.zeros((len(residuals), ident.rank)), np.zeros((1, 3, ident.rank))
        distance = np.maximum(np.linalg.norm(residual, axis=1), 1e-12)
        jacobian = residuals.jacobian(errors) @ seen
        return distance, np.einsum("na,nap->np", residual / distance[:, None], jacobian), jacobian

    def value(q):
        return parts(q.tobytes())[0].mean()

    def gradient(q):
        return parts(q.tobytes())[1].mean(axis=0)

    def hessian(q):
        distance, along, jacobian = parts(q.tobytes())
        weighted = jacobian / np.sqrt(distance[: len(jacobian)])[:, None, None]
        flat, along = weighted.reshape(-1, weighted.shape[-1]), along / np.sqrt(distance)[:, None]
        return (flat.T @ flat - along.T @ along) / len(residuals)

    solution = optimize.minimize(value, np.zeros(ident.rank), jac=gradient, hess=hessian, method="trust-exact", options={"gtol": 1e-9})
    if not np.isfinite(solution.fun):
        raise FitError(f"least mean distance did not converge: {solution.message}", solution)
    return start + seen @ solution.x, float(solution.fun)
