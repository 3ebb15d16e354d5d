"""Gross errors of the instrument, found before a model is fitted. Lengths in mm.

A broken beam is found by comparing each point with its neighbours along the run. A backlash at reversal gives a step, a
geometric error a smooth curve, a drive a ripple, joint clearance steps back and forth: all of these are the robot's. A
broken beam gives one to three points that fit neither side.

Readings of a wrong reflector are found by distances on one body, without kinematics. Reflectors on the tool keep their
distances from each other, whatever the robot does; those on the table keep their places in the instrument's frame. A
reflector that is off from most others of its body was confused with another one, or was never there. Of two that
disagree it is unknown which one is right: both are marked.
"""

from collections.abc import Callable, Iterable, Iterator
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.spatial.transform import Rotation

from rrru.campaign.driven_path import follows_path
from rrru.campaign.ingest.checks import path_length
from rrru.campaign.measurements import command, measured, series, turns
from rrru.campaign.outliers import MAX_ROBUST_SDS, MEDIAN_OF_LENGTH, robust_sd, unless_many
from rrru.kinematics.legs import rigid_motions

# Most consecutive bad points that are looked for; the running median's window must hold more good points than bad.
_LONGEST = 3
_WINDOW = 2 * _LONGEST + 1
# how many scales of its neighbourhood a point must be off
_MIN_SCALES = 6.0
# ASSUME the robot's own single spikes stay below _MIN_SCALES x 0.1 mm; below _MIN_SCALES x 0.5 and x 0.75 mm where a
# loose joint that flips and flips back looks like bad points: blocks of two or three, and a run's ends.
_SPIKE_MM, _FLIP_MM, _END_MM = 0.1, 0.5, 0.75
# ASSUME at most one block of bad points among ten points: a run that jumps more often has a loose joint, and twice its
# usual jump is allowed, up to _MIN_SCALES x 1.5 mm: no joint is looser.
_BAD_SHARE, _JUMP_FACTOR, _LOOSEST_MM = 0.1, 2.0, 1.5
# A bad end point pulls at its neighbour by a third, a bad neighbour at the end by as much as it is off itself.
_END_PREFERENCE = 1.5

# a deviation of which less than this remains with errors of the geometry is made by them
_EXPLAINED = 0.5
# parameters of a rigid motion; numbers that a fit of the geometry must have to spare
_RIGID, _LEAST_SPARE = 6, 20
# distance of a block of points, its limit, and the indices of its points
_Block: TypeAlias = tuple[float, float, np.ndarray]

# ASSUME the same deviations at a place in two runs differ by less
_REPEATS_MM = 0.6

# ASSUME no body bends by a millimetre, and reflectors are further apart than that
_FAR_MM = 1.0
# a body on which more than this share is off is not rigid: its reflectors move against each other
_MAX_SHARE = 0.2


def outliers(frame: pd.DataFrame, digit_mm: float, jacobian: Callable[[], np.ndarray]) -> np.ndarray:
    """Rows (n,) that a broken beam spoilt, positions being in the robot frame.

    digit_mm: last digit of the file; jacobian: makes the derivative (n, 3, p) of the commanded positions by the
    geometry. It is made only for stops in no order: there a broken beam is twice as far off as all other readings.
    """
    return _spoilt(measured(frame) - command(frame), frame, digit_mm, jacobian)


def turned_outliers(frame: pd.DataFrame, length_mm: float, jacobian: Callable[[], np.ndarray]) -> np.ndarray:
    """Rows (n,) whose orientation was taken wrong, as a camera does that sees a marker from the front.

    frame: with orientations, commanded and measured, in the robot's frame; length_mm: at which an angle counts as the
    way of a point there; jacobian: makes the derivative (n, 3, p) of these ways by the geometry. The deviations of
    orientations are then judged as those of positions are.
    """
    off = np.full((len(frame), 3), np.nan)
    seen, commanded = turns(frame, "measured"), turns(frame, "command")
    known = np.isfinite(seen + commanded).all(axis=(1, 2))
    off[known] = Rotation.from_matrix(seen[known] @ commanded[known].transpose(0, 2, 1)).as_rotvec()
    return _spoilt(length_mm * off, frame, 0.0, jacobian)


