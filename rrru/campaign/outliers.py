"""Points that the instrument got wrong (a broken beam): found by comparing each with its neighbours along the run.

A play that turns over gives a step, a geometric error a smooth curve, a drive or a loose joint a ripple or a small spike: all of these are
the robot's. A broken beam gives one to three points that fit neither side. Lengths in mm.
"""

import numpy as np
from scipy.ndimage import median_filter

# Longest run of consecutive bad points that is looked for; the running median's window must hold more good points than bad.
_LONGEST = 3
_WINDOW = 2 * _LONGEST + 1
# Median length of a vector of three independent normal numbers of unit variance: turns the median of residuals' lengths into one sigma per axis.
_MEDIAN_OF_CHI3 = 1.5382
# ASSUME the robot's own spikes stay below threshold x 0.1 mm, and its steps within the last points of a run, where a step and a bad block
# look the same, below threshold x 0.25 mm (at the default threshold: 0.6 and 1.5 mm).
_SPIKE_MM = 0.1
_STEP_MM = 0.25


def flag_outliers(deviation_mm, run, noise_mm=None, threshold=6.0):
    """Mark (n,) of the points that do not fit their neighbours in the run; rows in the order driven.

    deviation_mm: measured minus commanded position (n, 3) in mm; rows with a NaN are left out and not marked.
    run: number of the run (n,). noise_mm: the instrument's noise, one sigma per axis; None takes it as below 0.1 mm.
    threshold: how many scales of the neighbourhood a point must be off.

    A point is marked as part of a block of one to three where every point of the block lies off the curve through the two points before and the
    two after it, and off the running median of seven points, which keeps steps. At a run's ends only the other side is there to compare with.
    Runs with fewer than seven points are not judged. Raises ValueError for arguments of the wrong shape.
    """
    deviation, run = np.asarray(deviation_mm, dtype=float), np.asarray(run)
    if deviation.ndim != 2 or deviation.shape[1] != 3 or run.shape != deviation.shape[:1]:
        raise ValueError(f"expected deviations (n, 3) and runs (n,), got {deviation.shape} and {run.shape}")
    marked = np.zeros(len(deviation), dtype=bool)
    known = np.isfinite(deviation).all(axis=1)
    for number in np.unique(run[known]):
        rows = np.flatnonzero(known & (run == number))
        marked[rows[_bad_points(deviation[rows], noise_mm or 0.0, threshold)]] = True
    return marked


def _bad_points(deviation, noise_mm, threshold):
    """Indices of the bad points of one run: the worst block first, then again without it, until none is left."""
    kept, bad = np.arange(len(deviation)), []
    while len(kept) >= _WINDOW:
        block = _worst_block(kept, deviation[kept], noise_mm, threshold)
        if block is None:
            break
        bad.extend(kept[block])
        kept = np.delete(kept, block)
    return np.array(bad, dtype=int)
