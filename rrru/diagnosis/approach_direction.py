"""The side from which each drive comes to a reading: where the rows do not determine it, and its posterior mean.

Backlash and friction windup change their sign with the sense in which a drive arrives. At the start of a run no row
says how the robot got there; near a reversal of a drive the path between the readings is an interpolation, which may
turn back before or after the reading. Such readings are used for everything else. Lengths in mm, angles in rad.

For campaigns that stop to measure, the paths are those between stops. Joint interpolation (PTP) moves every drive
straight to its next value: it comes from the side of the value before. On a straight line of the tool (LIN) a drive may
turn back on the way: it comes from the side of its last stretch. A drive that does not move between two stops keeps its
side of arrival.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise, product
from math import comb
from typing import TYPE_CHECKING

import numba
import numpy as np
from scipy.spatial.transform import Rotation

from rrru.arrays import BoolArray, FloatArray, IntArray
from rrru.campaign.driven_path import STEPS, stops
from rrru.campaign.outliers import NORMAL_MEDIAN
from rrru.campaign.stated_motion import DRIVES, TOOL
from rrru.diagnosis.discrepancy_basis import TestedEffect
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.state import ModelState
from rrru.effects.backlash import play
from rrru.effects.motion import Course
from rrru.effects.protocol import PATH
from rrru.kinematics.inverse import inverse_kinematics
from rrru.kinematics.robot import Robot

if TYPE_CHECKING:
    from rrru.diagnosis.problem import DiagnosisProblem

_ROUNDING = {"rad": OPTIONS.drive_rounding_rad, "mm": OPTIONS.drive_rounding_mm}
# of a sine with 4 points a period: ratio of the rms of its k+1-th difference over sqrt(C(2k + 2, k + 1)) to that of its
# k-th difference over sqrt(C(2k, k)), for large k, about sin(pi / 4); of white noise it is 1
_MIN_RATIO_OF_DIFFERENCES = np.sqrt(0.5)

# steps of the path from one stop to the next, and their shares of the way, denser near its ends: a drive may turn back
# just before a stop
_STEPS_PER_WAY = 16
_SHARES = 0.5 * (1.0 - np.cos(np.pi * np.arange(_STEPS_PER_WAY + 1) / _STEPS_PER_WAY))
# senses of arrival that differ by less are the same: values of a long drive are rounded to some 1e-5 of its rest width
_SENSE_TOLERANCE = 0.01


def read_back_jitter(drive: FloatArray, run: IntArray) -> FloatArray:
    """Standard deviation (K,) of the random error of drive values (n, K) along runs (n,), in rad or mm.

    The k-th difference of white noise of deviation s has the deviation s sqrt(C(2k, k)); that of a smooth motion
    decreases relative to it with k. The estimate of a run is that of the first order from which on it decreases by less
    than that of a motion with 4 points a period would. It is zero where there is no such order, or where a run is
    short. Deviations are by medians of absolute values, which corners do not change. The result is the lower quartile
    over the runs: a motion with fewer points a period makes the estimate of its run too large, and nothing makes it too
    small.

    Source: Hall, Kay and Titterington, Asymptotically optimal difference-based estimation of variance in nonparametric
    regression, Biometrika 77, 1990, for the differences.
    """
    runs = np.split(np.asarray(drive, dtype=float), np.flatnonzero(np.diff(run)) + 1)
    least = OPTIONS.min_differences + OPTIONS.min_difference_order
    found = [_jitter_of_run(values) for values in runs if len(values) > least]
    return np.quantile(found, 0.25, axis=0, method="lower") if found else np.zeros(np.shape(drive)[1])


def _jitter_of_run(drive: FloatArray) -> FloatArray:
    """`read_back_jitter` (K,) of drive values (n, K) of one run."""
    sizes = []
    highest = min(OPTIONS.max_difference_order, len(drive) - OPTIONS.min_differences)
    for order in range(OPTIONS.min_difference_order, highest + 1):
        size = np.median(np.abs(np.diff(drive, n=order, axis=0)), axis=0) / NORMAL_MEDIAN
        sizes.append(size / np.sqrt(comb(2 * order, order)))
    result = np.zeros(drive.shape[1])
    for before, after in reversed([*pairwise(sizes)]):
        result = np.where(after > _MIN_RATIO_OF_DIFFERENCES * before, after, result)
    return result


def rest_widths(drive: FloatArray, run: IntArray, units: Sequence[str]) -> FloatArray:
    """Rest widths (K,), in the drives' units: smaller changes of drive values (n, K) along runs (n,) are no motion."""
    rounding = np.array([_ROUNDING[unit] for unit in units])
    span = np.ptp(drive, axis=0)
    widest = np.array([span[[other == unit for other in units]].max() for unit in units])
    jitter = read_back_jitter(drive, run)
    jitter = np.where(jitter < OPTIONS.max_jitter_per_swing * widest, jitter, 0.0)
    return np.asarray(np.maximum(OPTIONS.rest_width_per_jitter_sd * jitter, rounding))


