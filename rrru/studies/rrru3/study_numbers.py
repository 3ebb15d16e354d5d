"""The error numbers of paper A, from error vectors of one campaign: the same arithmetic for the published table and the
twin's search.
"""

import numpy as np

# printed as "less than": reached when not above
# what the numbers need
TRAJECTORIES = {*(f"line_{k}" for k in range(1, 8)), "spiral"}
UPPER_LIMITS = ("spiral_under_lines_z_abs_max",)


def study_numbers(trajectory, before_mm, under_lines_mm, under_spiral_mm):
    """Numbers of paper_a.ERRORS by item (without the objective), in mm.

    trajectory: (n,) names `line_1` to `line_7` and `spiral`; the others: error vectors (n, 3), NaN where a point was
    not measured.
    """
    trajectory = np.asarray(trajectory)
    before, lines, spiral = (np.linalg.norm(e, axis=1) for e in (before_mm, under_lines_mm, under_spiral_mm))
    first, curve = trajectory == "line_1", trajectory == "spiral"
    others = ~curve & ~first
    return {
        "group1_before_min": np.nanmin(before[first]),
        "group1_before_max": np.nanmax(before[first]),
        "group1_after_min": np.nanmin(lines[first]),
        "group1_after_max": np.nanmax(lines[first]),
        "lines_after_min": np.nanmin(lines[~curve]),
        "lines_after_max": np.nanmax(lines[~curve]),
        "lines_before_max": np.nanmax(before[~curve]),
        "spiral_under_lines_x_min": np.nanmin(under_lines_mm[curve, 0]),
        "spiral_under_lines_x_max": np.nanmax(under_lines_mm[curve, 0]),
        "spiral_under_lines_z_abs_max": np.nanmax(np.abs(under_lines_mm[curve, 2])),
        "spiral_under_lines_max": np.nanmax(lines[curve]),
        "spiral_under_spiral_component_min": np.nanmin(under_spiral_mm[curve]),
        "spiral_under_spiral_component_max": np.nanmax(under_spiral_mm[curve]),
        "spiral_under_spiral_max": np.nanmax(spiral[curve]),
        "lines_2_7_under_spiral_min": np.nanmin(spiral[others]),
        "lines_2_7_under_spiral_max": np.nanmax(spiral[others]),
    }


def group_orders(trajectory, before_mm, under_lines_mm):
    """The paper's orders as margins, positive where they hold: name to ratio - 1.

    centre_before/after: the best mean error of groups 4-7 against the worst of groups 1-3; group6_before/after: the
    largest error of group 6 against that of the other groups.
    """
    trajectory = np.asarray(trajectory)
    result = {}
    for label, errors in (("before", before_mm), ("after", under_lines_mm)):
        size = np.linalg.norm(errors, axis=1)
        mean = {k: np.nanmean(size[trajectory == f"line_{k}"]) for k in range(1, 8)}
        largest = {k: np.nanmax(size[trajectory == f"line_{k}"]) for k in range(1, 8)}
        result[f"centre_{label}"] = min(mean[k] for k in (4, 5, 6, 7)) / max(mean[k] for k in (1, 2, 3)) - 1.0
        result[f"group6_{label}"] = largest[6] / max(largest[k] for k in (1, 2, 3, 4, 5, 7)) - 1.0
    return result
