"""Least mean distance of many draws on a linearised model, fast enough for every candidate of the twin's search."""

import numba
import numpy as np

from rrru.calibration.identifiability import RANK_TOLERANCE
from rrru.errors import FitError
from rrru.robots.rrru3_kernels import forward
from rrru.studies.rrru3.twin_kernels import parameter_jacobian

# weights in mm of the squared excess over a bound, in half widths, one after another: the searches begin outside of the
# bounds, where a high weight leads nowhere, and end with violations of some 1e-5. The model is linearised for each
_STIFFNESSES = (10.0, 100.0, 1000.0, 10000.0)
# Newton steps, the smallest tried share of one, and the gain in mm below which a draw is solved
_MOST_STEPS, _LEAST_SHARE, _LEAST_GAIN_MM = 60, 1e-3, 1e-7
_LEAST_DISTANCE_MM, _LEAST_PIVOT = 1e-9, 1e-14

# sums over points are taken in any order, so that they vectorise
_FAST = {"reassoc", "contract", "nsz"}
_compiled = numba.njit(cache=True, error_model="numpy", fastmath=_FAST)
# inlined by its caller: see `rrru.robots.rrru3_kernels`
_part = numba.njit(forceinline=True, error_model="numpy", fastmath=_FAST)


def linear_fit(mechanism, theta, measured, start):
    """Deviations (d, p) of least mean distance within the mechanism's bounds, and the minima (d,), of d draws.

    The model is linearised at the mean of the draws' deviations, first at those of least squares, then at those found.
    theta, start: (n, 3); measured: (d, n, 3). Raises FitError where the iteration leaves the workspace.
    """
    parameters, model = mechanism.parameters, (mechanism.nominal_legs, mechanism.azimuth_cos_sin, mechanism.leg_map)
    low, high = parameters.low, parameters.high
    arrays = np.ascontiguousarray(np.cos(theta).T), np.ascontiguousarray(np.sin(theta).T), theta
    near, mean = np.ascontiguousarray(start.T), measured.mean(axis=0)
    centre = _least_squares(arrays, mean, near, model, (low, high))
    found, half = None, 0.5 * (high - low)
    for stiffness in _STIFFNESSES:
        position, jacobian = _linearised(arrays, centre, near, model)
        if not (np.isfinite(position).all() and np.isfinite(jacobian).all()):
            raise FitError("the candidate's calibration leaves the workspace")
        whitened = np.linalg.qr(jacobian.reshape(-1, len(centre)))
        back, basis = np.linalg.inv(whitened.R), whitened.Q.reshape(jacobian.shape).transpose(2, 1, 0)
        # place of the deviations within their bounds, in half widths: middle + over q, violated beyond 1
        middle, over = (centre - 0.5 * (high + low)) / half, back / half[:, None]
        gram = (basis[:, None] * basis).sum(axis=2)
        residual = measured - position
        # from least squares, then from where the last search ended
        q = residual.reshape(len(residual), -1) @ whitened.Q if found is None else (found - centre) @ whitened.R.T
        arrays_of_draws = residual.transpose(0, 2, 1), basis, gram, q, over, middle
        q, value = _newton(stiffness, *map(np.ascontiguousarray, arrays_of_draws))
        found = centre + q @ back.T
        centre = np.clip(found.mean(axis=0), low, high)
    return found, value


def _linearised(arrays, deviations, near, model):
    """Positions (n, 3) of the model with deviations (p,), and their derivatives (n, 3, p); NaN beyond the workspace."""
    (cosine, sine, theta), (nominal, turn, leg_map) = arrays, model
    legs = nominal + leg_map @ deviations
    position = np.ascontiguousarray(forward(legs.reshape(1, 3, 5), turn, cosine, sine, near)[0].T)
    return position, parameter_jacobian(position, theta, legs, turn, leg_map)


def _least_squares(arrays, measured, near, model, bounds):
    """Deviations (p,) of least squares, clipped to bounds (low, high), by three steps of Gauss and Newton.

    Of measured positions (n, 3), up to where a step leaves the workspace. arrays: cosines and sines (3, n) of the drive
    angles and these (n, 3); model: nominal numbers of the legs, their azimuths' cosines and sines, and derivatives of
    the numbers by the parameters.
    """
    deviations = np.zeros(model[2].shape[2])
    for _ in range(3):
        position, jacobian = _linearised(arrays, deviations, near, model)
        flat, residual = jacobian.reshape(-1, len(deviations)), (measured - position).ravel()
        if not (np.isfinite(residual).all() and np.isfinite(flat).all()):
            break
        moved = deviations + np.linalg.lstsq(flat, residual, RANK_TOLERANCE)[0]
        deviations = np.minimum(np.maximum(moved, bounds[0]), bounds[1])
    return deviations


