"""Compiled parts of a candidate's simulation on eq. (8), where the platform does not turn: see `twin_search`.

legs (3, 5) are the numbers of the legs as in `rrru.robots.rrru3`, turn (2, 3) the azimuths' cosines and sines. Lengths
mm, angles rad.
"""

import numpy as np

from rrru.kinematics.typed_numba import njit

_compiled = njit(cache=True, error_model="numpy")


@_compiled
def inverse(position, legs, turn):
    """Drive angles (n, 3) of positions (n, 3), elbow out; NaN out of the reach (eqs. 5, 6)."""
    result = np.empty((len(position), 3))
    for n in range(len(position)):
        x, y, z = position[n, 0], position[n, 1], position[n, 2]
        for k in range(3):
            arm, offset, forearm = legs[k, 1], legs[k, 2], legs[k, 3]
            reach, v = turn[0, k] * x + turn[1, k] * y + legs[k, 4], turn[0, k] * y - turn[1, k] * x
            rho, square = offset + np.sqrt(forearm * forearm - v * v), reach * reach + z * z
            cosine = (arm * arm + square - rho * rho) / (2.0 * arm * np.sqrt(square))
            result[n, k] = np.arctan2(z, reach) - np.arccos(cosine) - legs[k, 0]
    return result


@_compiled
def gradients(position, theta, legs, turn):
    """Half the derivatives of the closures (eq. 8) by the position (n, 3, 3) and by the legs' numbers (n, 3, 5)."""
    by_position, by_leg = np.empty((len(position), 3, 3)), np.empty((len(position), 3, 5))
    for n in range(len(position)):
        x, y, z = position[n, 0], position[n, 1], position[n, 2]
        for k in range(3):
            cx, cy, angle, arm, forearm = turn[0, k], turn[1, k], theta[n, k] + legs[k, 0], legs[k, 1], legs[k, 3]
            v, cosine, sine = cx * y - cy * x, np.cos(angle), np.sin(angle)
            s = np.sqrt(forearm * forearm - v * v)
            rho, big_x, big_z = legs[k, 2] + s, cx * x + cy * y + legs[k, 4] - arm * cosine, z - arm * sine
            side = rho * v / s
            by_position[n, k] = big_x * cx - side * cy, big_x * cy + side * cx, big_z
            by_leg[n, k] = (
                arm * (big_x * sine - big_z * cosine),
                -(big_x * cosine + big_z * sine),
                -rho,
                -rho * forearm / s,
                big_x,
            )
    return by_position, by_leg


@_compiled
def _inverted(m):
    """Inverse of a matrix (3, 3)."""
    result = np.empty((3, 3))
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        for k in range(3):
            p, q = (k + 1) % 3, (k + 2) % 3
            result[a, k] = m[p, b] * m[q, c] - m[p, c] * m[q, b]
    return result / (m[0, 0] * result[0, 0] + m[0, 1] * result[1, 0] + m[0, 2] * result[2, 0])


@_compiled
def parameter_jacobian(position, theta, legs, turn, leg_map):
    """Derivatives (n, 3, p) of the position by parameters that change the legs' numbers by leg_map (3, 5, p)."""
    by_position, by_leg = gradients(position, theta, legs, turn)
    result = np.zeros((len(position), 3, leg_map.shape[2]))
    for n in range(len(position)):
        inverted = _inverted(by_position[n])
        for k in range(3):
            for p in range(leg_map.shape[2]):
                change = 0.0
                for c in range(5):
                    change -= by_leg[n, k, c] * leg_map[k, c, p]
                for a in range(3):
                    result[n, a, p] += inverted[a, k] * change
    return result


