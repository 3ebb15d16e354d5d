"""Two calibrated campaigns of one kind of robot: whether their parameters, or their gaps, differ beyond their errors.

Lengths in mm, angles in rad; sizes of gaps are 3-D root mean squares.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import chi2, norm

from rrru.calibration.campaign_fit import CalibrationSettings
from rrru.campaign import measurements as rows
from rrru.errors import ConfigError
from rrru.estimation.intervals import QUANTILE_95
from rrru.report.worth import gap_squares
from rrru.store import json_files, tables

METHOD = "least_squares"
# first letters of parameters of the instrument's frame
_FRAME = "world_"
_READ = ("measurements", "parameters", "correlations", "calibrations", "gap_points")

_PARTS = ("effect", "scatter", "runs", "unexplained")


@dataclass(frozen=True)
class Side:
    """One of the two: a name, the campaign, what it was calibrated as, its tables by name and its verdict."""

    name: str
    campaign: str
    saved: dict[str, Any]
    frames: dict[str, pd.DataFrame]
    verdict: dict[str, Any]

    @property
    def settings(self) -> CalibrationSettings:
        """How it was calibrated."""
        return CalibrationSettings.from_config(self.saved["calibration"])


@dataclass(frozen=True)
class Difference:
    """Differences of fitted parameters: a row per parameter, their chi-square, its degrees of freedom and p-value."""

    rows: pd.DataFrame
    chi_square: float
    freedom: int
    chance: float


def read(folder: str | Path, campaign: str, name: str) -> Side:
    """The Side of a campaign in a folder of results; raises ConfigError where it is not there or is not calibrated."""
    folder = Path(folder)
    if not folder.is_dir():
        raise ConfigError(f"compare: there is no folder {folder}; allowed: a folder of results")
    place = folder / "campaigns" / campaign
    known = calibrated(folder)
    if campaign not in known:
        raise ConfigError(
            f"compare: {folder} has no calibrated campaign {campaign!r}; it has {', '.join(known) or 'none'}"
        )
    missing = [table for table in _READ if not (place / f"{table}.parquet").is_file()]
    if missing or not (place / "verdict.json").is_file():
        wanted = ", ".join([*missing, "verdict.json"][:3])
        raise ConfigError(f"compare: {place} lacks {wanted}; run `snakemake` for it first")
    frames = {table: tables.read(place / f"{table}.parquet") for table in _READ}
    return Side(name, campaign, json_files.read(place / "robot.json"), frames, json_files.read(place / "verdict.json"))


def calibrated(folder: str | Path) -> list[str]:
    """Names of the campaigns of a folder of results that can be compared."""
    return [place.parent.name for place in sorted(Path(folder).glob("campaigns/*/robot.json"))]


def widest(first: Side, second: Side) -> str:
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
    return str(total.sort_index().idxmax())


def _listed(sides: tuple[Side, Side], names: Iterable[Iterable[str]]) -> str:
    """Names of both sides for a message."""
    return " and ".join(f"{side.name}: {', '.join(listed)}" for side, listed in zip(sides, names, strict=True))


def check(first: Side, second: Side) -> None:
    """Raise ConfigError where the parameters of two sides are not comparable."""
    one, other = first.saved["nominal"], second.saved["nominal"]
    if one["name"] != other["name"]:
        raise ConfigError(f"compare: {first.name} is of a robot {one['name']}, {second.name} of {other['name']}")
    for key in sorted({*one["dimensions"], *other["dimensions"]}):
        values = [nominal["dimensions"].get(key) for nominal in (one, other)]
        if values[0] != values[1]:
            what = f"{first.name} has {key} {values[0]}, {second.name} {values[1]}"
            raise ConfigError(
                f"compare: the nominal robots differ: {what}; allowed: the same dimensions, from which deviations count"
            )
    read = _read_in(first), _read_in(second)
    if read[0] != read[1]:
        what = f"of {first.name} {read[0]}, of {second.name} {read[1]}"
        raise ConfigError(f"compare: the readings differ: {what}; allowed: campaigns with the same readings")


def _read_in(side: Side) -> str:
    """What was read in a campaign, in words."""
    measurements = side.frames["measurements"]
    named = sorted(measurements["target"].dropna().unique()) if "target" in measurements else ["the tool"]
    return ", ".join(named) + (", with orientations" if rows.has_turns(measurements) else "")


def difference(first: Side, second: Side, calibration: str) -> Difference:
    """The Difference of two calibrations on a set; raises ConfigError where they have other parameters."""
    values, covariances = zip(*(_estimate(side, calibration) for side in (first, second)), strict=True)
    if list(values[0].index) != list(values[1].index):
        raise ConfigError(f"compare: {_other_numbers((first, second), [set(value.index) for value in values])}")
    known = np.isfinite(np.diag(covariances[0])) & np.isfinite(np.diag(covariances[1]))
    step = (values[1]["value"] - values[0]["value"]).to_numpy()
    covariance = sum(covariances)[np.ix_(known, known)]
    error = np.sqrt([np.diag(one) for one in covariances])
    together = np.hypot(*error)
    square = float(step[known] @ np.linalg.solve(covariance, step[known])) if known.any() else 0.0
    frame = pd.DataFrame({"parameter": values[0].index, "unit": values[0]["unit"].to_numpy()})
    numbers = (("a", values[0]["value"], error[0]), ("b", values[1]["value"], error[1]), ("difference", step, together))
    for name, value, sd in numbers:
        frame[name] = np.asarray(value)
        frame[f"{name}_low"], frame[f"{name}_high"] = (frame[name] + sign * QUANTILE_95 * sd for sign in (-1, 1))
    freedom = int(known.sum())
    return Difference(frame, square, freedom, float(chi2.sf(square, freedom)) if freedom else 1.0)


def _other_numbers(sides: tuple[Side, Side], names: Sequence[set[str]]) -> str:
    """Why two sides with different parameters cannot be compared."""
    only = [sorted(names[k] - names[1 - k]) for k in range(2)]
    if all(name.startswith(_FRAME) for name in only[0] + only[1]):
        with_frame = sides[0] if only[0] else sides[1]
        without = sides[1] if only[0] else sides[0]
        return (
            f"of {with_frame.name} the instrument's frame is calibrated, too ({', '.join(only[0] + only[1])}), "
            f"of {without.name} it is not; give both campaigns the same `frame`: robot or register"
        )
    lists = _listed(sides, (names_of or ["nothing more"] for names_of in only))
    return f"calibrated with different parameters; {lists}"


def _estimate(side: Side, calibration: str) -> tuple[pd.DataFrame, np.ndarray]:
    """Values of a calibration by parameter, and their covariance, NaN for what has no standard error."""
    values = side.frames["parameters"].query("calibration == @calibration and method == @METHOD").set_index("parameter")
    pairs = side.frames["correlations"].query("calibration == @calibration")
    matrix = pd.DataFrame(np.eye(len(values)), index=values.index, columns=values.index)
    for first, second, value in pairs[["parameter_a", "parameter_b", "correlation"]].itertuples(index=False):
        matrix.loc[first, second] = matrix.loc[second, first] = value
    error = values["standard_error"].where(values["seen"] & ~values["at_bound"]).to_numpy()
    return values, matrix.to_numpy() * np.outer(error, error)


def over_runs(values: pd.Series, runs: pd.Series) -> tuple[float, float]:
    """Mean of values (n,) and its standard error, with runs as independent units; 0 where there is one run."""
    by_run = values.groupby(runs).agg(["mean", "size"])
    mean, weight, count = values.mean(), by_run["size"] / len(values), len(by_run)
    square = (weight**2 * (by_run["mean"] - mean) ** 2).sum() * count / max(count - 1, 1)
    return float(mean), float(np.sqrt(square))


@dataclass(frozen=True)
class GapDifference:
    """rows: parts with their size and its 95 % interval on both sides, and whether the intervals are apart; chance: the
    probability that chance makes the gaps of both sides as different as they are.
    """

    rows: pd.DataFrame
    chance: float


def gap_difference(first: Side, second: Side) -> GapDifference:
    """The GapDifference of two Sides."""
    squares = [_square(side) for side in (first, second)]
    apart = squares[1][0] - squares[0][0]
    error = float(np.hypot(squares[0][1], squares[1][1]))
    names = dict.fromkeys(part["part"] for side in (first, second) for part in _sized_parts(side))
    listed = [{part["part"]: part for part in _sized_parts(side)} for side in (first, second)]
    rows = [
        _part_row(name, *(_interval(side, part.get(name)) for side, part in zip((first, second), listed, strict=True)))
        for name in names
    ]
    rows = [row for row in rows if row["a_rms_mm"] > 0.0 or row["b_rms_mm"] > 0.0]
    return GapDifference(pd.DataFrame(rows), float(2.0 * norm.sf(abs(apart) / error)) if error > 0.0 else 1.0)


def _sized_parts(side: Side) -> list[dict[str, Any]]:
    """Parts of the budget that are sizes."""
    return [part for part in side.verdict["budget"] if part["kind"] in _PARTS]


def _square(side: Side) -> tuple[float, float]:
    """Mean square of the gap, noise subtracted, and its standard error over the runs."""
    points = side.frames["gap_points"].query("used")
    mean, error = over_runs(gap_squares(points), points["run"])
    return mean - side.verdict["noise_rms_mm"] ** 2, error


def _interval(side: Side, part: Mapping[str, Any] | None) -> tuple[float, float, float]:
    """Size of a part with its 95 % interval, zeros where the side does not have it."""
    if part is None:
        return 0.0, 0.0, 0.0
    # shares are of what all parts together make
    whole = part["rms_mm"] ** 2 / part["share"] if part["share"] > 0.0 else 0.0
    return part["rms_mm"], *(float(np.sqrt(max(part[end], 0.0) * whole)) for end in ("share_low", "share_high"))


def _part_row(name: str, first: tuple[float, float, float], second: tuple[float, float, float]) -> dict[str, Any]:
    """A row of both sides' sizes and intervals."""
    row: dict[str, Any] = {"part": name}
    for side, (size, low, high) in zip("ab", (first, second), strict=True):
        row |= {f"{side}_rms_mm": size, f"{side}_low_mm": low, f"{side}_high_mm": high}
    return row | {"differs": first[2] < second[1] or second[2] < first[1]}
