"""The measuring noise of a campaign where nobody has stated it, and single points that the instrument got wrong."""

import numpy as np

from rrru.campaign import measurements as rows

# degrees of freedom from which on repeated points tell the noise
ENOUGH_REPEATS = 30
# a point this many robust deviations from its neighbours on both sides is an outlier; no more than this share may be
_OUTLYING, _MOST = 8.0, 0.1


def along_runs(values, run):
    """Cosine transform of (n, ...) along each run (n,), orthonormal, and the half-wave number (n,) of each row."""
    from scipy.fft import dct

    result, wave = np.empty_like(values), np.empty(len(run))
    for label in np.unique(run):
        here = np.flatnonzero(run == label)
        result[here] = dct(values[here], axis=0, norm="ortho")
        wave[here] = np.arange(len(here))
    return result, wave


def repeat_noise(measurements):
    """Noise per axis in mm from points measured more than once under the same conditions, and its degrees of freedom.

    Repeats share the trajectory, the commanded position, the direction of motion, speed and payload. NaN and 0 where
    nothing repeats. What moves the robot from pass to pass counts as noise here.
    """
    frame = measurements.loc[rows.usable(measurements)]
    frame = frame.assign(direction=rows.direction(frame))
    axes, places = ([f"{name}_{axis}_mm" for axis in "xyz"] for name in ("measured", "command"))
    keys = ["trajectory", "direction", *places, "speed_mm_s", "payload_kg"]
    groups = frame.groupby(keys, dropna=False, sort=False)[axes]
    deviation = (frame[axes] - groups.transform("mean")).to_numpy()
    freedom = 3 * int(len(frame) - groups.ngroups)
    return (float(np.sqrt((deviation**2).sum() / freedom)) if freedom else np.nan), freedom


def estimate(measurements, residual_mm, columns):
    """Noise per axis in mm and where it is from: "high_frequency", or "repeats" where these say clearly less.

    measurements: the n points used; residual_mm (n, 3): what a calibration leaves of them; columns (n, 3, k): whatever
    may still be fitted. High frequency: what these leave in the upper half of the half-wave numbers along each run; a
    gap that is smooth along the path leaves it alone, as time and hysteresis, which spoil repeats, do.
    """
    run = measurements["run"].to_numpy()
    flat = columns.reshape(-1, columns.shape[-1])
    size = np.linalg.norm(flat, axis=0)
    unit = flat / np.where(size > 0.0, size, 1.0)
    fitted, _, rank, _ = np.linalg.lstsq(unit, residual_mm.ravel(), rcond=1e-9)
    cosines, wave = along_runs((residual_mm.ravel() - unit @ fitted).reshape(-1, 3), run)
    length = np.array([np.count_nonzero(run == label) for label in run])
    upper = cosines[wave > 0.5 * length]
    freedom = 1.0 - rank / flat.shape[0]
    rough = float(np.sqrt((upper**2).mean() / max(freedom, 0.1)))
    repeated, count = repeat_noise(measurements)
    if count >= ENOUGH_REPEATS and 0.0 < repeated < rough * (1.0 - 3.0 / np.sqrt(2.0 * count)):
        return repeated, "repeats"
    return rough, "high_frequency"


def isolated(residual_mm, run, floor_mm):
    """Points (n,) whose residual (n, 3) stands alone: far from the median of its neighbours in the run (n,).

    floor_mm: noise per axis below which no jump counts, 0 where nobody knows it. None where such jumps are frequent.
    """
    jump, worst = np.zeros(len(residual_mm)), np.zeros(len(residual_mm), dtype=bool)
    for label in np.unique(run):
        here = np.flatnonzero(run == label)
        if len(here) < 5:
            continue
        padded = np.pad(residual_mm[here], ((2, 2), (0, 0)), mode="reflect")
        around = np.stack([padded[k : k + len(here)] for k in (0, 1, 3, 4)])
        far = np.abs(residual_mm[here] - np.median(around, axis=0)).max(axis=1)
        # of neighbours the worst one alone: it may have pulled at the others' median
        beside = np.pad(far, 2)
        jump[here] = far
        worst[here] = far >= np.max([beside[k : k + len(here)] for k in range(5)], axis=0)
    # the median of the largest of three absolute normal numbers is 1.55 times their deviation
    scale = max(float(np.median(jump)) / 1.55, 1.2 * floor_mm)
    flagged = worst & (jump > _OUTLYING * scale)
    return flagged if flagged.mean() <= _MOST else np.zeros(len(jump), dtype=bool)
