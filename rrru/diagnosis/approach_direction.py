"""The side from which each drive comes to a reading: where the rows do not determine it, and its posterior odds.

Backlash and friction windup change their sign with the sense in which a drive arrives. At the start of a run no row
says how the robot got there; near a reversal of a drive the path between the readings is an interpolation, which may
turn back before or after the reading. Such readings are used for everything else. Lengths in mm, angles in rad.
"""

from dataclasses import replace
from itertools import pairwise, product
from math import comb

import numba
import numpy as np

from rrru.campaign.driven_path import STEPS
from rrru.campaign.outliers import NORMAL_MEDIAN
from rrru.diagnosis.options import OPTIONS
from rrru.effects.protocol import PATH

_ROUNDING = {"rad": OPTIONS.drive_rounding_rad, "mm": OPTIONS.drive_rounding_mm}
# the next difference, over its deviation for white noise, of a motion with 4 points a period: sin(pi / 4)
_FOUR_A_PERIOD = np.sqrt(0.5)


def read_back_jitter(drive, run):
    """Standard deviation (K,) of the random error of drive values (n, K) along runs (n,).

    The k-th difference of white noise of deviation s has the deviation s sqrt(C(2k, k)); that of a smooth motion
    decreases relative to it with k. The estimate of a run is that of the first order from which on it does not
    decrease, while a motion with 4 points a period still would. Zero where no order is such, or where a run is short.
    Deviations are by medians of absolute values, which corners do not change. The result is the lower quartile of the
    runs: a motion with fewer points a period is taken for jitter, and nothing makes a run's jitter smaller.

    Source: Hall, Kay and Titterington, Asymptotically optimal difference-based estimation of variance in nonparametric
    regression, Biometrika 77, 1990, for the differences.
    """
    runs = np.split(np.asarray(drive, dtype=float), np.flatnonzero(np.diff(run)) + 1)
    least = OPTIONS.min_differences + OPTIONS.min_difference_order
    found = [_jitter_of_run(values) for values in runs if len(values) > least]
    return np.quantile(found, 0.25, axis=0, method="lower") if found else np.zeros(np.shape(drive)[1])


def _jitter_of_run(drive):
    """`read_back_jitter` (K,) of drive values (n, K) of one run."""
    sizes = []
    highest = min(OPTIONS.max_difference_order, len(drive) - OPTIONS.min_differences)
    for order in range(OPTIONS.min_difference_order, highest + 1):
        size = np.median(np.abs(np.diff(drive, n=order, axis=0)), axis=0) / NORMAL_MEDIAN
        sizes.append(size / np.sqrt(comb(2 * order, order)))
    result = np.zeros(drive.shape[1])
    for before, after in reversed([*pairwise(sizes)]):
        result = np.where(after > _FOUR_A_PERIOD * before, after, result)
    return result


def rest_widths(drive, run, units):
    """Changes (K,) of drive values (n, K) along runs (n,) that are no motion, in the drives' units."""
    rounding = np.array([_ROUNDING[unit] for unit in units])
    span = np.ptp(drive, axis=0)
    widest = np.array([span[[other == unit for other in units]].max() for unit in units])
    jitter = read_back_jitter(drive, run)
    jitter = np.where(jitter < OPTIONS.max_jitter_per_swing * widest, jitter, 0.0)
    return np.maximum(OPTIONS.rest_width_per_jitter_sd * jitter, rounding)


def at_reversals(course, other_path, widths):
    """Rows (n, K) at which a drive reverses: its sense of arrival there is not determined.

    course: with drive, path_drive and path_index; other_path (N, K): actuator values along the path by another
    interpolation. As far as the two are apart between a reading and its neighbours, neither determines where a drive
    reverses. widths (K,): of `rest_widths`.
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
def _reversals(path, width):
    """Rows (N,) from which on a drive turns back along its path (N,) by more than a width."""
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


def estimate_approach(case, state, responses):
    """The motion's `approach` (n, K) by what a state leaves of a Case's readings.

    Both senses of every drive have equal prior probability. The combinations of the senses at a stop have the odds of
    the likelihood of all that was read there; the expected sense is their mean.
    responses (m, 3, K): change of what is read by a sense of 1 of each drive.
    """
    approach = case.motion.approach.copy()
    unknown = np.isfinite(approach)
    # the residual under even odds
    plain = replace(case, motion=replace(case.motion, approach=np.where(unknown, 0.0, approach)))
    scale = case.axis_mm
    left, response = plain.residual(state) / scale, responses / scale[:, None]
    size = np.sqrt((response**2).sum(axis=1)) > OPTIONS.min_approach_response_per_noise
    approach[unknown] = 0.0
    acting = (unknown[case.at] & size).any(axis=1)
    for stop in np.unique(case.stop[acting]):
        here = case.stop == stop
        drives = np.flatnonzero((unknown[case.at[here]] & size[here]).any(axis=0))
        power = (response[here][..., drives] ** 2).sum(axis=(0, 1))
        drives = np.sort(drives[np.argsort(-power, kind="stable")][: OPTIONS.max_jointly_estimated_drives])
        senses = np.array([*product((-1.0, 1.0), repeat=len(drives))])
        lacking = left[here].ravel() - senses @ response[here].reshape(-1, response.shape[-1])[:, drives].T
        log = -0.5 * (lacking**2).sum(axis=1)
        odds = np.exp(log - np.logaddexp.reduce(log))
        points = np.unique(case.at[here])
        approach[points[:, None], drives] = np.where(unknown[points[:, None], drives], odds @ senses, np.nan)
    return approach


def has_direction(effect):
    """Whether an effect depends on the sense in which the drives arrive."""
    return PATH in effect.needs