@_compiled
def _newton(stiffness, residual, basis, gram, start, back, middle):
    """Coordinates q (d, p) that minimise the mean distances of residuals (d, 3, n) - q basis (p, 3, n), and the minima.

    Damped Newton from least squares, one draw after another; the basis is orthonormal. gram (p, p, n): products of its
    vectors at every point; middle (p,) + back (p, p) q: place within the bounds, violated beyond 1. The loops over
    points are the innermost ones.
    """
    draws, points, size = residual.shape[0], residual.shape[2], basis.shape[0]
    found, least = start.copy(), np.empty(draws)
    left, moved, weight, along = (
        np.empty((3, points)),
        np.empty((3, points)),
        np.empty(points),
        np.empty((size, points)),
    )
    slope, step, place, moves = np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    bend = np.empty((size, size))
    for d in range(draws):
        q = found[d]
        left[:] = residual[d]
        _add(left, -q, basis)
        for k in range(size):
            place[k] = middle[k]
            for p in range(size):
                place[k] += back[k, p] * q[p]
        value = _value(left, moved, 0.0, place, moves, stiffness)
        for _ in range(_MOST_STEPS):
            for n in range(points):
                size_mm = np.sqrt(left[0, n] ** 2 + left[1, n] ** 2 + left[2, n] ** 2)
                weight[n] = 1.0 / max(size_mm, _LEAST_DISTANCE_MM)
            for p in range(size):
                total = 0.0
                for n in range(points):
                    product = left[0, n] * basis[p, 0, n] + left[1, n] * basis[p, 1, n] + left[2, n] * basis[p, 2, n]
                    along[p, n] = weight[n] * product
                    total += along[p, n]
                slope[p] = total / points
                for k in range(p + 1):
                    total = 0.0
                    for n in range(points):
                        total += weight[n] * (gram[p, k, n] - along[p, n] * along[k, n])
                    bend[p, k] = total / points
            for k in range(size):
                excess = place[k] - min(max(place[k], -1.0), 1.0)
                if excess != 0.0:
                    for p in range(size):
                        slope[p] -= 2.0 * stiffness * excess * back[k, p]
                        for m in range(p + 1):
                            bend[p, m] += 2.0 * stiffness * back[k, p] * back[k, m]
            _solve(bend, slope, step)
            moved[:] = 0.0
            _add(moved, step, basis)
            for k in range(size):
                moves[k] = 0.0
                for p in range(size):
                    moves[k] += back[k, p] * step[p]
            share, tried = 1.0, _value(left, moved, 1.0, place, moves, stiffness)
            while not tried < value and share > _LEAST_SHARE:
                share *= 0.5
                tried = _value(left, moved, share, place, moves, stiffness)
            if not tried < value:
                break
            gain, value = value - tried, tried
            for p in range(size):
                q[p] += share * step[p]
                place[p] += share * moves[p]
            left -= share * moved
            if gain < _LEAST_GAIN_MM:
                break
        least[d] = value
    return found, least


@_part
def _add(vectors, factors, basis):
    """Add factors (p,) of a basis (p, 3, n) to vectors (3, n), in place."""
    for p in range(len(factors)):
        for a in range(3):
            for n in range(vectors.shape[1]):
                vectors[a, n] += factors[p] * basis[p, a, n]


@numba.njit(forceinline=True, error_model="numpy")
def _solve(matrix, right, result):
    """Solution (p,) of a positive definite matrix (p, p), of which the lower half is given, by Cholesky in place."""
    size = len(right)
    for p in range(size):
        for k in range(p + 1):
            rest = matrix[p, k]
            for m in range(k):
                rest -= matrix[p, m] * matrix[k, m]
            matrix[p, k] = np.sqrt(max(rest, _LEAST_PIVOT)) if k == p else rest / matrix[k, k]
    for p in range(size):
        rest = right[p]
        for m in range(p):
            rest -= matrix[p, m] * result[m]
        result[p] = rest / matrix[p, p]
    for p in range(size - 1, -1, -1):
        rest = result[p]
        for m in range(p + 1, size):
            rest -= matrix[m, p] * result[m]
        result[p] = rest / matrix[p, p]


@_part
def _value(left, moved, share, place, moves, stiffness):
    """Mean distance of residuals left (3, n) after a share of a step, which changes them by -moved, and the penalty."""
    total = 0.0
    for n in range(left.shape[1]):
        x, y, z = left[0, n], left[1, n], left[2, n]
        if share > 0.0:
            x, y, z = x - share * moved[0, n], y - share * moved[1, n], z - share * moved[2, n]
        total += np.sqrt(x * x + y * y + z * z)
    total /= left.shape[1]
    for k in range(place.shape[0]):
        at = place[k] + share * moves[k] if share > 0.0 else place[k]
        total += stiffness * (at - min(max(at, -1.0), 1.0)) ** 2
    return total
