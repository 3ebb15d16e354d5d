"""The measuring noise of a campaign where it is not stated."""

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.kinematics.readings import Readings

# degrees of freedom from which on repeated points determine the noise
ENOUGH_REPEATS = 30


def along_runs(
    values: npt.NDArray[np.float64], run: npt.NDArray[np.generic]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Cosine transform of (n, ...) along each run (n,), orthonormal, and the half-wave number (n,) of each row."""
    from scipy.fft import dct

    result, wave = np.empty_like(values), np.empty(len(run))
    for label in np.unique(run):
        here = np.flatnonzero(run == label)
        result[here] = dct(values[here], axis=0, norm="ortho")
        wave[here] = np.arange(len(here))
    return result, wave


def repeat_noise(measurements: pd.DataFrame) -> tuple[float, int]:
    """Noise per axis in mm from points measured more than once under the same conditions, and its degrees of freedom.

    Repeats share the trajectory, the commanded position, the direction of motion, speed and payload. NaN and 0 where
    nothing repeats. Non-repeatability of the robot from pass to pass counts as noise here.
    """
    frame, group = _repeated(measurements)
    measured = frame[[f"measured_{axis}_mm" for axis in "xyz"]].to_numpy()
    count = np.bincount(group)
    sums = np.stack([np.bincount(group, axis, len(count)) for axis in measured.T], axis=1)
    deviation = measured - (sums / count[:, None])[group]
    freedom = 3 * int(len(frame) - len(count))
    return (float(np.sqrt((deviation**2).sum() / freedom)) if freedom else np.nan), freedom


def _repeated(measurements: pd.DataFrame) -> tuple[pd.DataFrame, np.ndarray]:
    """The usable rows (n,) of a measurement table, and numbers (n,) of what was measured under the same conditions."""
    frame = measurements.loc[rows.usable(measurements)]
    frame = frame.assign(direction=rows.direction(frame))
    places = [f"command_{axis}_mm" for axis in "xyz"]
    pose = [name for name in frame if name == "target" or name.startswith("command_r")]
    keys = ["trajectory", "direction", *places, *pose, "speed_mm_s", "payload_kg"]
    codes = np.stack([pd.factorize(frame[key], use_na_sentinel=False)[0] for key in keys], axis=1)
    return frame, np.unique(codes, axis=0, return_inverse=True)[1].reshape(-1)


def typical(axes: Iterable[np.ndarray]) -> float:
    """One standard deviation from those of single readings, an array per axis: medians, then root mean square.

    Medians, since single readings may be far worse than all others.
    """
    return float(np.sqrt(np.mean([np.nanmedian(axis) ** 2 for axis in axes])))


def read_noise(measurements: pd.DataFrame) -> float | None:
    """Noise per axis in mm that the instrument stated with its readings, None where it stated none.

    # ASSUME one size for all points: the model discrepancy is larger than the differences of the readings' standard
    deviations, and weights would make the fit depend on the few points that the tracker sees best.
    """
    axes = [f"noise_{axis}_mm" for axis in "xyz"]
    if not set(axes) <= set(measurements):
        return None
    known = measurements.loc[rows.usable(measurements), axes].dropna()
    return typical(known.to_numpy().T) if len(known) else None


def quieter_repeats(
    measurements: pd.DataFrame, noise_mm: float, correlation: float = 0.0, offset: float = 0.0
) -> float | None:
    """Noise per axis in mm as repeated poses say, where that is clearly less than an estimate, None where it is not.

    correlation: of the noise from reading to reading; correlated noise has fewer effective degrees of freedom; offset:
    variance of the offsets between series over that of the rest of the noise. Poses repeated within one series have the
    same offset; those repeated in a few series show few of them.
    """
    repeated, freedom = repeat_noise(measurements)
    if not freedom:
        return None
    expected, count = 1.0, float(freedom)
    if offset:
        # of one axis: mean and variance of the sum of squares, of a normal vector in the space of deviations
        shared, own = _shared_offsets(measurements), freedom / 3.0
        mean = own + offset * np.trace(shared)
        variance = 2.0 * (own + 2.0 * offset * np.trace(shared) + offset**2 * (shared**2).sum())
        expected, count = mean / own / (1.0 + offset), 3.0 * 2.0 * mean**2 / variance
    count *= (1.0 - correlation**2) / (1.0 + correlation**2)
    expected_mm = noise_mm * np.sqrt(expected)
    clearly = count >= ENOUGH_REPEATS and 0.0 < repeated < expected_mm * (1.0 - 3.0 / np.sqrt(2.0 * count))
    return float(repeated / np.sqrt(expected)) if clearly else None


def _shared_offsets(measurements: pd.DataFrame) -> np.ndarray:
    """Matrix (r, r): covariance of unit offsets of series in the deviations of repeated poses from their means."""
    frame, group = _repeated(measurements)
    of_series = np.unique(rows.series(frame), return_inverse=True)[1]
    members = np.zeros((group.max() + 1, of_series.max() + 1))
    np.add.at(members, (group, of_series), 1.0)
    of_means = members.T @ (members / members.sum(axis=1, keepdims=True))
    return np.asarray(np.diag(members.sum(axis=0)) - of_means)


def reading_series(measurements: pd.DataFrame, readings: Readings | None = None) -> np.ndarray:
    """Numbers (m,) of the smooth series in the rows of the readings of n points, by default positions.

    A series is a run, of each reflector separately, with orientations separate from positions.
    """
    number = rows.series(measurements)
    if readings is None:
        return number
    return np.concatenate([number, number.max() + number[readings.oriented]])
