"""Least mean distance of many draws on a linearised model, fast enough for every candidate of the twin's search."""

import numba
import numpy as np

from rrru.calibration.identifiability import RANK_TOLERANCE
from rrru.errors import FitError

# weight in mm of the squared excess over a bound, in half widths: violations are some thousandths
_STIFFNESS = 10.0
# Newton steps, the smallest tried share of one, and the gain in mm below which a draw is solved
_MOST_STEPS, _LEAST_SHARE, _LEAST_GAIN_MM = 60, 1e-3, 1e-7
_LEAST_DISTANCE_MM = 1e-9


def linear_fit(mechanism, theta, measured, start):
    """Deviations (d, p) of least mean distance within the mechanism's bounds, and the minima (d,), of d draws.

    The model is linearised once, at the least-squares deviations of the draws' mean. theta, start: (n, 3); measured:
    (d, n, 3). Raises FitError where the iteration leaves the workspace.
    """
    parameters, centre = mechanism.parameters, measured.mean(axis=0)
    deviations = parameters.nominal
    for _ in range(3):
        residual, jacobian = _linearised(mechanism, theta, centre, start, deviations)
        step = np.linalg.lstsq(jacobian.reshape(-1, len(deviations)), residual.ravel(), rcond=RANK_TOLERANCE)[0]
        deviations = np.clip(deviations + step, parameters.low, parameters.high)
    residual, jacobian = _linearised(mechanism, theta, centre, start, deviations)
    whitened = np.linalg.qr(jacobian.reshape(-1, len(deviations)))
    back, basis, residual = (
        np.linalg.inv(whitened.R),
        whitened.Q.reshape(jacobian.shape),
        residual + (measured - centre),
    )
    # place of the deviations within their bounds, in half widths: middle + over q, violated beyond 1
    half = 0.5 * (parameters.high - parameters.low)
    middle, over = (deviations - 0.5 * (parameters.high + parameters.low)) / half, back / half[:, None]
    start, gram = np.einsum("dna,nap->dp", residual, basis), np.einsum("nap,naq->npq", basis, basis)
    q, value = _newton(*map(np.ascontiguousarray, (residual, basis, gram, start, over, middle)))
    return deviations + q @ back.T, value


def _linearised(mechanism, theta, measured, start, deviations):
    """Residuals (n, 3) of measured positions and the model's derivatives (n, 3, p) at deviations."""
    residual = measured - mechanism.forward(theta, deviations, start)
    jacobian = mechanism.parameter_jacobian(measured - residual, theta, deviations)
    if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
        raise FitError("the candidate's calibration leaves the workspace")
    return residual, jacobian


@numba.njit(cache=True)
def _newton(residual, basis, gram, start, back, middle):
    """Coordinates q (d, p) that minimise the mean distances of residuals (d, n, 3) - basis (n, 3, p) q, and the minima.

    Damped Newton from least squares, one draw after another; the basis is orthonormal. gram (n, p, p): basis^T basis of
    every point; middle (p,) + back (p, p) q: place within the bounds, violated beyond 1.
    """
    draws, points, size = residual.shape[0], residual.shape[1], basis.shape[2]
    found, least = start.copy(), np.empty(draws)
    left, moved, along = np.empty((points, 3)), np.empty((points, 3)), np.empty(size)
    slope, bend, place, moves = np.empty(size), np.empty((size, size)), np.empty(size), np.empty(size)
    for d in range(draws):
        q = found[d]
        for n in range(points):
            for a in range(3):
                left[n, a] = residual[d, n, a]
                for p in range(size):
                    left[n, a] -= basis[n, a, p] * q[p]
        for k in range(size):
            place[k] = middle[k]
            for p in range(size):
                place[k] += back[k, p] * q[p]
        value = _value(left, moved, 0.0, place, moves)
        for _ in range(_MOST_STEPS):
            slope[:], bend[:] = 0.0, 0.0
            for n in range(points):
                weight = 1.0 / max(np.sqrt(left[n, 0] ** 2 + left[n, 1] ** 2 + left[n, 2] ** 2), _LEAST_DISTANCE_MM)
                for p in range(size):
                    along[p] = weight * (
                        left[n, 0] * basis[n, 0, p] + left[n, 1] * basis[n, 1, p] + left[n, 2] * basis[n, 2, p]
                    )
                    slope[p] += along[p] / points
                    for k in range(p + 1):
                        bend[p, k] += weight * (gram[n, p, k] - along[p] * along[k]) / points
            for k in range(size):
                excess = place[k] - min(max(place[k], -1.0), 1.0)
                if excess != 0.0:
                    for p in range(size):
                        slope[p] -= 2.0 * _STIFFNESS * excess * back[k, p]
                        for m in range(p + 1):
                            bend[p, m] += 2.0 * _STIFFNESS * back[k, p] * back[k, m]
            for p in range(size):
                for k in range(p):
                    bend[k, p] = bend[p, k]
            step = np.linalg.solve(bend, slope)
            for n in range(points):
                for a in range(3):
                    moved[n, a] = 0.0
                    for p in range(size):
                        moved[n, a] += basis[n, a, p] * step[p]
            for k in range(size):
                moves[k] = 0.0
                for p in range(size):
                    moves[k] += back[k, p] * step[p]
            share, tried = 1.0, _value(left, moved, 1.0, place, moves)
            while not tried < value and share > _LEAST_SHARE:
                share *= 0.5
                tried = _value(left, moved, share, place, moves)
            if not tried < value:
                break
            gain, value = value - tried, tried
            for p in range(size):
                q[p] += share * step[p]
                place[p] += share * moves[p]
            for n in range(points):
                for a in range(3):
                    left[n, a] -= share * moved[n, a]
            if gain < _LEAST_GAIN_MM:
                break
        least[d] = value
    return found, least


@numba.njit(cache=True)
def _value(left, moved, share, place, moves):
    """Mean distance of residuals left (n, 3) after a share of a step, which changes them by -moved, and the penalty."""
    total = 0.0
    for n in range(left.shape[0]):
        square = 0.0
        for a in range(3):
            square += (left[n, a] - share * moved[n, a]) ** 2 if share > 0.0 else left[n, a] ** 2
        total += np.sqrt(square)
    total /= left.shape[0]
    for k in range(place.shape[0]):
        at = place[k] + share * moves[k] if share > 0.0 else place[k]
        total += _STIFFNESS * (at - min(max(at, -1.0), 1.0)) ** 2
    return total
