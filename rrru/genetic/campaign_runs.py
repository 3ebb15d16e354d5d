"""The genetic algorithm on the calibrations of one campaign, compared with the optimum that it should find."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from time import perf_counter

import numpy as np
import pandas as pd

from rrru.calibration.calibrate import Calibration, calibrate
from rrru.calibration.mean_distance import least_mean_distance
from rrru.estimation.observations.target_positions import TargetPositions
from rrru.genetic.algorithm import minimise
from rrru.genetic.settings import GeneticSettings
from rrru.parameters import Parameter
from rrru.seeds import run_seed


@dataclass(frozen=True)
class Runs:
    """Runs of one campaign: GeneticSettings, the number of runs, and the labels of their seeds."""

    settings: GeneticSettings
    seeds: int
    study_seed: int
    labels: tuple[str, ...] = ()


def study_set(
    searched: TargetPositions, identified: TargetPositions, calibration: str, runs: Runs
) -> dict[str, pd.DataFrame]:
    """Frames by table name, without the campaign's name: the Runs on one calibration set, called `calibration`.

    searched, identified: Residuals of its points under the searched and under the identifiable parameters, of the
    3-RRRU 8 and 7; each run is polished locally in the latter.
    """
    parameters, mechanism = searched.mechanism.parameters, identified.mechanism
    fit, fit_seconds = _timed(lambda: calibrate(identified))
    best, polish_seconds = _timed(lambda: least_mean_distance(identified, fit.deviations))
    # the compiled objective is loaded before anything is timed
    searched.mean_distance(parameters.nominal[None])
    frames: dict[str, list[pd.DataFrame]] = {"genetic": [], "genetic_history": [], "genetic_parameters": []}
    seconds = []
    for number in range(1, runs.seeds + 1):
        seed = run_seed(runs.study_seed, "genetic", *runs.labels, calibration, number)
        start = perf_counter()
        result = minimise(searched.mean_distance, parameters.low, parameters.high, runs.settings, seed)
        seconds.append(perf_counter() - start)
        shared = mechanism.identifiable(parameters.mapping(result.deviations))
        polish = least_mean_distance(identified, mechanism.parameters.vector(shared))
        polished = {"polished_mm": polish.mean_mm, "polish_evaluations": polish.evaluations}
        above = {"excess": result.objective, "polished_excess": polish.mean_mm}
        row = result.row() | polished | {"optimum_mm": best.mean_mm}
        row |= {name: _excess(value, best.mean_mm) for name, value in above.items()}
        found = dict(zip(parameters, result.deviations, strict=True)) | {
            parameter: shared[parameter.name]
            for parameter in mechanism.parameters
            if parameter.name not in parameters.names
        }
        parts = pd.DataFrame([row]), result.history(), parameter_rows(found)
        for name, part in zip(frames, parts, strict=True):
            frames[name].append(part.assign(seed=number))
    spent = {"least_squares": fit_seconds, "least_mean_distance": fit_seconds + polish_seconds}
    timings = pd.DataFrame((spent | {"genetic": float(np.median(seconds))}).items(), columns=["method", "seconds"])
    tables = {name: pd.concat(parts, ignore_index=True) for name, parts in frames.items()} | {"timings": timings}
    return {name: frame.assign(calibration=calibration) for name, frame in tables.items()}


def parameter_rows(found: Mapping[Parameter, float]) -> pd.DataFrame:
    """Columns parameter, unit and value of {Parameter: value}."""
    rows = [(parameter.name, parameter.unit, value) for parameter, value in found.items()]
    return pd.DataFrame(rows, columns=["parameter", "unit", "value"])


def typical_parameters(runs: pd.DataFrame, found: pd.DataFrame, names: Iterable[str]) -> pd.DataFrame:
    """Rows of `parameters` for method "genetic": of each calibration the run of (lower) median objective.

    runs, found: rows of `genetic` and `genetic_parameters` of one campaign; names: of the parameters. A single run is
    what the paper has.
    """
    ranked = runs.sort_values(["calibration", "objective_mm", "seed"])
    place = ranked.groupby("calibration").cumcount()
    middle = (ranked.groupby("calibration")["seed"].transform("size") - 1) // 2
    key = ["calibration", "seed"]
    chosen = runs[key].merge(ranked.loc[place == middle, key])
    rows = chosen.merge(pd.DataFrame({"parameter": names}), how="cross").merge(found, on=[*key, "parameter"])
    return rows.assign(method="genetic")[["calibration", "method", "parameter", "value"]]


def against_least_squares(
    runs: pd.DataFrame,
    found: pd.DataFrame,
    calibrations: pd.DataFrame,
    parameters: pd.DataFrame,
    truth: Mapping[str, float] | None,
) -> pd.DataFrame:
    """Rows of `genetic_against_least_squares` of one campaign (without its name).

    runs, found, calibrations, parameters: rows of `genetic`, `genetic_parameters`, `calibrations` and `parameters` of
    that campaign; truth: the true deviations by identifiable name, or None where they are unknown.
    """
    result = []
    for calibration, part in runs.groupby("calibration", sort=False):
        tables = calibrations, parameters, found
        fits, fitted, genetic = (table[table["calibration"] == calibration] for table in tables)
        for row in fits.itertuples():
            errors = _parameter_error(fitted[fitted["method"] == row.method], truth)
            reached = {"runs": 1, "mean_mm": row.mean_mm, "worst_mean_mm": row.mean_mm}
            label = {"calibration": calibration, "method": row.method, "evaluations": float(row.evaluations)}
            result.append(label | reached | errors)
        for method, column, more in (
            ("genetic", "objective_mm", 0),
            ("genetic_polished", "polished_mm", part["polish_evaluations"]),
        ):
            errors = _parameter_error(genetic, truth if method == "genetic" else None)
            evaluations = float((part["evaluations"] + more).median())
            reached = {"runs": len(part), "mean_mm": part[column].median(), "worst_mean_mm": part[column].max()}
            label = {"calibration": calibration, "method": method, "evaluations": evaluations}
            result.append(label | reached | errors)
    compared = pd.DataFrame(result)
    optima = compared["calibration"].map(runs.groupby("calibration")["optimum_mm"].first())
    return compared.assign(excess=[_excess(*pair) for pair in zip(compared["mean_mm"], optima, strict=True)])


def _excess(value: float, optimum: float) -> float:
    """Share by which a mean distance exceeds the least one; NaN where that is zero up to rounding."""
    return value / optimum - 1.0 if optimum > 1e-9 else np.nan


def _parameter_error(rows: pd.DataFrame, truth: Mapping[str, float] | None) -> dict[str, float]:
    """RMS deviation of angles and of lengths from the truth over rows of parameters; NaN where it is unknown.

    Also NaN where the legs of the real robot differ, so that there is no true value.
    """
    truth = truth or {}
    units = rows.groupby("parameter")["unit"].first() if truth else {}
    error = {}
    for key, unit in (("angle_error_rad", "rad"), ("length_error_mm", "mm")):
        names = [name for name in truth if units[name] == unit]
        apart = [rows.loc[rows["parameter"] == name, "value"].to_numpy() - truth[name] for name in names]
        error[key] = float(np.sqrt(np.mean(np.square(apart)))) if names else np.nan
    return error


def _timed(function: Callable[[], Calibration]) -> tuple[Calibration, float]:
    """Result of a call and the wall time in s of a second one, compilation excluded."""
    result, start = function(), perf_counter()
    function()
    return result, perf_counter() - start
