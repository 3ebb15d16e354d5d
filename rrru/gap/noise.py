"""The measuring noise, where nobody has stated it, and single points that the instrument has spoilt."""

import numpy as np

from rrru.campaign.measurements import ENOUGH_REPEATS, repeat_noise
from rrru.gap.evidence import along_runs

# a point this many robust deviations from its neighbours on both sides is spoilt; no more than this share may be
_SPOILT, _MOST = 8.0, 0.1


def estimate_noise(case, linear):
    """Noise per axis in mm and where it is from: "high_frequency", or "repeats" where these say clearly less.

    High frequency: what no effect of the library can fit, in the upper half of the half-wave numbers along each run; a
    gap that is smooth along the path leaves it alone, as time and hysteresis, which spoil repeats, do.
    """
    columns = np.concatenate([linear.base, *linear.columns.values()], axis=-1)
    if columns.shape[-1] > len(case):
        # too few points to fit everything: what the calibration leaves has to do
        columns = linear.base
    flat = columns.reshape(-1, columns.shape[-1])
    size = np.linalg.norm(flat, axis=0)
    fitted, _, rank, _ = np.linalg.lstsq(flat / np.where(size > 0.0, size, 1.0), linear.data.ravel(), rcond=1e-9)
    rest = (linear.data.ravel() - flat / np.where(size > 0.0, size, 1.0) @ fitted).reshape(-1, 3)
    turned, wave = along_runs(rest, case.run)
    length = np.array([np.count_nonzero(case.run == run) for run in case.run])
    upper = turned[wave > 0.5 * length]
    freedom = 1.0 - rank / flat.shape[0]
    rough = float(np.sqrt((upper**2).mean() / max(freedom, 0.1)))
    repeated, count = repeat_noise(case.measurements.iloc[np.flatnonzero(case.used)])
    if count >= ENOUGH_REPEATS and 0.0 < repeated < rough * (1.0 - 3.0 / np.sqrt(2.0 * count)):
        return repeated, "repeats"
    return rough, "high_frequency"


def spoilt(case, residual_mm, floor_mm):
    """Used points (n,) whose residual (n, 3) stands alone: far from the median of its neighbours in the run, where such
    jumps are rare.

    floor_mm: noise per axis below which no jump counts, 0 where nobody knows it.
    """
    jump, worst = np.zeros(len(residual_mm)), np.zeros(len(residual_mm), dtype=bool)
    for run in np.unique(case.run):
        rows = np.flatnonzero(case.run == run)
        if len(rows) < 5:
            continue
        padded = np.pad(residual_mm[rows], ((2, 2), (0, 0)), mode="reflect")
        around = np.stack([padded[k : k + len(rows)] for k in (0, 1, 3, 4)])
        far = np.abs(residual_mm[rows] - np.median(around, axis=0)).max(axis=1)
        # of neighbours the worst one alone: it may have pulled at the others' median
        beside = np.pad(far, 2)
        jump[rows] = far
        worst[rows] = far >= np.max([beside[k : k + len(rows)] for k in range(5)], axis=0)
    # the median of the largest of three absolute normal numbers is 1.55 times their deviation
    scale = max(float(np.median(jump)) / 1.55, 1.2 * floor_mm)
    flagged = worst & (jump > _SPOILT * scale)
    return flagged if flagged.mean() <= _MOST else np.zeros(len(jump), dtype=bool)
