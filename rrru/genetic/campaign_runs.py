"""The genetic algorithm on the calibrations of one campaign, beside the optimum that it should find."""

from time import perf_counter

import numpy as np
import pandas as pd

from rrru.fit.campaign_fit import select
from rrru.fit.least_squares import least_squares
from rrru.fit.mean_distance import least_mean_distance
from rrru.genetic.algorithm import minimise
from rrru.genetic.sweep import kept_generations
from rrru.robots.protocol import identifiable_truth
from rrru.seeds import run_seed


def study_set(
    measurements,
    tied,
    identifiable,
    calibration,
    patterns,
    settings,
    seeds,
    study_seed,
    labels=(),
    use_near_singularity=True,
):
    """Runs of the genetic algorithm on one calibration set.

    tied, identifiable: the mechanism with the searched and with the identifiable error parameters, 8 and 7 of the
    3-RRRU; seeds: number of runs, seeded by the study's seed and the labels. Returns (runs, history, timings) as frames
    without the campaign's name, or None where the campaign has too few points for the set.
    """
    residuals = select(measurements, tied, patterns, use_near_singularity)
    if residuals is None:
        return None
    reduced = select(measurements, identifiable, patterns, use_near_singularity)
    fit, fit_seconds = _timed(lambda: least_squares(reduced))
    best, polish_seconds = _timed(lambda: least_mean_distance(reduced, fit.deviations))
    optimum = best.mean_mm
    names, bounds = tied.parameters.names, (tied.parameters.low, tied.parameters.high)
    # the compiled objective is loaded before anything is timed
    residuals.mean_distance(tied.parameters.nominal[None])
    runs, history, seconds = [], [], []
    for number in range(1, seeds + 1):
        seed = run_seed(study_seed, "genetic", *labels, calibration, number)
        start = perf_counter()
        result = minimise(residuals.mean_distance, *bounds, settings, seed)
        seconds.append(perf_counter() - start)
        values = dict(zip(names, result.deviations.tolist(), strict=True))
        shared = identifiable_truth(identifiable, values)
        polish = least_mean_distance(reduced, identifiable.parameters.vector(shared))
        runs.append(
            {
                "calibration": calibration,
                "seed": number,
                "objective_mm": result.objective,
                "generations": result.generations,
            }
            | {
                "evaluations": result.evaluations,
                "stopped": result.stopped,
                "polished_mm": polish.mean_mm,
                "optimum_mm": optimum,
            }
            | {"polish_evaluations": polish.evaluations, "excess": _excess(result.objective, optimum)}
            | {"polished_excess": _excess(polish.mean_mm, optimum)}
            | values
            | shared
        )
        kept = kept_generations(result.generations)
        columns = {"generation": kept, "best_mm": result.best_history[kept], "mean_mm": result.mean_history[kept]}
        history.append(pd.DataFrame({"calibration": calibration, "seed": number} | columns))
    timings = pd.DataFrame(
        {
            "calibration": calibration,
            "method": ["least_squares", "least_mean_distance", "genetic"],
            "seconds": [fit_seconds, fit_seconds + polish_seconds, float(np.median(seconds))],
        }
    )
    return pd.DataFrame(runs), pd.concat(history, ignore_index=True), timings


def typical_parameters(runs, names):
    """Rows of `parameters` for method "genetic": of each calibration the run whose objective is the (lower) median of
    the seeds.

    runs: rows of `genetic` of one campaign; names: identifiable parameters. A single run is what the paper has.
    """
    frames = []
    for calibration, part in runs.groupby("calibration", sort=False):
        typical = part.sort_values(["objective_mm", "seed"]).iloc[(len(part) - 1) // 2]
        frames.append(
            pd.DataFrame(
                {
                    "calibration": calibration,
                    "method": "genetic",
                    "parameter": names,
                    "value": [typical[n] for n in names],
                }
            )
        )
    return pd.concat(frames, ignore_index=True)


def against_least_squares(runs, calibrations, parameters, truth):
    """Rows of `genetic_against_least_squares` of one campaign (without its name).

    runs, calibrations, parameters: rows of `genetic`, `calibrations` and `parameters` of that campaign; truth: the true
    errors by identifiable name, or None where nobody knows them.
    """
    units = dict(zip(parameters["parameter"], parameters["unit"], strict=True))
    result = []
    for calibration, part in runs.groupby("calibration", sort=False):
        optimum = part["optimum_mm"].iloc[0]
        fits = calibrations[calibrations["calibration"] == calibration]
        for row in fits.itertuples():
            values = parameters[(parameters["calibration"] == calibration) & (parameters["method"] == row.method)]
            found = dict(zip(values["parameter"], values["value"], strict=True))
            result.append(
                {
                    "calibration": calibration,
                    "method": row.method,
                    "runs": 1,
                    "mean_mm": row.mean_mm,
                    "worst_mean_mm": row.mean_mm,
                }
                | {"excess": _excess(row.mean_mm, optimum), "evaluations": float(row.evaluations)}
                | _parameter_error(pd.DataFrame([found]), truth, units)
            )
        for method, column, more in (
            ("genetic", "objective_mm", 0),
            ("genetic_polished", "polished_mm", part["polish_evaluations"]),
        ):
            middle = part[column].median()
            result.append(
                {
                    "calibration": calibration,
                    "method": method,
                    "runs": len(part),
                    "mean_mm": middle,
                    "worst_mean_mm": part[column].max(),
                }
                | {"excess": _excess(middle, optimum), "evaluations": float((part["evaluations"] + more).median())}
                | (
                    _parameter_error(part, truth, units)
                    if method == "genetic"
                    else {"angle_error_rad": np.nan, "length_error_mm": np.nan}
                )
            )
    return pd.DataFrame(result)


def _excess(value, optimum):
    """Share by which a mean distance exceeds the least one; NaN where that is zero but for rounding."""
    return value / optimum - 1.0 if optimum > 1e-9 else np.nan


def _parameter_error(values, truth, units):
    """RMS deviation of angles and lengths from the truth over all rows of a frame of identifiable parameters."""
    if truth is None:
        return {"angle_error_rad": np.nan, "length_error_mm": np.nan}
    error = {}
    for key, unit in (("angle_error_rad", "rad"), ("length_error_mm", "mm")):
        names = [name for name in truth if units[name] == unit]
        # NaN where the legs of the real robot differ, so that there is no true value
        error[key] = float(np.sqrt(np.mean([(values[name] - truth[name]) ** 2 for name in names])))
    return error


def _timed(function):
    """Result of a call and the median of three wall times in s, compilation excluded."""
    result = function()
    seconds = []
    for _ in range(3):
        start = perf_counter()
        function()
        seconds.append(perf_counter() - start)
    return result, float(np.median(seconds))
