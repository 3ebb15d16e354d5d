"""Which of two calibrations predicts better, at points that neither has used. Errors in mm."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.stats import t

from rrru.calibration.calibrate import calibrate
from rrru.calibration.campaign_fit import deviation_vector, select
from rrru.campaign import measurements as rows
from rrru.compensation.evaluate import model_residual
from rrru.errors import FitError
from rrru.kinematics.robot import Robot
from rrru.pipeline import setup
from rrru.report.compare import METHOD, Side, over_runs

# with fewer trajectories or runs than this a campaign is cut into as many stretches
_FOLDS = 4
# stretches that a few runs are cut into to judge chance, of so many points at least
_STRETCHES, _LEAST_STRETCH = 12, 3
_SAME = [f"{kind}_{axis}_mm" for kind in ("command", "measured") for axis in "xyz"]


@dataclass(frozen=True)
class Unseen:
    """Errors at points of one campaign that neither side has seen.

    rows: per trajectory; points: how many; rms_mm (2,): of both sides; gain_mm2: mean squared error of the second less
    that of the first; chance: p-value of the gain, over the runs.
    """

    campaign: str
    rows: pd.DataFrame
    points: int
    rms_mm: tuple[float, float]
    gain_mm2: float
    chance: float


def same_points(first: Side, second: Side) -> int:
    """Points that both were measured at and read the same there: the same measurement."""
    return int(_rows_of(first.frames["measurements"], second.frames["measurements"]).sum())


def unseen(first: Side, second: Side, calibration: str) -> list[Unseen]:
    """The Unseen of each campaign that has points which neither side has used.

    A point is predicted by the other campaign's calibration, which has not used it. It is also predicted by its own,
    fitted again without the trajectory of the point (the run or the stretch where there are few of them). Points that
    both have measured are left out of both.
    """
    found = [(place, _prediction_errors(place, (first, second), calibration)) for place in _places(first, second)]
    return [_compared(place.campaign, frame) for place, frame in found if len(frame)]


def _compared(campaign: str, frame: pd.DataFrame) -> Unseen:
    """The Unseen of errors (mm) a and b with their trajectory and run."""
    frame = frame.assign(gain=frame["b"] ** 2 - frame["a"] ** 2)
    drawn = _drawn(frame["run"])
    gain, error = over_runs(frame["gain"], drawn)
    count = drawn.nunique()
    chance = float(2.0 * t.sf(abs(gain) / error, count - 1)) if error > 0.0 and count > 1 else 1.0
    table = frame.groupby("trajectory", sort=False).agg(
        points=("a", "size"), a_rms_mm=("a", _rms), b_rms_mm=("b", _rms)
    )
    table = table.reset_index()
    table.insert(0, "measured_in", campaign)
    return Unseen(campaign, table, len(frame), (_rms(frame["a"]), _rms(frame["b"])), gain, chance)


def _drawn(run: pd.Series) -> pd.Series:
    """Units of resampling of points in runs (n,): the runs, or stretches of points where there are few of them."""
    if run.nunique() >= _FOLDS:
        return run
    count = min(_STRETCHES, len(run) // _LEAST_STRETCH)
    return pd.Series(np.arange(len(run)) * max(count, 1) // max(len(run), 1), index=run.index)


def _places(first: Side, second: Side) -> tuple[Side, ...]:
    """Sides whose points are predicted: one where both were measured together."""
    together = same_points(first, second) == len(first.frames["measurements"]) == len(second.frames["measurements"])
    return (first,) if together else (first, second)


def _prediction_errors(place: Side, sides: tuple[Side, Side], calibration: str) -> pd.DataFrame:
    """Errors (mm) of both sides, a and b, at the points of one of them, with their trajectory and run."""
    measurements = place.frames["measurements"].reset_index(drop=True)
    usable = rows.usable(measurements, place.settings.use_near_singularity)
    chosen = usable & rows.on_trajectories(measurements, place.settings.sets[calibration])
    errors = measurements[["trajectory", "run"]].assign(a=np.nan, b=np.nan)
    for _, fold in measurements[chosen].groupby(_folds(measurements[chosen])):
        for letter, side in zip("ab", sides, strict=True):
            try:
                robot, deviations = _without(side, fold, calibration)
                made = model_residual(measurements.loc[fold.index], robot, deviations)
            except FitError:
                continue
            errors.loc[fold.index, letter] = made["error_mm"].to_numpy()
    return errors[chosen].dropna()


def _without(side: Side, fold: pd.DataFrame, calibration: str) -> tuple[Robot, np.ndarray]:
    """A side's robot and its deviations from all of its points except those of a fold."""
    measurements = side.frames["measurements"]
    robot = setup.measured_robot(side.saved["nominal"], measurements)
    seen = _rows_of(measurements, fold)
    if not seen.any():
        return robot, deviation_vector(side.frames["parameters"], calibration, METHOD, robot)
    characteristic_length_mm = side.saved["arm_mm"] or np.nan
    remaining = rows.hold_out(measurements, seen)
    residuals = select(
        remaining, robot, side.settings.sets[calibration], side.settings.use_near_singularity, characteristic_length_mm
    )
    if residuals is None:
        raise FitError(f"{side.name}: too few points are left")
    fit = calibrate(residuals, side.saved["noise_mm"], side.settings.loss, side.settings.loss_scale_mm)
    return robot, fit.deviations


def _rows_of(measurements: pd.DataFrame, others: pd.DataFrame) -> np.ndarray:
    """Rows (n,) of measurements that are among others: commanded and measured at the same place."""
    known = pd.MultiIndex.from_frame(others[_SAME].round(9))
    return np.asarray(pd.MultiIndex.from_frame(measurements[_SAME].round(9)).isin(known))


def _folds(measurements: pd.DataFrame) -> np.ndarray:
    """Groups of points that are left out together: their trajectory, their run, or a stretch."""
    for name in ("trajectory", "run"):
        if measurements[name].nunique() >= _FOLDS:
            return np.asarray(measurements[name].to_numpy())
    return np.arange(len(measurements)) * _FOLDS // max(len(measurements), 1)


def _rms(values: pd.Series) -> float:
    """Root mean square."""
    return float(np.sqrt((values**2).mean()))
