"""Compiled Newton of `rrru.kinematics.closure`, point by point, for any robot: its legs come as flat arrays.

With a chain's passive screws S and its closure error e, a bar's wrench w and its error, the platform's step T minimises

    sum over chains |T - S dp - e|^2 + sum over bars (w T - e)^2

A joint whose screw depends on those before it keeps its value. Before Newton begins, the links, twists and drives
between two passive joints are multiplied into one frame. A frame (4, 3) has its axes and its place as rows. Lengths in
mm, angles in rad; in screws and small twists lengths are counted in the arm.
"""

import numpy as np

from rrru.arrays import BoolArray, FloatArray, IntArray
from rrru.kinematics.typed_numba import njit

TOLERANCE_MM, MOST_STEPS = 1e-10, 60
# a step turns by less and moves by less than this
LONGEST_RAD, LONGEST_MM = 0.3, 150.0
CHARACTERISTIC_LENGTH_MM = 500.0
# share of a squared screw that must be independent of the directions before it
_INDEPENDENT_SHARE = 1e-13

Triple = FloatArray | tuple[float, float, float]
# see `rrru.kinematics.closure.tables`
Tables = tuple[IntArray, FloatArray, FloatArray, IntArray, FloatArray, FloatArray, IntArray, BoolArray]

# called by compiled code only
_part = njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)
# part of its one caller before that is compiled; it would be compiled twice otherwise
_inside = njit(inline="always", error_model="numpy")


@_part
def _cross(a: Triple, b: Triple) -> tuple[float, float, float]:
    """Cross product of two triples."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@_part
def _triple(row: FloatArray) -> tuple[float, float, float]:
    """A row (3,) as three numbers."""
    return row[0], row[1], row[2]


@_part
def _dot(a: FloatArray, b: FloatArray) -> float:
    """Product of two rows (6,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]


@_part
def _carried(frame: FloatArray, vector: FloatArray) -> tuple[float, float, float]:
    """A vector (3,) of a frame, in space."""
    x, y, z = vector[0], vector[1], vector[2]
    a, b, c = _triple(frame[0]), _triple(frame[1]), _triple(frame[2])
    return x * a[0] + y * b[0] + z * c[0], x * a[1] + y * b[1] + z * c[1], x * a[2] + y * b[2] + z * c[2]


@_part
def _begin(frame: FloatArray) -> None:
    """A frame becomes the world's."""
    for i in range(4):
        for c in range(3):
            frame[i, c] = 1.0 if i == c else 0.0


@_part
def _append(frame: FloatArray, part: FloatArray) -> None:
    """A frame moved on by a part, a frame in it."""
    for c in range(3):
        x, y, z, place = frame[0, c], frame[1, c], frame[2, c], frame[3, c]
        for i in range(4):
            frame[i, c] = part[i, 0] * x + part[i, 1] * y + part[i, 2] * z
        frame[3, c] += place


@_part
def _rotate(frame: FloatArray, w: Triple) -> None:
    """A frame's axes turned about its place by a rotation vector in space (Rodrigues)."""
    angle = np.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    if angle == 0.0:
        return
    first, second = np.sin(angle) / angle, 2.0 * (np.sin(0.5 * angle) / angle) ** 2
    for i in range(3):
        once = _cross(w, _triple(frame[i]))
        twice = _cross(w, once)
        for c in range(3):
            frame[i, c] += first * once[c] + second * twice[c]


