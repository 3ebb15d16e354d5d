"""Compiled objective of the 3-RRRU: mean distance between measured and model positions of a population of deviations.

Arrays are stored component first, so that the loop over points is the innermost one and vectorises. Lengths in mm,
angles in rad. Every rounding is explicit (`fma`), so that equal arguments give equal bytes in every process.
"""

from functools import cache

import numpy as np

from rrru.arrays import FloatArray
from rrru.kinematics.compiled import Kernel, fma
from rrru.kinematics.typed_numba import njit
from rrru.robots.three_legs import ThreeLegs

# A Newton step of this size (mm^2, squared) leaves an error far below 1e-9 mm, since convergence is quadratic with a
# constant of about 1 / (link length): (1e-4)^2 / 100 = 1e-10.
_LAST_STEP_SQUARED = 1e-8
_MOST_STEPS = 25
# rows of `points`, each the n points' values of three legs or axes: cosines and sines of the drive angles, positions
# without deviations, measured positions, and from here on the positions' derivative by each parameter
_COSINE, _SINE, _START, _MEASURED, _SLOPE = range(5)

# numbers of a leg as `_closure` needs them
_Leg = tuple[float, float, float, float, float, float, float]

_compiled = njit(cache=True, error_model="numpy")


def arrays(
    mechanism: ThreeLegs, angles_rad: FloatArray, nominal_mm: FloatArray, measured_mm: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Arguments `legs` and `points` of the kernel.

    angles_rad, nominal_mm, measured_mm (n, 3): drive angles, positions without deviations and measured ones.
    """
    affine = np.concatenate([mechanism.nominal_legs[..., None], mechanism.leg_map], axis=2)
    azimuth = np.zeros((3, 2, affine.shape[2]))
    azimuth[..., 0] = mechanism.azimuth_cos_sin.T
    slope = mechanism.parameter_jacobian(nominal_mm, angles_rad).transpose(2, 1, 0)
    rows = [np.cos(angles_rad).T, np.sin(angles_rad).T, nominal_mm.T, measured_mm.T, *slope]
    return np.concatenate([affine, azimuth], axis=1), np.array(rows, dtype=float).reshape(len(rows), -1)


@cache
def kernel() -> Kernel:
    """The compiled objective, see `rrru.kinematics.compiled`."""
    return Kernel(_mean_distance)


@_compiled
def _closure(leg: _Leg, x: float, y: float, z: float, cosine: float, sine: float) -> tuple[float, float, float, float]:
    """Half the gradient of a leg's closure (eq. 8) at x, y, z and the closure, all times s = sqrt(L3^2 - v^2)."""
    cx, cy = leg[5], leg[6]
    arm_cosine, arm_sine = leg[0], leg[1]
    v = fma(cx, y, -cy * x)
    s = np.sqrt(fma(-v, v, leg[3]))
    rho = leg[2] + s
    big_x = fma(cx, x, fma(cy, y, fma(arm_sine, sine, fma(-arm_cosine, cosine, leg[4]))))
    big_z = fma(-arm_cosine, sine, fma(-arm_sine, cosine, z))
    along, across = s * big_x, rho * v
    closure = s * fma(big_x, big_x, fma(big_z, big_z, -rho * rho))
    return fma(along, cx, -across * cy), fma(along, cy, across * cx), s * big_z, closure


@_compiled
def _numbers(leg: FloatArray) -> _Leg:
    """The seven numbers of a leg as a tuple."""
    return leg[0], leg[1], leg[2], leg[3], leg[4], leg[5], leg[6]


@_compiled
def _newton_step(legs: FloatArray, points: FloatArray, position: FloatArray, squared: FloatArray) -> None:
    """One Newton step of all points on the three closures, in place; the squared step lengths go to `squared`."""
    first, second, third = _numbers(legs[0]), _numbers(legs[1]), _numbers(legs[2])
    cosine, sine, n = points[_COSINE], points[_SINE], squared.size
    for j in range(n):
        x, y, z = position[j], position[n + j], position[2 * n + j]
        a0, a1, a2, ha = _closure(first, x, y, z, cosine[j], sine[j])
        b0, b1, b2, hb = _closure(second, x, y, z, cosine[n + j], sine[n + j])
        c0, c1, c2, hc = _closure(third, x, y, z, cosine[2 * n + j], sine[2 * n + j])
        m0, m1, m2 = fma(b1, c2, -b2 * c1), fma(b2, c0, -b0 * c2), fma(b0, c1, -b1 * c0)
        scale = -0.5 / fma(a0, m0, fma(a1, m1, a2 * m2))
        dx = scale * fma(ha, m0, fma(hb, fma(a2, c1, -a1 * c2), hc * fma(a1, b2, -a2 * b1)))
        dy = scale * fma(ha, m1, fma(hb, fma(a0, c2, -a2 * c0), hc * fma(a2, b0, -a0 * b2)))
        dz = scale * fma(ha, m2, fma(hb, fma(a1, c0, -a0 * c1), hc * fma(a0, b1, -a1 * b0)))
        position[j] = x + dx
        position[n + j] = y + dy
        position[2 * n + j] = z + dz
        squared[j] = fma(dx, dx, fma(dy, dy, dz * dz))


@_compiled
def _start(legs: FloatArray, deviation: FloatArray, points: FloatArray, own: FloatArray, position: FloatArray) -> None:
    """Numbers of the legs (3, 7) as `_closure` needs them, and positions (3 n,) linear in the deviation (p,)."""
    for leg in range(3):
        for c in range(7):
            own[leg, c] = legs[leg, c, 0]
            for q in range(deviation.size):
                own[leg, c] += legs[leg, c, 1 + q] * deviation[q]
        angle, arm = own[leg, 0], own[leg, 1]
        own[leg, 0], own[leg, 1], own[leg, 3] = arm * np.cos(angle), arm * np.sin(angle), own[leg, 3] * own[leg, 3]
    # two parameters at once: half the passes over the positions
    odd = deviation.size % 2
    for j in range(position.size):
        position[j] = fma(deviation[0], points[_SLOPE, j], points[_START, j]) if odd else points[_START, j]
    for q in range(odd, deviation.size, 2):
        for j in range(position.size):
            first = fma(deviation[q], points[_SLOPE + q, j], position[j])
            position[j] = fma(deviation[q + 1], points[_SLOPE + q + 1, j], first)


def _mean_distance(deviations: FloatArray, legs: FloatArray, points: FloatArray, values: FloatArray) -> None:
    """Paper A, eq. (11) in mm for deviations (m, p), written to values (m,); inf where a point left the reach."""
    n = points.shape[1] // 3
    own, position, work, measured = np.empty((3, 7)), np.empty(3 * n), np.empty(n), points[_MEASURED]
    for k in range(values.size):
        _start(legs, deviations[k], points, own, position)
        step, going = 0, True
        while going and step < _MOST_STEPS:
            _newton_step(own, points, position, work)
            going, step = step == 0, step + 1
            for j in range(n):
                # a NaN has left the reach and stays NaN; it must not keep the others iterating
                going |= work[j] > _LAST_STEP_SQUARED
        for j in range(n):
            dx = position[j] - measured[j]
            dy = position[n + j] - measured[n + j]
            dz = position[2 * n + j] - measured[2 * n + j]
            work[j] = np.sqrt(fma(dx, dx, fma(dy, dy, dz * dz)))
        total = 0.0
        for j in range(n):
            total += work[j]
        values[k] = total / n if not going and np.isfinite(total) else np.inf
