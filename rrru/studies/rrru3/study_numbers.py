"""The error numbers of paper A from error vectors of one campaign, for `published` and the twin's search alike."""

import numpy as np

# what the numbers need
TRAJECTORIES = {*(f"line_{k}" for k in range(1, 8)), "spiral"}
# printed as "less than": reached when not above
UPPER_LIMITS = ("spiral_under_lines_z_abs_max",)


def study_numbers(trajectory, before_mm, under_lines_mm, under_spiral_mm):
    """Numbers of paper.ERRORS by item (without the objective), in mm.

    trajectory: (n,) names `line_1` to `line_7` and `spiral`; the others: error vectors (n, 3) before calibration and
    under both calibrations, NaN where a point was not measured.
    """
    trajectory = np.asarray(trajectory)
    before, lines, spiral = (np.linalg.norm(e, axis=1) for e in (before_mm, under_lines_mm, under_spiral_mm))
    first, curve = trajectory == "line_1", trajectory == "spiral"
    ranges = {
        "group1_before": before[first],
        "group1_after": lines[first],
        "lines_after": lines[~curve],
        "spiral_under_lines_x": under_lines_mm[curve, 0],
        "spiral_under_spiral_component": under_spiral_mm[curve],
        "lines_2_7_under_spiral": spiral[~curve & ~first],
    }
    largest = {
        "lines_before_max": before[~curve],
        "spiral_under_lines_z_abs_max": np.abs(under_lines_mm[curve, 2]),
        "spiral_under_lines_max": lines[curve],
        "spiral_under_spiral_max": spiral[curve],
    }
    return {
        **{f"{item}_min": np.nanmin(values) for item, values in ranges.items()},
        **{f"{item}_max": np.nanmax(values) for item, values in ranges.items()},
        **{item: np.nanmax(values) for item, values in largest.items()},
    }


def group_orders(trajectory, before_mm, under_lines_mm):
    """The paper's orders as margins, positive where they hold: name to ratio - 1.

    centre_before/after: the best mean error of groups 4-7 against the worst of groups 1-3; group6_before/after: the
    largest error of group 6 against that of the other groups.
    """
    trajectory = np.asarray(trajectory)
    margins = {}
    for label, errors in (("before", before_mm), ("after", under_lines_mm)):
        size = np.linalg.norm(errors, axis=1)
        groups = [size[trajectory == f"line_{k}"] for k in range(1, 8)]
        mean, largest = [np.nanmean(group) for group in groups], [np.nanmax(group) for group in groups]
        sixth = largest.pop(5)
        margins[f"centre_{label}"] = min(mean[3:]) / max(mean[:3]) - 1.0
        margins[f"group6_{label}"] = sixth / max(largest) - 1.0
    return margins
