"""Outliers: readings that are many robust standard deviations off what the other readings predict of them.

    d_i > limit * max(median_j d_j / m, floor)

d_i: distance of reading i from its prediction; m: median of d for noise of unit variance. Outliers do not widen their
own scale (Hampel, Journal of the American Statistical Association 69, 1974). The prediction depends on what is known:

- residuals of a fit along runs: the median of four neighbours, since the model discrepancy is smooth (`isolated`);
- residuals of a fit in no order: the model, and the median of the nearest places
  (`rrru.calibration.lengths.standing_out`);
- before a model is fitted: curves through the neighbours and running medians, since readings hold all errors of the
  robot, which bend, jump and ripple, or the usual distance of two reflectors (both `rrru.campaign.ingest.outliers`).
"""

import numpy as np
import numpy.typing as npt

from rrru.arrays import BoolArray, FloatArray

# medians for standard normal numbers: of one's absolute value, of the length of a vector of three
NORMAL_MEDIAN, MEDIAN_OF_LENGTH = 0.6745, 1.5382
# ASSUME the median of the largest of three distances from four neighbours' medians; 1.44 for independent noise
_MEDIAN_OF_JUMP = 1.55
# robust standard deviations that no noise reaches
MAX_ROBUST_SDS = 8.0
# noise of a difference from the median of four neighbours
_NOISE_OF_JUMP = 1.2


def robust_sd(off: FloatArray, normal_median: float = NORMAL_MEDIAN, floor: float = 0.0) -> float:
    """Standard deviation of normal noise whose distances have the median of |off|, at least a floor."""
    return max(float(np.median(np.abs(off))) / normal_median, floor)


def off_neighbours(values: FloatArray, near: npt.NDArray[np.int_]) -> FloatArray:
    """Distances (n, a) of values (n, a) from the median of their neighbours, by number (n, k)."""
    return np.abs(values - np.median(values[near], axis=1))


def unless_many(flags: BoolArray, max_share: float = 0.1) -> BoolArray:
    """Flags (n,) of outliers, none where more than a share are: then the instrument is not the cause."""
    return np.asarray(flags & (flags.mean() <= max_share))


def isolated(
    residual_mm: FloatArray, run: npt.NDArray[np.generic], floor_mm: float, kind: npt.NDArray[np.generic] | None = None
) -> BoolArray:
    """Points (n,) whose residual (n, 3) in mm stands alone: far from the median of its neighbours in the run (n,).

    floor_mm: noise per axis below which no jump counts, 0 where it is unknown; kind (n,): numbers of the targets, each
    of which has its own scale of jumps. No point is flagged where such jumps are frequent.
    """
    window = np.repeat(np.arange(len(run))[:, None], 5, axis=1)
    for label in np.unique(run):
        here = np.flatnonzero(run == label)
        if len(here) >= 5:
            window[here] = np.lib.stride_tricks.sliding_window_view(np.pad(here, 2, mode="reflect"), 5)
    jump = off_neighbours(residual_mm, window[:, [0, 1, 3, 4]]).max(axis=1)
    # only the worst one of neighbours: it may have moved the others' median
    flagged = jump >= jump[window].max(axis=1)
    kind = np.zeros(len(run)) if kind is None else kind
    for number in np.unique(kind):
        its = kind == number
        flagged[its] &= jump[its] > MAX_ROBUST_SDS * robust_sd(jump[its], _MEDIAN_OF_JUMP, _NOISE_OF_JUMP * floor_mm)
    return unless_many(flagged)