def at_reversals(course: Course, other_path: FloatArray, widths: FloatArray) -> BoolArray:
    """Rows (n, K) at which a drive reverses: its sense of arrival there is not determined.

    course: with drive (n, K), path_drive (N, K) and path_index (n,); other_path (N, K): actuator values along the path
    by another interpolation. As far as the two are apart between a reading and its neighbours, neither determines where
    a drive reverses. widths (K,): of `rest_widths`.
    """
    stations = np.unique(course.path_index)
    apart = np.maximum.reduceat(np.abs(course.path_drive - other_path), stations)
    apart = np.maximum(apart, np.concatenate([np.zeros_like(apart[:1]), apart[:-1]]))
    apart = apart[np.searchsorted(stations, course.path_index)]
    result = np.zeros(course.drive.shape, dtype=bool)
    for leg, width in enumerate(widths):
        for path in (course.path_drive[:, leg], other_path[:, leg]):
            reversals = np.flatnonzero(_reversals(np.ascontiguousarray(path), width))
            if len(reversals):
                nearest = reversals[np.abs(reversals[:, None] - course.path_index).argmin(axis=0)]
                close = np.abs(nearest - course.path_index) <= STEPS
                way = np.abs(path[nearest] - course.drive[:, leg])
                result[:, leg] |= close & (way < width + OPTIONS.interpolation_error_factor * apart[:, leg])
    return result


@numba.njit(cache=True)
def _reversals(path: FloatArray, width: float) -> BoolArray:
    """Whether after rows (N,) of its path (N,) a drive has turned back by more than a width since its last extremum."""
    result = np.zeros(len(path), dtype=np.bool_)
    low = high = path[0]
    sense = 0
    for k in range(1, len(path)):
        high, low = max(high, path[k]), min(low, path[k])
        if sense >= 0 and path[k] < high - width:
            result[k - 1] = sense > 0
            sense, low = -1, path[k]
        elif sense <= 0 and path[k] > low + width:
            result[k - 1] = sense < 0
            sense, high = 1, path[k]
    return result


def estimate_approach(problem: DiagnosisProblem, state: ModelState, responses: FloatArray) -> FloatArray:
    """The motion's `approach` (n, K), its unknown senses (finite values) replaced by their posterior means in -1..1.

    Both senses of every drive have equal prior probability. The combinations of the senses at a stop have posterior
    probabilities in proportion to the likelihood of all that was read there, with the residuals of a state. At the
    first stop of a run the drives may as well, with a probability of one half, be somewhere between both sides.
    responses (m, 3, K): change in mm of what is read by a sense of 1 of each drive.
    """
    approach = np.array(problem.motion.approach)
    unknown = np.isfinite(approach)
    # both senses equally probable: no effect of the approach
    neutral = replace(problem, motion=replace(problem.motion, approach=np.where(unknown, 0.0, approach)))
    scale = problem.axis_mm
    residual, response = neutral.residual(state) / scale, responses / scale[:, None]
    size = np.sqrt((response**2).sum(axis=1)) > OPTIONS.min_approach_response_per_noise
    approach[unknown] = 0.0
    acting = (unknown[problem.at] & size).any(axis=1)
    run = problem.measurements["run"].to_numpy()
    first_stops = stops(problem.measurements)[np.concatenate([[True], run[1:] != run[:-1]])]
    for stop in np.unique(problem.stop[acting]):
        here = problem.stop == stop
        drives = np.flatnonzero((unknown[problem.at[here]] & size[here]).any(axis=0))
        power = (response[here][..., drives] ** 2).sum(axis=(0, 1))
        drives = np.sort(drives[np.argsort(-power, kind="stable")][: OPTIONS.max_jointly_estimated_drives])
        senses = np.array([*product((-1.0, 1.0), repeat=len(drives))])
        by_sense = response[here].reshape(-1, response.shape[-1])[:, drives]
        misfit = residual[here].ravel() - senses @ by_sense.T
        log_likelihood = -0.5 * (misfit**2).sum(axis=1)
        if stop in first_stops:
            between, log_between = _between_sides(residual[here].ravel(), by_sense)
            senses = np.concatenate([senses, between[None]])
            log_likelihood = np.append(log_likelihood - len(drives) * np.log(2.0), log_between)
        probability = np.exp(log_likelihood - np.logaddexp.reduce(log_likelihood))
        points = np.unique(problem.at[here])
        approach[points[:, None], drives] = np.where(unknown[points[:, None], drives], probability @ senses, np.nan)
    return approach


def _between_sides(residual: FloatArray, by_sense: FloatArray) -> tuple[FloatArray, float]:
    """Posterior means (d,) of senses that are somewhere in -1..1, and the log marginal likelihood of that.

    residual (a,), by_sense (a, d): in units of the noise. The prior is normal with the variance 1/3 of even ones.
    """
    precision = by_sense.T @ by_sense + 3.0 * np.eye(by_sense.shape[1])
    mean = np.linalg.solve(precision, by_sense.T @ residual)
    log = 0.5 * (len(mean) * np.log(3.0) - np.linalg.slogdet(precision)[1] - residual @ (residual - by_sense @ mean))
    return np.clip(mean, -1.0, 1.0), float(log)