@_part
def _displace(
    frame: FloatArray, twist: FloatArray, factor: float
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """A frame moved by a multiple of a twist (6,) in it, shift first; returns the twist's two vectors in space."""
    v, w = _carried(frame, twist[:3]), _carried(frame, twist[3:])
    for c in range(3):
        frame[3, c] += factor * v[c]
    _rotate(frame, (factor * w[0], factor * w[1], factor * w[2]))
    return v, w


@_part
def _draw_together(
    slots: IntArray,
    frames: FloatArray,
    motions: FloatArray,
    drives: FloatArray,
    twists: FloatArray,
    active: BoolArray,
    links: FloatArray,
) -> None:
    """Links of one point: frames leg by leg from the base to the first passive joint, and so on to the leg's end."""
    row = 0
    for k in range(len(links)):
        _begin(links[k])
    for slot in range(len(slots)):
        link = links[row]
        _append(link, frames[slot])
        site, drive = slots[slot, 0], slots[slot, 1]
        if site >= 0 and active[site]:
            _displace(link, twists[site], 1.0)
        if drive >= 0:
            _displace(link, motions[slot], drives[drive])
        row += slots[slot, 2]


@_part
def _chain(
    links: FloatArray,
    screws: FloatArray,
    values: FloatArray,
    numbers: IntArray,
    platform: FloatArray,
    frame: FloatArray,
    basis: FloatArray,
    lack: FloatArray,
) -> None:
    """A chain walked to its end: its joints' screws (q, 6) in space and the small twist from the platform to there."""
    _begin(frame)
    for j in range(len(numbers)):
        _append(frame, links[j])
        v, w = _displace(frame, screws[j], values[numbers[j]])
        moment = _cross(_triple(frame[3]), w)
        for c in range(3):
            basis[j, c], basis[j, 3 + c] = (
                screws[j, 6] * (moment[c] + v[c]) / CHARACTERISTIC_LENGTH_MM,
                screws[j, 6] * w[c],
            )
    _append(frame, links[len(numbers)])
    x = y = z = 0.0
    for i in range(3):
        turn = _cross(_triple(platform[i]), _triple(frame[i]))
        x, y, z = x + 0.5 * turn[0], y + 0.5 * turn[1], z + 0.5 * turn[2]
    along = _cross((x, y, z), _triple(platform[3]))
    for c in range(3):
        lack[c] = (frame[3, c] - platform[3, c] - along[c]) / CHARACTERISTIC_LENGTH_MM
    lack[3], lack[4], lack[5] = x, y, z


@_part
def _count_chain(equations: FloatArray, k: int, basis: FloatArray, lack: FloatArray, numbers: IntArray) -> None:
    """A chain's square added to the equations."""
    for c in range(6):
        equations[k + c, k + c] += 1.0
        equations[k + c, k + 6] += lack[c]
    for j in range(len(numbers)):
        for c in range(6):
            equations[numbers[j], k + c] -= basis[j, c]
        for i in range(j, len(numbers)):
            equations[numbers[j], numbers[i]] += _dot(basis[j], basis[i])
        equations[numbers[j], k + 6] -= _dot(basis[j], lack)


@_part
def _count_bar(
    equations: FloatArray,
    k: int,
    bar: FloatArray,
    near: FloatArray,
    platform: FloatArray,
    off: FloatArray,
    change: float,
) -> float:
    """A bar's square added to the equations, from near to a point that is off; returns what its length lacks."""
    p, q, a, b = _carried(platform, bar[1:]), _carried(platform, off), _triple(platform[3]), _triple(near)
    x, y, z = a[0] + p[0] - q[0] - b[0], a[1] + p[1] - q[1] - b[1], a[2] + p[2] - q[2] - b[2]
    length = np.sqrt(x * x + y * y + z * z)
    x, y, z = x / length, y / length, z / length
    moment, lack = _cross(b, (x, y, z)), bar[0] + change - length
    wrench = (
        x,
        y,
        z,
        moment[0] / CHARACTERISTIC_LENGTH_MM,
        moment[1] / CHARACTERISTIC_LENGTH_MM,
        moment[2] / CHARACTERISTIC_LENGTH_MM,
    )
    # where bars contradict each other they share a load as their elasticity by length does
    for i in range(6):
        stiff = wrench[i] * CHARACTERISTIC_LENGTH_MM / length
        for c in range(i, 6):
            equations[k + i, k + c] += stiff * wrench[c]
        equations[k + i, k + 6] += stiff * lack / CHARACTERISTIC_LENGTH_MM
    return lack


@_part
def _resolve(equations: FloatArray) -> None:
    """The solution of n equations (n, n + 2), the upper half of a symmetric matrix, into column n (Gauss)."""
    n = len(equations)
    for j in range(n):
        equations[j, n + 1] = equations[j, j]
    for j in range(n):
        row = equations[j]
        row[n + 1] = 0.0 if row[j] <= _INDEPENDENT_SHARE * row[n + 1] else 1.0 / row[j]
        for i in range(j + 1, n):
            part = row[n + 1] * row[i]
            if part != 0.0:
                for c in range(i, n + 1):
                    equations[i, c] -= part * row[c]
    for j in range(n - 1, -1, -1):
        for c in range(j + 1, n):
            equations[j, n] -= equations[j, c] * equations[c, n]
        equations[j, n] *= equations[j, n + 1]


@_part
def _advance(platform: FloatArray, values: FloatArray, turning: BoolArray, step: FloatArray) -> float:
    """The platform and the passive joints moved by a step (k + 6,), or by a share of it; returns its size in mm."""
    k, turned, slid, moved = len(values), 0.0, 0.0, 0.0
    for j in range(k):
        if turning[j]:
            turned = max(turned, abs(step[j]))
        else:
            slid = max(slid, abs(step[j]))
    w = step[k + 3], step[k + 4], step[k + 5]
    turned = max(turned, np.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]))
    along = _cross(w, _triple(platform[3]))
    for c in range(3):
        step[k + c] = CHARACTERISTIC_LENGTH_MM * step[k + c] + along[c]
        moved += step[k + c] * step[k + c]
    moved = np.sqrt(moved)
    share = min(1.0, LONGEST_MM / moved, LONGEST_RAD / turned)
    for c in range(3):
        platform[3, c] += share * step[k + c]
    _rotate(platform, (share * w[0], share * w[1], share * w[2]))
    for j in range(k):
        values[j] += share * step[j]
    # not a number where the platform's motion is none
    return moved + max(0.0, CHARACTERISTIC_LENGTH_MM * turned - moved, slid - moved)