@_compiled
def clearance_shift(position, theta, legs, turn, load, clearance):
    """Shifts (n, 3) of the platform by clearances (3,) to first order under loads (n, 3) on it, and the smaller of
    both singularity measures (n,), see `rrru.kinematics.singularity`.

    Every leg's pin is on the side of its bore towards which the leg pushes, see `rrru.effects.joint_clearance`.
    """
    along, _ = gradients(position, theta, legs, turn)
    shift, measure, about = np.empty((len(position), 3)), np.empty(len(position)), np.empty((3, 3))
    for n in range(len(position)):
        for k in range(3):
            x, y, z = along[n, k]
            outward = turn[0, k] * x + turn[1, k] * y
            # the constraint moment is the part of the gradient in the leg's plane
            about[k] = turn[0, k] * outward, turn[1, k] * outward, z
            about[k] /= np.sqrt(outward * outward + z * z)
            along[n, k] /= np.sqrt(x * x + y * y + z * z)
        inverted = _inverted(along[n])
        shift[n] = inverted @ (np.sign(inverted.T @ load[n]) * clearance)
        measure[n] = min(_least_singular_value(along[n]), _least_singular_value(about))
    return shift, measure


@_compiled
def _least_singular_value(rows):
    """Smallest singular value of three unit rows (3, 3).

    Their product with their transpose has ones on its diagonal, so that its eigenvalues less 1 are the roots of
    x^3 - (a^2 + b^2 + c^2) x - 2 a b c for the three scalar products of the rows.
    """
    a, b, c = (rows[0] * rows[1]).sum(), (rows[1] * rows[2]).sum(), (rows[2] * rows[0]).sum()
    size = np.sqrt((a * a + b * b + c * c) / 3.0)
    if size == 0.0:
        return 1.0
    third = np.arccos(min(max(a * b * c / size**3, -1.0), 1.0)) / 3.0
    return np.sqrt(max(1.0 + 2.0 * size * np.cos(third + 2.0 * np.pi / 3.0), 0.0))


@_compiled
def backlash(path, smooth, width):
    """Lost motion (N, 3) of drives along a path (N, 3) under widths (3,): see `rrru.effects.backlash`.

    Where the path is smooth (N,) and a drive turns back between two points, its extreme is that of the parabola through
    three points.
    """
    result = np.empty_like(path)
    for leg in range(path.shape[1]):
        half, held = 0.5 * width[leg], path[0, leg]
        for k in range(len(path)):
            now = extreme = path[k, leg]
            early = False
            if smooth[k]:
                before, after = now - path[k - 1, leg], path[k + 1, leg] - now
                if before * after < 0.0:
                    extreme = now - (before + after) ** 2 / (8.0 * (after - before))
                    early = abs(before) < abs(after)
            if early:
                held = min(max(held, extreme - half), extreme + half)
            held = min(max(held, now - half), now + half)
            result[k, leg] = held - now
            if not early:
                held = min(max(held, extreme - half), extreme + half)
    return result


@_compiled
def lines_and_curve(start, end, offsets, counts, curve, steps):
    """Path (N, 3) along parallel lines from start (3,) to end (3,) at offsets (k,) in y, then along curve (m, 3), the
    rows (n,) of its points, and where it has no corner (N,).

    counts: points of a line and of the curve; steps of the path between two points. Straight transfers between them
    have twice the points of a step, as in `rrru.campaign.plan.connect`.
    """
    line, transfer = (counts[0] - 1) * steps + 1, 2 * steps - 2
    path = np.empty((len(offsets) * (line + transfer) + len(curve), 3))
    rows = np.empty(len(offsets) * counts[0] + counts[1], np.int64)
    smooth = np.ones(len(path), np.bool_)
    smooth[0], smooth[-1] = False, False
    for k in range(len(offsets)):
        first = k * (line + transfer)
        for n in range(line):
            path[first + n] = start + n / (line - 1.0) * (end - start)
            path[first + n, 1] += offsets[k]
        for n in range(counts[0]):
            rows[k * counts[0] + n] = first + n * steps
    for n in range(len(curve)):
        path[len(offsets) * (line + transfer) + n] = curve[n]
    for n in range(counts[1]):
        rows[len(offsets) * counts[0] + n] = len(offsets) * (line + transfer) + n * steps
    for k in range(len(offsets)):
        after = (k + 1) * (line + transfer)
        for n in range(transfer):
            share = (n + 1.0) / (transfer + 1.0)
            path[after - transfer + n] = path[after - transfer - 1] + share * (path[after] - path[after - transfer - 1])
        smooth[after - transfer - 1], smooth[after] = False, False
    return path, rows, smooth
