"""Compiled inner loops of the forward kinematics: a population of error vectors times the points of a campaign.

Those of the 3-RRRU come first; their arrays are stored component first, shape (3, n), so that the loop over points is
the innermost one and vectorises, and `legs` has the columns of `rrru.robots.rrru3`. Lengths in mm, angles
in rad.
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.kinematics.typed_numba import njit

# A Newton step of this squared length in mm^2 leaves an error far below 1e-9 mm: convergence is quadratic with a
# constant of about 1 / (link length): (1e-4)^2 / 100 = 1e-10.
_LAST_STEP_SQUARED = 1e-8
_MOST_STEPS = 25

# of a leg: cosine and sine of its azimuth and of its drive's offset; lengths
_Leg = tuple[float, float, float, float, tuple[float, float, float, float]]

_compiled = njit(cache=True, error_model="numpy", fastmath={"contract"})
# inlined by its caller: a separate copy would contract products in another way, and freshly compiled code would give
# other last bits than the same code loaded from the cache
_part = njit(forceinline=True, error_model="numpy", fastmath={"contract"})


@_part
def _newton_step(
    legs: FloatArray,
    turn: FloatArray,
    cosine: FloatArray,
    sine: FloatArray,
    position: FloatArray,
    step_squared: FloatArray,
) -> None:
    """One Newton step of all points on the closures (eq. 8), in place; squared step lengths go to `step_squared`."""
    first, second, third = _leg(legs, turn, 0), _leg(legs, turn, 1), _leg(legs, turn, 2)
    for j in range(position.shape[1]):
        x, y, z = position[0, j], position[1, j], position[2, j]
        g00, g01, g02, h0 = _leg_row(x, y, z, first, cosine[0, j], sine[0, j])
        g10, g11, g12, h1 = _leg_row(x, y, z, second, cosine[1, j], sine[1, j])
        g20, g21, g22, h2 = _leg_row(x, y, z, third, cosine[2, j], sine[2, j])
        c0 = g11 * g22 - g12 * g21
        c1 = g12 * g20 - g10 * g22
        c2 = g10 * g21 - g11 * g20
        scale = -1.0 / (g00 * c0 + g01 * c1 + g02 * c2)
        dx = scale * (h0 * c0 + h1 * (g02 * g21 - g01 * g22) + h2 * (g01 * g12 - g02 * g11))
        dy = scale * (h0 * c1 + h1 * (g00 * g22 - g02 * g20) + h2 * (g02 * g10 - g00 * g12))
        dz = scale * (h0 * c2 + h1 * (g01 * g20 - g00 * g21) + h2 * (g00 * g11 - g01 * g10))
        position[0, j] = x + dx
        position[1, j] = y + dy
        position[2, j] = z + dz
        step_squared[j] = dx * dx + dy * dy + dz * dz


# not contracted: a square that is rounded by itself gives the same bits wherever the legs come from
@njit(cache=True, error_model="numpy")
def _leg(legs: FloatArray, turn: FloatArray, k: int) -> _Leg:
    """Numbers of one leg that are the same at all points: cosines and sines of azimuth and drive offset, lengths."""
    angle, forearm = legs[k, 0], legs[k, 3]
    lengths = legs[k, 1], legs[k, 2], forearm * forearm, legs[k, 4]
    return turn[0, k], turn[1, k], np.cos(angle), np.sin(angle), lengths


@njit(inline="always", error_model="numpy", fastmath={"contract"})
def _leg_row(x: float, y: float, z: float, leg: _Leg, cosine: float, sine: float) -> tuple[float, float, float, float]:
    """Half the closure's gradient with respect to x, y, z and half the closure itself, for one leg at one point."""
    cx, cy, cos_delta, sin_delta, (arm, offset, forearm_squared, radial) = leg
    v = cx * y - cy * x
    s = np.sqrt(forearm_squared - v * v)
    rho = offset + s
    big_x = cx * x + cy * y + radial - arm * (cosine * cos_delta - sine * sin_delta)
    big_z = z - arm * (sine * cos_delta + cosine * sin_delta)
    side = rho * v / s
    closure = 0.5 * (big_x * big_x + big_z * big_z - rho * rho)
    return big_x * cx - side * cy, big_x * cy + side * cx, big_z, closure


