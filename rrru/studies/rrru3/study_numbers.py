"""The error numbers and the orders of paper A from error vectors, for `published`, `redraws` and the twin's search.

Leading axes (...) of all arrays are draws; without them the results are single numbers.
"""

from typing import NamedTuple

import numpy as np
from scipy.signal import find_peaks

from rrru.kinematics.typed_numba import njit
from rrru.studies.rrru3.paper import ERRORS_MM, TABLE_5, TABLE_6, TOLERANCE

# trajectories that the numbers need
_GROUPS = {**{f"line_{k}": k - 1 for k in range(1, 8)}, "spiral": 7}
TRAJECTORIES = set(_GROUPS)
# printed as "less than": met when not above
UPPER_LIMITS = ("spiral_under_lines_z_abs_max",)
LINKS = ("dL1", "dL2", "dL3")
# "nearly the same": the largest difference between Tables 5 and 6
_LINKS_APART_MM = max(abs(TABLE_5[name] - TABLE_6[name]) for name in LINKS)
# least height of a peak that cannot be within the printed range after calibration, 0.294 to 1.220 mm
SPIKE_MM = ERRORS_MM["group1_after_max"] - ERRORS_MM["group1_after_min"]
# ASSUME "several": three, and "sharp": half of the height is within three of the 26 points
SPIKES, SPIKE_POINTS = 3, 3.0


def study_numbers(trajectory, before_mm, under_lines_mm, under_spiral_mm):
    """Numbers of paper.ERRORS by item (without the objective), in mm, each (...).

    trajectory: (n,) names `line_1` to `line_7` and `spiral`; the others: error vectors (..., n, 3) before calibration
    and after both calibrations, NaN where a point was not measured.
    """
    trajectory = np.asarray(trajectory)
    curve, groups = trajectory == "spiral", slice(0, 7)
    before, lines, spiral = (_ranges(trajectory, errors) for errors in (before_mm, under_lines_mm, under_spiral_mm))
    components = under_spiral_mm[..., curve, :]
    components = components.reshape(*components.shape[:-2], -1)
    across, along = under_lines_mm[..., curve, 0], np.abs(under_lines_mm[..., curve, 2])
    ranges = {
        "group1_before": _ends(before.least[..., :1], before.largest[..., :1]),
        "group1_after": _ends(lines.least[..., :1], lines.largest[..., :1]),
        "lines_after": _ends(lines.least[..., groups], lines.largest[..., groups]),
        "spiral_under_lines_x": _ends(across, across),
        "spiral_under_spiral_component": _ends(components, components),
        "lines_2_7_under_spiral": _ends(spiral.least[..., 1:7], spiral.largest[..., 1:7]),
    }
    return {
        **{f"{item}_min": least for item, (least, _) in ranges.items()},
        **{f"{item}_max": largest for item, (_, largest) in ranges.items()},
        "lines_before_max": np.fmax.reduce(before.largest[..., groups], axis=-1),
        "spiral_under_lines_z_abs_max": np.fmax.reduce(along, axis=-1),
        "spiral_under_lines_max": np.fmax.reduce(lines.largest[..., 7:], axis=-1),
        "spiral_under_spiral_max": np.fmax.reduce(spiral.largest[..., 7:], axis=-1),
    }


def _ends(low, high):
    """The least of values (..., n) and the largest of others; NaN values are left out."""
    return np.fmin.reduce(low, axis=-1), np.fmax.reduce(high, axis=-1)


class _Ranges(NamedTuple):
    """Least, largest and mean errors (..., 8) in mm on the seven lines and the spiral."""

    least: np.ndarray
    largest: np.ndarray
    mean: np.ndarray


def _ranges(trajectory, errors):
    """The _Ranges of error vectors (..., n, 3); those that are NaN are left out."""
    group = np.array([_GROUPS[name] for name in trajectory.tolist()])
    found = _group_ranges(np.ascontiguousarray(errors).reshape(-1, *errors.shape[-2:]), group)
    return _Ranges(*found.reshape(3, *errors.shape[:-2], len(_GROUPS)))


