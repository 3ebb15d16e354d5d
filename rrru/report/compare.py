"""Two calibrations of one kind of robot beside each other: which differs in what, and which one to trust.

Numbers differ beyond their errors where the chi-square of their differences, under the sum of both covariances, is
larger than chance makes it. Predictions are compared on points that neither calibration has seen. mm, rad.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import chi2, t

from rrru.campaign import measurements as rows
from rrru.compensate.evaluate import model_residual
from rrru.errors import ConfigError, FitError
from rrru.fit.campaign_fit import CalibrationSettings, deviation_vector, select
from rrru.fit.least_squares import least_squares
from rrru.store import facts, tables
from rrru.studies import setup

METHOD = "least_squares"
# with fewer trajectories or runs than this a campaign is cut into as many stretches
_FOLDS = 4
_READ = ("measurements", "parameters", "correlations", "calibrations", "gap_points")
_SAME = [f"{kind}_{axis}_mm" for kind in ("command", "measured") for axis in "xyz"]


@dataclass(frozen=True)
class Side:
    """One of the two: a name, the campaign, what it was calibrated as, its tables by name and its verdict."""

    name: str
    campaign: str
    told: dict
    frames: dict
    verdict: dict

    @property
    def settings(self):
        """How it was calibrated."""
        return CalibrationSettings.from_config(self.told["calibration"])


@dataclass(frozen=True)
class Difference:
    """Differences of fitted numbers: a row per parameter, their chi-square, its degrees of freedom, and how probable
    chance makes as much.
    """

    rows: pd.DataFrame
    chi_square: float
    freedom: int
    chance: float


@dataclass(frozen=True)
class Unseen:
    """Errors at points that neither side has seen.

    rows: per place, trajectory and side; points: how many; rms_mm (2,); better_mm2: mean of the squared error of the
    second less that of the first, its standard error over the runs, and the probability that chance makes as much.
    """

    rows: pd.DataFrame
    points: int
    rms_mm: tuple
    better_mm2: float
    error_mm2: float
    chance: float


def read(folder, campaign, name):
    """The Side of a campaign in a folder of results; raises ConfigError where it is not there or is not calibrated."""
    folder = Path(folder)
    if not folder.is_dir():
        raise ConfigError(f"compare: there is no folder {folder}")
    place = folder / "campaigns" / campaign
    known = calibrated(folder)
    if campaign not in known:
        raise ConfigError(
            f"compare: {folder} has no calibrated campaign {campaign!r}; it has {', '.join(known) or 'none'}"
        )
    missing = [one for one in _READ if not (place / f"{one}.parquet").is_file()]
    if missing or not (place / "verdict.json").is_file():
        wanted = ", ".join([*missing, "verdict.json"][:3])
        raise ConfigError(f"compare: {place} lacks {wanted}; run `snakemake` for it first")
    frames = {one: tables.read(place / f"{one}.parquet") for one in _READ}
    return Side(name, campaign, facts.read(place / "robot.json"), frames, facts.read(place / "verdict.json"))


def calibrated(folder):
    """Names of the campaigns of a folder of results that can be compared."""
    return [place.parent.name for place in sorted(Path(folder).glob("campaigns/*/robot.json"))]


def widest(first, second):
    """The set of trajectories that both are calibrated on, with most points; raises ConfigError where there is none."""
    counts = [
        side.frames["calibrations"].query("method == @METHOD").set_index("calibration")["points"]
        for side in (first, second)
    ]
    common = counts[0].index.intersection(counts[1].index)
    if common.empty:
        lists = _listed((first, second), (count.index for count in counts))
        raise ConfigError(f"compare: no set of trajectories that both are calibrated on; {lists}")
    total = counts[0][common] + counts[1][common]
    return total.sort_index().idxmax()


def _listed(sides, names):
    """Names of both sides for a message."""
    return " and ".join(f"{side.name}: {', '.join(own)}" for side, own in zip(sides, names, strict=True))


def check(first, second):
    """Raise ConfigError where the numbers of two sides mean different things."""
    one, other = first.told["nominal"], second.told["nominal"]
    if one["name"] != other["name"]:
        raise ConfigError(f"compare: {first.name} is of a robot {one['name']}, {second.name} of {other['name']}")
    for key in sorted({*one["dimensions"], *other["dimensions"]}):
        values = [nominal["dimensions"].get(key) for nominal in (one, other)]
        if values[0] != values[1]:
            what = f"{first.name} has {key} {values[0]}, {second.name} {values[1]}"
            raise ConfigError(f"compare: the nominal robots differ: {what}; deviations count from these")


def difference(first, second, calibration):
    """The Difference of two calibrations on a set; raises ConfigError where they have other parameters."""
    values, covariances = zip(*(_estimate(side, calibration) for side in (first, second)), strict=True)
    if list(values[0].index) != list(values[1].index):
        lists = _listed((first, second), (value.index for value in values))
        raise ConfigError(f"compare: calibrated with different numbers; {lists}")
    known = np.isfinite(np.diag(covariances[0])) & np.isfinite(np.diag(covariances[1]))
    step = (values[1]["value"] - values[0]["value"]).to_numpy()
    covariance = sum(covariances)[np.ix_(known, known)]
    error = np.sqrt([np.diag(one) for one in covariances])
    together = np.hypot(*error)
    square = float(step[known] @ np.linalg.solve(covariance, step[known])) if known.any() else 0.0
    frame = pd.DataFrame({"parameter": values[0].index, "unit": values[0]["unit"].to_numpy()})
    for side, value, own in zip("ab", values, error, strict=True):
        frame[side], frame[f"{side}_error"] = value["value"].to_numpy(), own
    frame = frame.assign(difference=step, in_errors=step / together)
    freedom = int(known.sum())
    return Difference(frame, square, freedom, float(chi2.sf(square, freedom)) if freedom else 1.0)


def _estimate(side, calibration):
    """Values of a calibration by parameter, and their covariance, NaN for what has no standard error."""
    own = side.frames["parameters"].query("calibration == @calibration and method == @METHOD").set_index("parameter")
    pairs = side.frames["correlations"].query("calibration == @calibration")
    matrix = pd.DataFrame(np.eye(len(own)), index=own.index, columns=own.index)
    for first, second, value in pairs[["parameter_a", "parameter_b", "correlation"]].itertuples(index=False):
        matrix.loc[first, second] = matrix.loc[second, first] = value
    error = own["standard_error"].where(own["seen"] & ~own["at_bound"]).to_numpy()
    return own, matrix.to_numpy() * np.outer(error, error)


def shared(first, second):
    """Points that both were measured at and read the same there: the same measurement."""
    return int(_rows_of(first.frames["measurements"], second.frames["measurements"]).sum())


def unseen(first, second, calibration):
    """The Unseen of two sides, None where neither can foretell the other's points.

    A point is foretold by the other campaign's calibration, which has not seen it, and by its own, fitted again without
    the trajectory that it lies on (the run or the stretch where there are few of them). What both have measured is left
    out of both.
    """
    parts = [_foretold(place, (first, second), calibration) for place in _places(first, second)]
    frame = pd.concat(parts, ignore_index=True).dropna()
    if frame.empty:
        return None
    frame["gain"] = frame["b"] ** 2 - frame["a"] ** 2
    by_run = frame.groupby(["place", "run"])["gain"].agg(["mean", "size"])
    gain, weight = float(frame["gain"].mean()), by_run["size"] / len(frame)
    count = len(by_run)
    spread = float(np.sqrt((weight**2 * (by_run["mean"] - gain) ** 2).sum() * count / max(count - 1, 1)))
    chance = float(2.0 * t.sf(abs(gain) / spread, count - 1)) if count > 1 and spread > 0.0 else 1.0
    sizes = frame.groupby(["place", "trajectory"], sort=False)
    table = sizes.agg(points=("a", "size"), a_rms_mm=("a", _rms), b_rms_mm=("b", _rms)).reset_index()
    return Unseen(table, len(frame), (_rms(frame["a"]), _rms(frame["b"])), gain, spread, chance)


def _places(first, second):
    """Sides whose points are asked for: one where both were measured together."""
    together = shared(first, second) == len(first.frames["measurements"]) == len(second.frames["measurements"])
    return (first,) if together else (first, second)


def _foretold(place, sides, calibration):
    """Errors (mm) of both sides at the points of one of them: place, trajectory, run, a, b."""
    measurements = place.frames["measurements"].reset_index(drop=True)
    usable = rows.usable(measurements, place.settings.use_near_singularity)
    chosen = usable & rows.on_trajectories(measurements, place.settings.sets[calibration])
    errors = measurements[["trajectory", "run"]].assign(place=place.campaign, a=np.nan, b=np.nan)
    for _, fold in measurements[chosen].groupby(_folds(measurements[chosen])):
        for letter, side in zip("ab", sides, strict=True):
            try:
                robot, deviations = _without(side, fold, calibration)
                made = model_residual(measurements.loc[fold.index], robot, deviations)
            except FitError:
                continue
            errors.loc[fold.index, letter] = made["error_mm"].to_numpy()
    return errors[chosen]


def _without(side, fold, calibration):
    """A side's robot and its deviations from all of its points but those of a fold."""
    own = side.frames["measurements"]
    robot = setup.measured_robot(side.told["nominal"], own)
    seen = _rows_of(own, fold)
    if not seen.any():
        return robot, deviation_vector(side.frames["parameters"], calibration, METHOD, robot)
    arm_mm = side.told["arm_mm"] or np.nan
    rest = rows.hold_out(own, seen)
    residuals = select(rest, robot, side.settings.sets[calibration], side.settings.use_near_singularity, arm_mm)
    if residuals is None:
        raise FitError(f"{side.name}: too few points are left")
    fit = least_squares(residuals, side.told["noise_mm"], side.settings.loss, side.settings.loss_scale_mm)
    return robot, fit.deviations


def _rows_of(measurements, others):
    """Rows (n,) of measurements that are among others: commanded and measured at the same place."""
    known = pd.MultiIndex.from_frame(others[_SAME].round(9))
    return pd.MultiIndex.from_frame(measurements[_SAME].round(9)).isin(known)


def _folds(measurements):
    """What points are left out together: their trajectory, their run, or a stretch."""
    for name in ("trajectory", "run"):
        if measurements[name].nunique() >= _FOLDS:
            return measurements[name].to_numpy()
    return np.arange(len(measurements)) * _FOLDS // max(len(measurements), 1)


def _rms(values):
    """Root mean square."""
    return float(np.sqrt((values**2).mean()))
