"""Compiled: forward kinematics of a leg, the bar that ends it, and the sweep over sites, point by point.

Numba's cache does not see other files; so all functions that these call are here. Lengths in mm, angles in rad.
"""

import numpy as np

from rrru.arrays import BoolArray, FloatArray, IntArray
from rrru.kinematics.typed_numba import njit

Triple = FloatArray | tuple[float, float, float]

# called by compiled code only
_part = njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)


@_part
def _cross(a: Triple, b: Triple) -> tuple[float, float, float]:
    """Cross product of two triples."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@_part
def _carried(turn: FloatArray, vector: Triple) -> tuple[float, float, float]:
    """A vector (3,) of a frame in space."""
    x, y, z = vector[0], vector[1], vector[2]
    return (
        turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z,
        turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z,
        turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z,
    )


@_part
def _back(turn: FloatArray, vector: Triple) -> tuple[float, float, float]:
    """A vector (3,) in space in a frame."""
    x, y, z = vector[0], vector[1], vector[2]
    return (
        turn[0, 0] * x + turn[1, 0] * y + turn[2, 0] * z,
        turn[0, 1] * x + turn[1, 1] * y + turn[2, 1] * z,
        turn[0, 2] * x + turn[1, 2] * y + turn[2, 2] * z,
    )


@_part
def _shift(place: FloatArray, turn: FloatArray, vector: Triple, factor: float) -> None:
    """A place moved by a multiple of a vector (3,) of a frame."""
    by = _carried(turn, vector)
    for c in range(3):
        place[c] += factor * by[c]


@_part
def _append(turn: FloatArray, more: FloatArray) -> None:
    """A frame turned by another in it, whose axes are the rows of (3, 3)."""
    for row in turn:
        row[0], row[1], row[2] = _carried(more, row)


@_part
def _rotate(turn: FloatArray, vector: Triple, factor: float) -> None:
    """A frame turned by a multiple of a rotation vector (3,) in it (Rodrigues)."""
    w = factor * vector[0], factor * vector[1], factor * vector[2]
    angle = np.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    if angle == 0.0:
        return
    first, second = np.sin(angle) / angle, 2.0 * (np.sin(0.5 * angle) / angle) ** 2
    for row in turn:
        # a row times the matrix of a cross product is the row crossed with the vector
        once = _cross(row, w)
        twice = _cross(once, w)
        for c in range(3):
            row[c] += first * once[c] + second * twice[c]


@njit(cache=True, error_model="numpy")
def follow(
    frames: FloatArray,
    motions: FloatArray,
    numbers: IntArray,
    values: FloatArray,
    twists: FloatArray,
    active: BoolArray,
    turns: FloatArray,
    places: FloatArray,
    axes: FloatArray,
) -> None:
    """Frames at the joints of a leg and at its end at n points, from the base on, into turns, places and axes.

    frames, motions, numbers: of `rrru.kinematics.legs.Chain`; values (n, k + D): passive and driven ones; twists (n or
    1, sites, 6) at the active sites (sites,). turns (J + 1, n, 3, 3): before the seat's own twist; places (J + 1, n, 3)
    and axes (J, n, 3): after it.
    """
    turn, place = np.empty((3, 3)), np.empty(3)
    for n in range(len(values)):
        turn[:], place[:] = np.eye(3), 0.0
        for j in range(len(motions)):
            _shift(place, turn, frames[j, 3], 1.0)
            _append(turn, frames[j, :3])
            turns[j, n] = turn
            site, column = numbers[j, 0], numbers[j, 1]
            if active[site]:
                twist = twists[n % len(twists), site]
                _shift(place, turn, twist[:3], 1.0)
                _rotate(turn, twist[3:], 1.0)
            v, w = _carried(turn, motions[j, :3]), _carried(turn, motions[j, 3:])
            places[j, n] = place
            for c in range(3):
                axes[j, n, c] = v[c] + w[c]
            if column >= 0:
                _shift(place, turn, motions[j, :3], values[n, column])
                _rotate(turn, motions[j, 3:], values[n, column])
        _append(turn, frames[-1, :3])
        turns[-1, n], places[-1, n] = turn, place


@njit(cache=True, error_model="numpy")
def reach(
    near: FloatArray,
    position: FloatArray,
    turn: FloatArray,
    point: FloatArray,
    far: FloatArray,
    frames: FloatArray,
    spans: FloatArray,
) -> None:
    """Bars from near (n, 3) to points (n or 1, 3) of platforms at position (n, 3) and turn (n, 3, 3).

    Writes their far ends (n, 3), spans (n,) and right-handed frames (n, 3, 3), whose first column points along them and
    whose second one is square to the axis of space to which they are squarest.
    """
    for n in range(len(near)):
        far[n] = position[n]
        _shift(far[n], turn[n], point[n % len(point)], 1.0)
        x, y, z = far[n, 0] - near[n, 0], far[n, 1] - near[n, 1], far[n, 2] - near[n, 2]
        span = np.sqrt(x * x + y * y + z * z)
        along = x / span, y / span, z / span
        sizes = abs(along[0]), abs(along[1]), abs(along[2])
        least = 0 if sizes[0] <= min(sizes[1], sizes[2]) else 1 if sizes[1] <= sizes[2] else 2
        side = _cross((1.0 if least == 0 else 0.0, 1.0 if least == 1 else 0.0, 1.0 if least == 2 else 0.0), along)
        size = np.sqrt(side[0] * side[0] + side[1] * side[1] + side[2] * side[2])
        side = side[0] / size, side[1] / size, side[2] / size
        up, spans[n] = _cross(along, side), span
        for c in range(3):
            frames[n, c, 0], frames[n, c, 1], frames[n, c, 2] = along[c], side[c], up[c]


@njit(cache=True, error_model="numpy")
def sweep(
    motion: FloatArray,
    legs: IntArray,
    numbers: IntArray,
    turns: FloatArray,
    places: FloatArray,
    twists: FloatArray,
    result: FloatArray,
) -> None:
    """Motion per small twist at sites of legs, in their frames, into result (n, 3, S, 6).

    motion (legs, n, 3, 6): per unit of the six parts of a twist of a leg's end at the world's origin; legs, numbers
    (S,): of each site; turns (S, n, 3, 3) and places (S, n, 3): of its frame; twists (n or 1, sites, 6): the finite
    ones, whose rotation vectors the small ones add to.
    """
    for s in range(len(legs)):
        for n in range(motion.shape[1]):
            turn, place, w = turns[s, n], places[s, n], twists[n % len(twists), numbers[s], 3:]
            angle = np.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
            first, second = _added(angle)
            for a in range(3):
                row, own = motion[legs[s], n, a], result[n, a, s]
                own[0], own[1], own[2] = _back(turn, row)
                lever = _cross(row, place)
                about = _back(turn, (row[3] + lever[0], row[4] + lever[1], row[5] + lever[2]))
                once = _cross(about, w)
                twice = _cross(once, w)
                for c in range(3):
                    own[3 + c] = about[c] + first * once[c] + second * twice[c]


@_part
def _added(angle: float) -> tuple[float, float]:
    """Factors of the first and second power of a rotation vector in the axes about which what is added to it turns."""
    if angle < 1e-4:
        return 0.5, 1.0 / 6.0
    return (1.0 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