def _spoilt(
    deviation: np.ndarray, frame: pd.DataFrame, digit_mm: float, jacobian: Callable[[], np.ndarray]
) -> np.ndarray:
    """Rows (n,) whose deviations (n, 3) in mm are no robot's, other arguments as of `outliers`."""
    target, run = command(frame), series(frame)
    marked = flag_outliers(deviation, run, noise_mm=digit_mm, place=path_length(target))
    if marked.any() and not follows_path(target, run):
        derivative = jacobian()
        marked &= far_from_all(deviation, run, derivative, marked)
        marked &= ~like_geometry(deviation, target, derivative, marked)
    return np.asarray(marked & ~reproduced(marked, deviation, target, run))


def jumps(frame: pd.DataFrame, digit_mm: float) -> np.ndarray:
    """Rows (n,) that jump off their neighbours in runs where too many do for `outliers`; arguments as there."""
    target, run = command(frame), series(frame)
    deviation = measured(frame) - target
    found = frequent_jumps(deviation, run, noise_mm=digit_mm)
    return np.asarray(found & ~reproduced(found, deviation, target, run))


def flag_outliers(
    deviation_mm: npt.ArrayLike,
    run: npt.ArrayLike,
    noise_mm: float = 0.0,
    place: npt.ArrayLike | None = None,
) -> np.ndarray:
    """Mark (n,) of the points that do not fit their neighbours in the run; rows in the order driven.

    deviation_mm: measured minus commanded position (n, 3) in mm; rows with a NaN are left out and not marked.
    run: number of the run (n,). noise_mm: the instrument's noise, one sigma per axis, 0 where it is unknown.
    place: where the points lie along their run (n,), growing; None takes them as equally spaced.

    A block of one to three points is marked where each of its points lies off the curve through the two points before
    and the two after the block, and off the running median of seven points, which follows steps. A block at a run's end
    is marked where it is off all predictions from the next three points. Runs with fewer than seven points are not
    judged. Raises ValueError for arguments of the wrong shape.
    """
    deviation, run = np.asarray(deviation_mm, dtype=float), np.asarray(run)
    if deviation.ndim != 2 or deviation.shape[1] != 3 or run.shape != deviation.shape[:1]:
        raise ValueError(f"expected deviations (n, 3) and runs (n,), got {deviation.shape} and {run.shape}")
    place = np.arange(len(deviation), dtype=float) if place is None else np.asarray(place, dtype=float)
    marked = np.zeros(len(deviation), dtype=bool)
    for rows in _runs(deviation, run):
        marked[rows[_bad_points(place[rows], deviation[rows], noise_mm)]] = True
    return marked


def frequent_jumps(deviation_mm: npt.ArrayLike, run: npt.ArrayLike, noise_mm: float = 0.0) -> np.ndarray:
    """Points (n,) off the running median of seven in runs where more than a tenth of the points are, ends apart.

    Arguments as of `flag_outliers`, which marks few of them or none: a loose joint jumps so often. So does an
    instrument whose beam breaks often; these data do not separate both.
    """
    deviation, run = np.asarray(deviation_mm, dtype=float), np.asarray(run)
    result = np.zeros(len(deviation), dtype=bool)
    for rows in _runs(deviation, run):
        if len(rows) > _WINDOW:
            # near the ends of a run there are no seven neighbours, and errors may grow fast
            rows, off = rows[_LONGEST:-_LONGEST], _off_median(deviation[rows])[_LONGEST:-_LONGEST]
            limit = _MIN_SCALES * robust_sd(off, MEDIAN_OF_LENGTH, max(noise_mm, _SPIKE_MM))
            result[rows] = (off > limit) & ((off > limit).mean() > _BAD_SHARE)
    return result


