"""Least mean distance: the optimum of paper A's objective, eq. (11), which its genetic algorithm searches."""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from rrru.calibration.calibrate import Calibration, assess, estimate_deviations_at
from rrru.calibration.identifiability import analyse, parameter_scale
from rrru.errors import FitError
from rrru.estimation.observations.target_positions import TargetPositions

_OUT_OF_REACH_MM = 1e6
_GRADIENT = 1e-9
# a simplex of more corners converges too slowly; the trust region's end at a kink is then the result
_MOST_FOR_SIMPLEX = 15
_SIMPLEX = {"maxfev": 20_000, "maxiter": 20_000, "xatol": 1e-8, "fatol": 1e-12, "adaptive": True}


def least_mean_distance(residuals: TargetPositions, start: npt.ArrayLike, noise_mm: float | None = None) -> Calibration:
    """Calibration within the parameters' bounds, near `start` (p,), that minimises the mean distance.

    Newton steps in a trust region with the exact gradient and the Hessian of the distances without the model's own
    curvature, which is smaller by residual over link length. Where they end at a kink of the objective (a point met
    exactly) a simplex search goes on, and where they leave the bounds a bounded search (SLSQP) does. The bounds hold
    only where every direction is seen. Raises FitError, carrying scipy's result, where the search fails.
    """
    from scipy import optimize

    mechanism, parameters = residuals.mechanism, residuals.mechanism.parameters
    start = np.asarray(start, dtype=float)
    ident = analyse(mechanism, residuals.jacobian(start))
    # whitened coordinates: one unit along each seen direction moves the points by 1 mm on average
    by_direction = (ident.directions[: ident.rank] * ident.scale).T
    seen = by_direction / ident.singular_values[: ident.rank] * np.sqrt(len(residuals))
    value, gradient, hessian = _objective(residuals, start, seen)
    solution = optimize.minimize(
        value, np.zeros(ident.rank), jac=gradient, hess=hessian, method="trust-exact", options={"gtol": _GRADIENT}
    )
    evaluations, best = int(solution.nfev), solution.x
    if not solution.success and ident.rank <= _MOST_FOR_SIMPLEX:
        options = _SIMPLEX | {"initial_simplex": _simplex(best)}
        simplex = optimize.minimize(
            lambda q: residuals.mean_distance((start + seen @ q)[None])[0], best, method="Nelder-Mead", options=options
        )
        evaluations, best = evaluations + int(simplex.nfev), simplex.x
    deviations = start + seen @ best
    if ident.rank == len(parameters) and not parameters.contains(deviations):
        deviations, more = _bounded(residuals, parameters.clipped_inside(deviations))
        evaluations += more
    if not np.isfinite(residuals.mean_distance(deviations[None])[0]):
        raise FitError(f"least mean distance did not converge: {solution.message}", solution)
    return assess(estimate_deviations_at(residuals, deviations, solution.message, evaluations), noise_mm)


def _objective(
    residuals: TargetPositions, start: np.ndarray, directions: np.ndarray
) -> tuple[Callable[[np.ndarray], float], Callable[[np.ndarray], np.ndarray], Callable[[np.ndarray], np.ndarray]]:
    """Mean distance at start + directions q, its gradient and its Hessian, as functions of q."""
    rank = directions.shape[1]

    @lru_cache(maxsize=1)
    def parts(key: bytes) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        deviations = start + directions @ np.frombuffer(key)
        residual = residuals.residual(deviations)
        if not np.isfinite(residual).all():
            # a trial step left the reach: a value that the trust region rejects
            return np.full(len(residuals), _OUT_OF_REACH_MM), np.zeros((len(residuals), rank)), np.zeros((1, 3, rank))
        distance = np.maximum(np.linalg.norm(residual, axis=1), 1e-12)
        jacobian = residuals.jacobian(deviations) @ directions
        return distance, np.einsum("na,nap->np", residual / distance[:, None], jacobian), jacobian

    def value(q: np.ndarray) -> float:
        return float(parts(q.tobytes())[0].mean())

    def gradient(q: np.ndarray) -> np.ndarray:
        return np.asarray(parts(q.tobytes())[1].mean(axis=0))

    def hessian(q: np.ndarray) -> np.ndarray:
        distance, along, jacobian = parts(q.tobytes())
        weighted = jacobian / np.sqrt(distance[: len(jacobian)])[:, None, None]
        flat, along = weighted.reshape(-1, rank), along / np.sqrt(distance)[:, None]
        return np.asarray((flat.T @ flat - along.T @ along) / len(residuals))

    return value, gradient, hessian


def _simplex(centre: np.ndarray) -> np.ndarray:
    """Simplex (k + 1, k) about a point (k,) with edges of a hundredth of a millimetre's effect."""
    return np.vstack([centre, centre + 0.01 * np.eye(len(centre))])


def _bounded(residuals: TargetPositions, start: np.ndarray) -> tuple[np.ndarray, int]:
    """Errors (p,) of least mean distance inside the bounds from a start (p,) inside them, and the evaluations."""
    from scipy import optimize

    parameters, scale = residuals.mechanism.parameters, parameter_scale(residuals.mechanism)
    value, gradient, _ = _objective(residuals, np.zeros(len(parameters)), np.diag(scale))
    bounds = optimize.Bounds(parameters.low / scale, parameters.high / scale)
    options = {"ftol": 1e-14, "maxiter": 1000}
    solution = optimize.minimize(value, start / scale, jac=gradient, method="SLSQP", bounds=bounds, options=options)
    return np.clip(solution.x * scale, parameters.low, parameters.high), int(solution.nfev)