@_inside
def _newton(
    ends: IntArray,
    bars: FloatArray,
    screws: FloatArray,
    numbers: IntArray,
    turning: BoolArray,
    drives: FloatArray,
    twists: FloatArray,
    links: FloatArray,
    state: tuple[FloatArray, FloatArray, FloatArray],
    work: tuple[FloatArray, FloatArray, FloatArray],
) -> float:
    """Newton of one point, in place; returns the size of its last step in mm."""
    (platform, values, lacks), (frame, basis, equations) = state, work
    k, size = len(turning), np.inf
    for _ in range(MOST_STEPS):
        equations[:] = 0.0
        for leg in range(len(ends)):
            link, first, last = ends[leg, 0], ends[leg, 1], ends[leg, 2]
            if ends[leg, 3]:
                drive, bar, end = ends[leg, 4], ends[leg, 5], ends[leg, 6]
                change = twists[bar, 0] + (drives[drive] if drive >= 0 else 0.0)
                lacks[leg, 0] = _count_bar(equations, k, bars[leg], links[link, 3], platform, twists[end], change)
            else:
                own, lack, joints = basis[first:last], lacks[leg], numbers[first:last]
                _chain(links[link:], screws[first:last], values, joints, platform, frame, own, lack)
                _count_chain(equations, k, own, lack, joints)
        _resolve(equations)
        size = _advance(platform, values, turning, equations[:, k + 6])
        if not size >= TOLERANCE_MM:
            break
    return size


# no fastmath: code that was just compiled and the same code from the cache round alike
@njit(cache=True, error_model="numpy")
def solve(
    tables: Tables,
    room: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    drives: FloatArray,
    twists: FloatArray,
    active: BoolArray,
    platform: FloatArray,
    passive: FloatArray,
    sizes: FloatArray,
    lacks: FloatArray,
) -> None:
    """Poses of n points, in place of where they start, under twists (n or 1, sites, 6) at the active sites (sites,).

    tables, room: of `rrru.kinematics.closure`; drives (n, K); platform (n, 4, 3): frames; passive (n, k). Writes
    the sizes (n,) of the last steps in mm, angles counted at the arm, and the legs' closure errors before, lacks (n,
    legs, 6): a bar's length first, a chain's twist. Points without a pose keep arbitrary values.
    """
    slots, frames, motions, ends, bars, screws, numbers, turning = tables
    links, work = room[0], room[1:]
    for n in range(len(platform)):
        own, drive = twists[n % len(twists)], drives[n]
        _draw_together(slots, frames, motions, drive, own, active, links)
        for leg in range(len(ends)):
            if ends[leg, 1] == ends[leg, 2] and not ends[leg, 3]:
                # where a leg ends whose joints are all driven
                platform[n] = links[ends[leg, 0]]
        state = platform[n], passive[n], lacks[n]
        sizes[n] = _newton(ends, bars, screws, numbers, turning, drive, own, links, state, work)