def far_from_all(
    deviation_mm: npt.ArrayLike, run: npt.ArrayLike, jacobian: np.ndarray, marked: np.ndarray
) -> np.ndarray:
    """Marked points (n,) that are many scales of their whole run off its median, and twice as far as all others.

    For runs whose points follow no path: there the robot's errors differ from one point to the next as much as among
    all of them. They are largest where a pose magnifies errors of the geometry, of drives among them, and a local error
    of a drive is that of several stops. So a deviation d counts by the size sqrt(d' (I + J J')^-1 d) of what makes it;
    jacobian (n, 3, p): derivative of the position, each parameter in units that move the points by 1 mm in the median.
    Other arguments as of `flag_outliers`.
    """
    deviation, run = np.asarray(deviation_mm, dtype=float), np.asarray(run)
    moved_mm = np.linalg.norm(np.nan_to_num(jacobian), axis=1)
    usual_mm = np.median(moved_mm, axis=0)
    scaled = np.nan_to_num(jacobian) / np.where(usual_mm > 0.0, usual_mm, np.inf)
    spread = np.eye(3) + scaled @ np.swapaxes(scaled, 1, 2)
    result = np.zeros(len(deviation), dtype=bool)
    for rows in _runs(deviation, run):
        off = deviation[rows] - np.median(deviation[rows], axis=0)
        size = np.sqrt(np.einsum("ni,nij,nj->n", off, np.linalg.inv(spread[rows]), off))
        floor = _SPIKE_MM / np.sqrt(1.0 + scaled.shape[2])
        loose = _JUMP_FACTOR * size[~marked[rows]].max(initial=0.0)
        result[rows] = (size > _MIN_SCALES * robust_sd(size, MEDIAN_OF_LENGTH, floor)) & (size > loose)
    return np.asarray(result & marked)


def like_geometry(
    deviation_mm: np.ndarray, command_mm: np.ndarray, jacobian: np.ndarray, marked: np.ndarray
) -> np.ndarray:
    """Which marked points (n,) have the deviation that errors of the geometry make there, at least half of it.

    Near a singularity a small error of the geometry moves the platform far. The errors are fitted by least squares to
    the deviations (n, 3) in mm of the other points, to first order, together with a rigid motion; jacobian (n, 3, p):
    derivative of the position by them. None where the other points do not determine the fit.
    """
    # unknown poses and readings: their deviation is compared with nothing
    known = np.isfinite(jacobian).all(axis=(1, 2)) & np.isfinite(deviation_mm).all(axis=1)
    fitted = known & ~marked
    if 3 * fitted.sum() < jacobian.shape[2] + _RIGID + _LEAST_SPARE:
        return np.zeros(len(marked), dtype=bool)
    columns = np.concatenate([jacobian, rigid_motions(command_mm - command_mm[fitted].mean(axis=0))], axis=2)
    # columns in different units; those of parameters without influence stay zero
    size = np.linalg.norm(columns[fitted], axis=(0, 1))
    columns = columns / np.where(size > 0.0, size, 1.0)
    errors = np.linalg.lstsq(columns[fitted].reshape(-1, len(size)), deviation_mm[fitted].ravel())[0]
    left = np.linalg.norm(deviation_mm - columns @ errors, axis=1)
    return np.asarray(marked & known & (left < _EXPLAINED * np.linalg.norm(deviation_mm, axis=1)))


def reproduced(
    marked: np.ndarray,
    deviation_mm: npt.ArrayLike,
    command_mm: npt.ArrayLike,
    run: npt.ArrayLike,
) -> np.ndarray:
    """Which marked points (n,) another run came back to: the robot repeats a spike near a singularity, a beam does not.

    Compares deviations (n, 3) in mm at the same commanded position (n, 3) in another run (n,); they repeat within
    0.6 mm.
    """
    deviation, command, run = np.asarray(deviation_mm), np.asarray(command_mm), np.asarray(run)
    result = np.zeros(len(deviation), dtype=bool)
    for i in np.flatnonzero(marked):
        repeats = (run != run[i]) & (np.abs(command - command[i]) < 1e-3).all(axis=1)
        result[i] = (np.linalg.norm(deviation[repeats] - deviation[i], axis=1) < _REPEATS_MM).any()
    return result


def _runs(deviation: np.ndarray, run: np.ndarray) -> Iterator[np.ndarray]:
    """Rows of each run (n,) whose deviations (n, 3) are known."""
    known = np.isfinite(deviation).all(axis=1)
    for number in np.unique(run[known]):
        yield np.flatnonzero(known & (run == number))


def _bad_points(place: np.ndarray, deviation: np.ndarray, noise_mm: float) -> np.ndarray:
    """Indices of the bad points of one run: the worst block first, then again without it, until none is left.

    A good point next to bad ones can be marked with them: each is put back once to see whether it fits the good ones.
    """

    def worst(rows: np.ndarray) -> np.ndarray | None:
        return _worst_block(place[rows], deviation[rows], noise_mm) if len(rows) >= _WINDOW else None

    good, bad = np.arange(len(deviation)), []
    while (block := worst(good)) is not None:
        bad.extend(good[block])
        good = np.delete(good, block)
    for row in sorted(bad) if len(good) >= _WINDOW else ():
        again = np.sort(np.append(good, row))
        good = again if worst(again) is None else good
    return np.setdiff1d(np.arange(len(deviation)), good)


