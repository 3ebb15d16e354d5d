"""The error numbers and the orders of paper A from error vectors, for `published`, `redraws` and the twin's search.

Leading axes (...) of all arrays are draws; without them the results are single numbers.
"""

import numpy as np
from scipy.signal import find_peaks

from rrru.studies.rrru3.paper import ERRORS_MM, TABLE_5, TABLE_6, TOLERANCE

# trajectories that the numbers need
TRAJECTORIES = {*(f"line_{k}" for k in range(1, 8)), "spiral"}
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
    before, lines, spiral = (np.linalg.norm(e, axis=-1) for e in (before_mm, under_lines_mm, under_spiral_mm))
    first, curve = trajectory == "line_1", trajectory == "spiral"
    components = under_spiral_mm[..., curve, :]
    ranges = {
        "group1_before": before[..., first],
        "group1_after": lines[..., first],
        "lines_after": lines[..., ~curve],
        "spiral_under_lines_x": under_lines_mm[..., curve, 0],
        "spiral_under_spiral_component": components.reshape(*components.shape[:-2], -1),
        "lines_2_7_under_spiral": spiral[..., ~curve & ~first],
    }
    largest = {
        "lines_before_max": before[..., ~curve],
        "spiral_under_lines_z_abs_max": np.abs(under_lines_mm[..., curve, 2]),
        "spiral_under_lines_max": lines[..., curve],
        "spiral_under_spiral_max": spiral[..., curve],
    }
    return {
        **{f"{item}_min": np.nanmin(values, axis=-1) for item, values in ranges.items()},
        **{f"{item}_max": np.nanmax(values, axis=-1) for item, values in ranges.items()},
        **{item: np.nanmax(values, axis=-1) for item, values in largest.items()},
    }


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
    trajectory, margins = np.asarray(trajectory), {}
    for label, errors in (("before", before_mm), ("after", under_lines_mm), ("spiral", under_spiral_mm)):
        size = np.linalg.norm(errors, axis=-1)
        groups = [size[..., trajectory == f"line_{k}"] for k in range(1, 8)]
        mean = np.stack([np.nanmean(group, axis=-1) for group in groups])
        margins[f"centre_{label}"] = mean[3:].min(axis=0) / mean[:3].max(axis=0) - 1.0
        if label != "spiral":
            largest = np.stack([np.nanmax(group, axis=-1) for group in groups])
            margins[f"group6_{label}"] = largest[5] / np.delete(largest, 5, axis=0).max(axis=0) - 1.0
            margins[f"outer_{label}"] = mean[5:].min(axis=0) / mean[:5].max(axis=0) - 1.0
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
