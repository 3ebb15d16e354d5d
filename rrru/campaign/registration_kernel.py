"""Compiled search of `rrru.campaign.target_registration` over rotations.

A check of one file takes a million steps of it, each of a few dozen products.
"""

import numba
import numpy as np

# inlined by its caller, see `rrru.robots.rrru3_kernels`
_part = numba.njit(forceinline=True, error_model="numpy")


@numba.njit(cache=True, error_model="numpy")
def descend(
    rest: np.ndarray, left: np.ndarray, rotations: np.ndarray, iterations: int, tolerance_rad: float
) -> tuple[np.ndarray, np.ndarray]:
    """Rotations (m, 3, 3) and costs (m,) after at most so many steps of Levenberg's and Marquardt's method each.

    The cost of a rotation Q is |rest q - left|^2 of its entries q, with rest (r, 9) and left (r,).
    """
    found, costs = rotations.copy(), np.empty(len(rotations))
    slopes, normal, gradient, step = np.empty(3), np.empty((3, 3)), np.empty(3), np.empty(3)
    turn, trial = np.empty((3, 3)), np.empty((3, 3))
    for m in range(len(found)):
        at, damping = found[m], 1e-3
        cost = _cost(rest, left, at)
        for _ in range(iterations):
            _normal_equations(rest, left, at, slopes, normal, gradient)
            size = normal[0, 0] + normal[1, 1] + normal[2, 2]
            for i in range(3):
                normal[i, i] += (damping + 1e-14) * size + 1e-300
            _solve(normal, gradient, step)
            length = np.sqrt(step[0] ** 2 + step[1] ** 2 + step[2] ** 2)
            if length > 1.0:
                step /= length
                length = 1.0
            _turned(step, length, turn)
            for i in range(3):
                for j in range(3):
                    trial[i, j] = turn[i, 0] * at[0, j] + turn[i, 1] * at[1, j] + turn[i, 2] * at[2, j]
            after = _cost(rest, left, trial)
            if after < cost:
                at[:], cost, damping = trial, after, 0.1 * damping
            else:
                damping = max(10.0 * damping, 1e-6)
            if length < tolerance_rad:
                break
        costs[m] = cost
    return found, costs


@_part
def _residual(rest: np.ndarray, left: np.ndarray, at: np.ndarray, row: int) -> float:
    """One residual of a rotation (3, 3)."""
    off: float = -left[row]
    for i in range(3):
        for j in range(3):
            off += rest[row, 3 * i + j] * at[i, j]
    return off


@_part
def _cost(rest: np.ndarray, left: np.ndarray, at: np.ndarray) -> float:
    """Sum of squared residuals of a rotation (3, 3)."""
    total = 0.0
    for row in range(len(left)):
        total += _residual(rest, left, at, row) ** 2
    return total


@_part
def _normal_equations(
    rest: np.ndarray, left: np.ndarray, at: np.ndarray, slopes: np.ndarray, normal: np.ndarray, gradient: np.ndarray
) -> None:
    """Normal matrix (3, 3) and gradient (3,) by a small turn, exp(w) Q, of a rotation (3, 3), in place."""
    normal[:], gradient[:] = 0.0, 0.0
    for row in range(len(left)):
        off = _residual(rest, left, at, row)
        for axis in range(3):
            one, other = (axis + 1) % 3, (axis + 2) % 3
            slopes[axis] = 0.0
            for j in range(3):
                slopes[axis] += rest[row, 3 * other + j] * at[one, j] - rest[row, 3 * one + j] * at[other, j]
        for i in range(3):
            gradient[i] += slopes[i] * off
            for j in range(3):
                normal[i, j] += slopes[i] * slopes[j]


@_part
def _solve(normal: np.ndarray, gradient: np.ndarray, step: np.ndarray) -> None:
    """The step (3,) of - normal^-1 gradient by Cholesky's factors, which replace the lower triangle of the normal
    matrix (3, 3).
    """
    for i in range(3):
        for j in range(i + 1):
            for k in range(j):
                normal[i, j] -= normal[i, k] * normal[j, k]
            normal[i, j] = normal[i, j] / normal[j, j] if j < i else np.sqrt(max(normal[i, i], 1e-300))
    for i in range(3):
        step[i] = -gradient[i]
        for k in range(i):
            step[i] -= normal[i, k] * step[k]
        step[i] /= normal[i, i]
    for i in range(2, -1, -1):
        for k in range(i + 1, 3):
            step[i] -= normal[k, i] * step[k]
        step[i] /= normal[i, i]


@_part
def _turned(step: np.ndarray, length: float, turn: np.ndarray) -> None:
    """The rotation (3, 3) of a rotation vector (3,), in place, by the unit quaternion."""
    # sin(x / 2) / x of a small x by its series
    share = 0.5 - length**2 / 48.0 + length**4 / 3840.0 if length < 1e-3 else np.sin(0.5 * length) / length
    x, y, z, w = share * step[0], share * step[1], share * step[2], np.cos(0.5 * length)
    turn[0, 0], turn[0, 1], turn[0, 2] = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
    turn[1, 0], turn[1, 1], turn[1, 2] = 2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
    turn[2, 0], turn[2, 1], turn[2, 2] = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)