def _worst_block(place: np.ndarray, deviation: np.ndarray, noise_mm: float) -> np.ndarray | None:
    """Indices of the block that is farthest off among those beyond their limits, or None."""
    jump = np.linalg.norm(np.diff(deviation, axis=0), axis=1)
    usual = np.sort(jump)[::-1][min(2 * max(1, round(_BAD_SHARE * len(place))), len(jump) - 1)]
    loose = min(_JUMP_FACTOR * usual, _MIN_SCALES * max(_LOOSEST_MM, noise_mm))

    def farthest(blocks: Iterable[_Block]) -> tuple[float, np.ndarray | None]:
        beyond = [(off, block) for off, limit, block in blocks if off > max(limit, loose)]
        return max(beyond, key=lambda one: one[0], default=(0.0, None))

    inner = farthest(_inner_blocks(place, deviation, noise_mm))
    end = farthest(_end_blocks(place, deviation, jump, noise_mm))
    return end[1] if end[0] > _END_PREFERENCE * inner[0] else inner[1]


def _inner_blocks(place: np.ndarray, deviation: np.ndarray, noise_mm: float) -> Iterator[_Block]:
    """Per length of block: the worst block's least distance from its neighbours' curve, its limit, its indices."""
    off_median = _off_median(deviation)
    for length in range(1, _LONGEST + 1):
        floor = max(noise_mm, _SPIKE_MM if length == 1 else _FLIP_MM)
        blocks = np.arange(1, len(place) - length)[:, None] + np.arange(length)
        nodes = np.stack([blocks[:, 0] - 2, blocks[:, 0] - 1, blocks[:, -1] + 1, blocks[:, -1] + 2])
        off = _off_curve(place, deviation, blocks, nodes)
        limit = _MIN_SCALES * robust_sd(off, MEDIAN_OF_LENGTH, floor)
        least = np.where(off_median[blocks].min(axis=1) > _MIN_SCALES * floor, off.min(axis=1), 0.0)
        yield least.max(), limit, blocks[np.argmax(least)]


def _off_median(deviation: np.ndarray) -> np.ndarray:
    """Distances (n,) of deviations (n, 3) of one run from their running median."""
    padded = np.pad(deviation, ((_LONGEST, _LONGEST), (0, 0)), mode="edge")
    median = np.median(np.lib.stride_tricks.sliding_window_view(padded, _WINDOW, axis=0), axis=-1)
    return np.asarray(np.linalg.norm(deviation - median, axis=1))