@_part
def _solve(
    legs: FloatArray,
    turn: FloatArray,
    cosine: FloatArray,
    sine: FloatArray,
    position: FloatArray,
    step_squared: FloatArray,
) -> None:
    """Newton on all points, in place, until the longest step is negligible; NaN where it does not converge."""
    n = position.shape[1]
    for iteration in range(_MOST_STEPS):
        _newton_step(legs, turn, cosine, sine, position, step_squared)
        converged = iteration > 0
        for j in range(n):
            # NaN is a point out of reach and stays NaN: it must not keep the others iterating
            if step_squared[j] > _LAST_STEP_SQUARED:
                converged = False
        if converged:
            return
    for j in range(n):
        if step_squared[j] > _LAST_STEP_SQUARED:
            for axis in range(3):
                position[axis, j] = np.nan


@_compiled
def forward(legs: FloatArray, turn: FloatArray, cosine: FloatArray, sine: FloatArray, start: FloatArray) -> FloatArray:
    """Positions of n drive-angle triples under m sets of leg numbers.

    legs: (m, 3, 5); turn: (2, 3) cosine and sine of the azimuths; cosine, sine: (3, n) of the drive angles; start: (3,
    n) first guess. Returns (m, 3, n), NaN where Newton did not converge.
    """
    m, n = legs.shape[0], start.shape[1]
    result = np.empty((m, 3, n))
    step_squared = np.empty(n)
    for k in range(m):
        for axis in range(3):
            for j in range(n):
                result[k, axis, j] = start[axis, j]
        _solve(legs[k], turn, cosine, sine, result[k], step_squared)
    return result


@_compiled
def tripod_mean_distance(ends: FloatArray, radii: FloatArray, measured: FloatArray) -> FloatArray:
    """Mean distance (m,) of points (n, 3) to `lower_intersection` of spheres at ends (m, n, 3, 3), radii (m, 3)."""
    m, n = ends.shape[0], ends.shape[1]
    result = np.empty(m)
    along, rest, normal = np.empty(3), np.empty(3), np.empty(3)
    for i in range(m):
        total = 0.0
        first, second, third = radii[i, 0] ** 2, radii[i, 1] ** 2, radii[i, 2] ** 2
        for j in range(n):
            d = u = h = 0.0
            for k in range(3):
                along[k] = ends[i, j, 1, k] - ends[i, j, 0, k]
                d += along[k] * along[k]
            d = np.sqrt(d)
            for k in range(3):
                along[k] /= d
                u += (ends[i, j, 2, k] - ends[i, j, 0, k]) * along[k]
            for k in range(3):
                rest[k] = ends[i, j, 2, k] - ends[i, j, 0, k] - u * along[k]
                h += rest[k] * rest[k]
            h = np.sqrt(h)
            x = (d * d + first - second) / (2.0 * d)
            y = (u * u + h * h + first - third - 2.0 * u * x) / (2.0 * h)
            height = np.sqrt(first - x * x - y * y)
            for k in range(3):
                rest[k] /= h
            normal[0] = along[1] * rest[2] - along[2] * rest[1]
            normal[1] = along[2] * rest[0] - along[0] * rest[2]
            normal[2] = along[0] * rest[1] - along[1] * rest[0]
            if normal[2] > 0.0:
                height = -height
            square = 0.0
            for k in range(3):
                off = ends[i, j, 0, k] + x * along[k] + y * rest[k] + height * normal[k] - measured[j, k]
                square += off * off
            total += np.sqrt(square)
        result[i] = total / n if np.isfinite(total) else np.inf
    return result