@njit(cache=True, error_model="numpy")
def _group_ranges(errors, group):
    """Least, largest and mean lengths (3, d, 8) of error vectors (d, n, 3) of groups (n,); NaN where there is none."""
    result = np.full((3, errors.shape[0], 8), np.nan)
    total, count = np.empty(8), np.empty(8)
    for d in range(errors.shape[0]):
        total[:], count[:] = 0.0, 0.0
        for n in range(errors.shape[1]):
            k, (x, y, z) = group[n], errors[d, n]
            size = np.sqrt(x * x + y * y + z * z)
            if not np.isnan(size):
                if count[k] == 0 or size < result[0, d, k]:
                    result[0, d, k] = size
                if count[k] == 0 or size > result[1, d, k]:
                    result[1, d, k] = size
                total[k] += size
                count[k] += 1.0
        result[2, d] = total / count
    return result


def matched(item, value, published):
    """Whether a number here meets the printed one within TOLERANCE; an upper limit is met below it."""
    deviation = np.asarray(value) / published - 1.0
    return (deviation if item in UPPER_LIMITS else np.abs(deviation)) <= TOLERANCE


def covered(item, low, high, published):
    """Whether a range of numbers here holds the printed one; an upper limit is met where the range begins below it."""
    return low <= published and (item in UPPER_LIMITS or published <= high)


def group_orders(trajectory, before_mm, under_lines_mm, under_spiral_mm):
    """The paper's orders of the line groups as margins (...), positive where they hold: name to ratio - 1.

    centre_*: the least mean error of groups 4-7 over the largest of groups 1-3; group6_*: the largest error of group 6
    over that of the other groups; outer_*: the smaller mean error of groups 6 and 7 over the largest of the others.
    """
    margins, trajectory = {}, np.asarray(trajectory)
    for label, errors in (("before", before_mm), ("after", under_lines_mm), ("spiral", under_spiral_mm)):
        ranges = _ranges(trajectory, errors)
        mean, largest = ranges.mean, ranges.largest
        margins[f"centre_{label}"] = mean[..., 3:7].min(axis=-1) / mean[..., :3].max(axis=-1) - 1.0
        if label != "spiral":
            others = largest[..., [0, 1, 2, 3, 4, 6]].max(axis=-1)
            margins[f"group6_{label}"] = largest[..., 5] / others - 1.0
            margins[f"outer_{label}"] = mean[..., 5:7].min(axis=-1) / mean[..., :5].max(axis=-1) - 1.0
    return margins


def link_order(lines, spiral):
    """Margin (...) of link errors (..., 3) in mm that are nearly the same in both calibrations."""
    apart = np.abs(np.asarray(lines) - np.asarray(spiral)).max(axis=-1)
    return {"links": _LINKS_APART_MM / np.maximum(apart, 1e-12) - 1.0}


def spike_orders(trajectory, before_mm, under_lines_mm):
    """Margins of the sharp spikes on group 1 that Fig. 9 shows before calibration only; errors (n, 3) of one draw.

    spikes_before: the least of the SPIKES highest before calibration over SPIKE_MM; spikes_after: SPIKE_MM compared
    with the highest after it. Heights are prominences.
    """
    first = np.asarray(trajectory) == "line_1"
    before, after = (spikes(np.linalg.norm(errors[first], axis=-1)) for errors in (before_mm, under_lines_mm))
    return {"spikes_before": before[SPIKES - 1] / SPIKE_MM - 1.0, "spikes_after": 1.0 - after[0] / SPIKE_MM}


def spikes(size_mm):
    """Heights in mm of the sharp spikes of errors (n,), highest first, at least SPIKES entries."""
    _, found = find_peaks(size_mm, prominence=0.0, width=(0.0, SPIKE_POINTS))
    return sorted([*found["prominences"], *np.zeros(SPIKES)], reverse=True)