def has_direction(effect: TestedEffect) -> bool:
    """Whether an effect depends on the sense in which the drives arrive."""
    return PATH in effect.needs


def paths_between_stops(
    mechanism: Robot, drive: FloatArray, position_mm: FloatArray, between: str | None
) -> tuple[list[FloatArray], IntArray]:
    """Actuator values (N, K) along the path through all stops, by each possible interpolation, and rows of the stops.

    drive (s, K), position_mm (s, 3): of the stops; between: DRIVES (PTP), TOOL (LIN) or None for either; the rows (s,)
    are of the stops in the paths.
    """
    index = _STEPS_PER_WAY * np.arange(len(drive))
    ways = {DRIVES: _straight_in_drives, TOOL: _straight_in_tool}
    chosen = [between] if between else [DRIVES, TOOL]
    return [_joined(ways[name](mechanism, drive, position_mm), drive) for name in chosen], index


def undetermined_senses(paths: Sequence[FloatArray], index: IntArray, run: IntArray, widths: FloatArray) -> BoolArray:
    """Stops (s, K) at which paths of `paths_between_stops` do not determine from which side a drive comes.

    No path determines how the robot got to a run's start, run (s,), nor its motion where its path is unknown. Two paths
    determine nothing where they come from different sides. widths (K,): changes of drive values that are no motion.
    """
    senses = [_senses_of_arrival(path, index, run, widths) for path in paths]
    lost = [np.logical_or.reduceat(np.isnan(path), np.maximum(index - _STEPS_PER_WAY + 1, 0)) for path in paths]
    least = np.min([np.abs(sense) for sense in senses], axis=0)
    return np.asarray(
        (least < 1.0 - _SENSE_TOLERANCE) | (np.ptp(senses, axis=0) > _SENSE_TOLERANCE) | np.any(lost, axis=0)
    )


def _senses_of_arrival(path: FloatArray, index: IntArray, run: IntArray, widths: FloatArray) -> FloatArray:
    """Senses (s, K) in which the drives come to stops of runs (s,): 1 from below, -1 from above, less where a drive has
    moved by less than its width (K,) since the run's start or a reversal.
    """
    result = np.zeros((len(index), path.shape[1]))
    for number in np.unique(run):
        stops = index[run == number]
        piece = np.ascontiguousarray(path[stops[0] : stops[-1] + 1])
        result[run == number] = play(piece, 0.5 * widths)[stops - stops[0]] / (-0.5 * widths)
    return result


def _straight_in_drives(_mechanism: Robot, drive: FloatArray, _position_mm: FloatArray) -> FloatArray:
    """Actuator values (s - 1, steps + 1, K) on the ways between stops, straight in the drives."""
    return drive[:-1, None] + _SHARES[:, None] * np.diff(drive, axis=0)[:, None]


def _straight_in_tool(mechanism: Robot, drive: FloatArray, position_mm: FloatArray) -> FloatArray:
    """Actuator values (s - 1, steps + 1, K) on the ways between stops, on straight lines of the tool.

    Its orientation turns about one axis. NaN where the nominal robot cannot reach.
    """
    straight = _straight_in_drives(mechanism, drive, position_mm)
    shape, poses = straight.shape, mechanism.solve(drive, position_mm)
    ends = poses.point(np.asarray(mechanism.tool_mm)) if mechanism.orients else position_mm
    place = (ends[:-1, None] + _SHARES[:, None] * np.diff(ends, axis=0)[:, None]).reshape(-1, 3)
    if mechanism.orients:
        turn, first = _turning(poses.turn), straight.reshape(-1, shape[2])
        found = inverse_kinematics(mechanism, (place, turn), (first, place), mechanism.twists(), False).reshape(shape)
    else:
        found = mechanism.inverse(place).reshape(shape)
    # both ends agree with the rows, also for a controller that corrects the robot's errors
    found = found + (1.0 - _SHARES[:, None]) * (straight - found)[:, :1] + _SHARES[:, None] * (straight - found)[:, -1:]
    return np.asarray(found)


def _turning(turn: FloatArray) -> FloatArray:
    """Orientations (m, 3, 3) on the ways between those (s, 3, 3) of stops: on each way a rotation about one axis."""
    start = Rotation.from_matrix(np.repeat(turn[:-1], len(_SHARES), axis=0))
    whole = Rotation.from_matrix(turn[:-1].transpose(0, 2, 1) @ turn[1:]).as_rotvec()
    part = Rotation.from_rotvec((_SHARES[None, :, None] * whole[:, None]).reshape(-1, 3))
    return np.asarray((start * part).as_matrix())


def _joined(ways: FloatArray, drive: FloatArray) -> FloatArray:
    """The path (N, K) of ways (s - 1, steps + 1, K) from stop to stop at drive values (s, K)."""
    between = np.concatenate([drive[:-1, None], ways[:, 1:-1]], axis=1)
    return np.concatenate([between.reshape(-1, drive.shape[1]), drive[-1:]])