def _off_curve(place: np.ndarray, deviation: np.ndarray, blocks: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Distances (m, length) of blocks (m, length) from the polynomials through nodes (k, m) within the run."""
    there = (nodes >= 0) & (nodes < len(place))
    nodes = np.clip(nodes, 0, len(place) - 1)
    predicted = np.zeros((*blocks.shape, 3))
    for i in range(len(nodes)):
        weight = np.repeat(there[i].astype(float)[:, None], blocks.shape[1], axis=1)
        for j in set(range(len(nodes))) - {i}:
            both = there[i] & there[j]
            step = np.where(both, place[nodes[i]] - place[nodes[j]], 1.0)[:, None]
            weight *= np.where(both[:, None], (place[blocks] - place[nodes[j]][:, None]) / step, 1.0)
        predicted += weight[..., None] * deviation[nodes[i]][:, None]
    return np.asarray(np.linalg.norm(deviation[blocks] - predicted, axis=2))


def _end_blocks(place: np.ndarray, deviation: np.ndarray, jump: np.ndarray, noise_mm: float) -> Iterator[_Block]:
    """Per end and length: the block's least distance from the predictions, its limit, its indices.

    The next point, the line through the next two and the parabola through the next three predict the block. Errors grow
    fast towards a singularity, where runs often end: twice the growth between the next two points is allowed.
    """
    for order in (1, -1):
        index, steps, gaps = np.arange(len(place))[::order], jump[::order], np.diff(place)[::order]
        for length in range(1, _LONGEST + 1):
            block, nodes = index[:length], index[length : length + 3, None]
            off = min(_off_curve(place, deviation, block[None], nodes[:count]).min() for count in (1, 2, 3))
            growth = gaps[length - 1] / gaps[length] * steps[length]
            yield off, max(_MIN_SCALES * max(noise_mm, _END_MM), _JUMP_FACTOR * growth), block


def strays(
    position_mm: np.ndarray, stop: np.ndarray, names: np.ndarray, on_world: np.ndarray
) -> tuple[np.ndarray, dict[int, str]]:
    """Which of n readings (n, 3) at stops (n,) are of another reflector than the named one, and a text on each.

    names (n,); on_world (n,): which reflectors are fixed to the world. Returns (marked (n,), texts by row's number),
    such as "base3 lies 210 mm away, where base1 is".
    """
    every, number = np.unique(np.asarray(names, dtype=str), return_inverse=True)
    at = np.unique(stop, return_inverse=True)[1]
    grid = np.full((at.max() + 1, len(every), 3), np.nan)
    grid[at, number] = position_mm
    fixed = np.array([np.asarray(on_world)[number == k].any() for k in range(len(every))])
    places = np.where(fixed[:, None], np.nanmedian(grid, axis=0), np.nan)
    wrong = _moved(grid, places) | _apart(grid, np.flatnonzero(~fixed))
    marked = wrong[at, number]
    texts: dict[int, str] = {}
    for row in np.flatnonzero(marked).tolist():
        right_mm = np.where(fixed[:, None], places, np.where(wrong[at[row], :, None], np.nan, grid[at[row]]))
        texts[row] = _text(every, number[row], position_mm[row], right_mm, grid)
    return marked, texts


def _moved(grid: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Readings (stops, r) that are not where their reflectors stand, places (r, 3), NaN where these move."""
    off = np.linalg.norm(grid - places, axis=2)
    wrong = np.zeros(off.shape, dtype=bool)
    for k in np.flatnonzero(np.isfinite(places).all(axis=1)):
        wrong[:, k] = _outlying(off[:, k])
    return wrong


def _apart(grid: np.ndarray, body: np.ndarray) -> np.ndarray:
    """Readings (stops, r) of the reflectors of a body, by number, that are off from most of its others."""
    wrong = np.zeros(grid.shape[:2], dtype=bool)
    if len(body) < 2:
        return wrong
    distance = np.linalg.norm(grid[:, body, None] - grid[:, None, body], axis=3)
    # pairs that were never seen together have no usual distance
    together = np.isfinite(distance).any(axis=0)
    usual = np.zeros(together.shape)
    usual[together] = np.nanmedian(distance[:, together], axis=0)
    off = np.abs(distance - usual)
    bad, seen = np.zeros(off.shape, dtype=bool), np.isfinite(off)
    for first, second in zip(*np.triu_indices(len(body), 1), strict=True):
        bad[:, first, second] = bad[:, second, first] = _outlying(off[:, first, second])
    companions = seen.sum(axis=2) - seen[:, range(len(body)), range(len(body))]
    wrong[:, body] = (companions > 0) & (2 * bad.sum(axis=2) > companions)
    return wrong


def _outlying(off: np.ndarray) -> np.ndarray:
    """Which deviations (stops,) from the usual distance, NaN where unknown, are gross; none where many are."""
    if not np.isfinite(off).any():
        return np.zeros(len(off), dtype=bool)
    return unless_many(off > max(_FAR_MM, MAX_ROBUST_SDS * robust_sd(off[np.isfinite(off)])), _MAX_SHARE)


def _text(names: np.ndarray, number: int, position: np.ndarray, right_mm: np.ndarray, grid: np.ndarray) -> str:
    """Text on a wrong reading of a reflector, by number; right_mm (r, 3): places of all, NaN where unknown."""
    away = np.linalg.norm(right_mm - position, axis=1)
    near = int(np.nanargmin(np.where(np.arange(len(names)) == number, np.inf, np.nan_to_num(away, nan=np.inf))))
    if away[near] < _FAR_MM:
        # on one body the two keep their distance
        usual = np.nanmedian(np.linalg.norm(grid[:, number] - grid[:, near], axis=1))
        far = away[number] if np.isfinite(away[number]) else usual
        return f"{names[number]} lies {far:.3g} mm away, where {names[near]} is"
    if np.isfinite(away[number]):
        return f"{names[number]} lies {away[number]:.3g} mm away"
    return f"{names[number]} does not keep its distance from the others"
