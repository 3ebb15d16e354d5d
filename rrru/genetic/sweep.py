"""Sweeps of the genetic algorithm's settings over many seeds, and significance tests of the settings' effect.

Every run goes to its last generation. The result of the same run stopped where it stalls is read from its history.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from rrru.arrays import FloatArray
from rrru.errors import ConfigError
from rrru.genetic.algorithm import minimise
from rrru.genetic.settings import GeneticSettings, Objective
from rrru.parameters import ParameterSet
from rrru.seeds import run_seed

SWEPT = ("crossover_fraction", "migration_fraction")
# columns that identify one sweep: operators, where runs stop, swept setting, one population or islands
SWEEP = ["operators", "stop", "parameter", "population"]
# level of significance of the tests, and one minus the confidence level of the intervals
_SIGNIFICANCE = 0.05
_BOOTSTRAP_RESAMPLES = 1999


def run_sweep(
    objective: Objective,
    parameters: ParameterSet,
    settings: GeneticSettings,
    parameter: str,
    value: float,
    seeds: Iterable[int],
    study_seed: int = 0,
) -> dict[str, pd.DataFrame]:
    """Frames by table name of the runs of the genetic algorithm at one value of one setting, one per seed number.

    objective, settings: see `algorithm.minimise`, but a stalled run continues to the end; parameters: ParameterSet;
    parameter: of the settings, one of SWEPT, set to `value`; seeds: seed numbers, each run's own seed being
    run_seed(study_seed, parameter, population, value, number) with population "one" or "islands". Raises ConfigError
    for another parameter or a value that is not allowed.
    """
    if parameter not in SWEPT:
        raise ConfigError(f"swept parameter is {parameter!r}; allowed: {', '.join(SWEPT)}")
    swept: dict[str, Any] = {parameter: value}
    settings = replace(settings, **swept)
    # PyGAD's "saturate" is equality
    stall = settings.stall_generations, 0.0 if settings.operators == "pygad" else settings.stall_tolerance
    kind = "one" if len(settings.populations) == 1 else "islands"
    frames: dict[str, list[pd.DataFrame]] = {"sweep_runs": [], "sweep_history": [], "sweep_parameters": []}
    for number in seeds:
        seed = run_seed(study_seed, parameter, kind, value, number)
        to_end = minimise(objective, parameters.low, parameters.high, replace(settings, stall_generations=0), seed)
        labels = {"operators": settings.operators, "parameter": parameter, "value": float(value)}
        labels |= {"population": kind, "seed": int(number)}
        frames["sweep_history"].append(to_end.history().assign(**labels))
        for stop, result in (("stall", to_end.stalled(*stall)), ("end", to_end)):
            found = {"name": parameters.names, "unit": parameters.units, "deviation": result.deviations}
            frames["sweep_runs"].append(pd.DataFrame([result.row()]).assign(stop=stop, **labels))
            frames["sweep_parameters"].append(pd.DataFrame(found).assign(stop=stop, **labels))
    return {name: pd.concat(parts, ignore_index=True) for name, parts in frames.items()}


def setting_effect(runs: pd.DataFrame) -> pd.DataFrame:
    """Whether the values of a setting differ at all in the objective they reach: one row per SWEEP of a table of runs.

    Columns: those of SWEEP, settings (number of values), runs, statistic and p_value of the Kruskal-Wallis test
    over all values, epsilon_squared = H / (n - 1), the share of the rank variance that the settings explain (Tomczak
    and Tomczak 2014), and the same three ending in _mutating without the crossover fraction 1.0, where nothing mutates;
    distinguishable_mutating: that p below 5 %. Equal objectives everywhere, or fewer than two values, give p = 1.
    """
    rows = []
    for key, group in runs.groupby(SWEEP):
        label = dict(zip(SWEEP, key, strict=True))
        # at 1.0 MATLAB's step does not mutate; PyGAD's does
        can_lack_mutation = label["parameter"] == "crossover_fraction" and label["operators"] != "pygad"
        mutates = group["value"] < 1.0 if can_lack_mutation else np.full(len(group), True)
        every = _kruskal(group)
        mutating = every if mutates.all() else _kruskal(group[mutates])
        rows.append(
            label
            | {"settings": group["value"].nunique(), "runs": len(group)}
            | every
            | {f"{name}_mutating": value for name, value in mutating.items()}
            | {"distinguishable_mutating": mutating["p_value"] < _SIGNIFICANCE}
        )
    return pd.DataFrame(rows)


def setting_pairs(runs: pd.DataFrame, seed: int = 0) -> pd.DataFrame:
    """Difference of each setting from the best one: a row per value except the best, of each SWEEP of runs.

    Columns: those of SWEEP, value, best_value (lowest median objective), median_mm, difference_mm (of the
    medians, value minus best) with its 95 % percentile-bootstrap interval difference_low_mm, difference_high_mm (NaN
    with a single run or infeasible ones), p_value (Mann-Whitney, two-sided), p_holm (corrected over the values of the
    group), distinguishable (p_holm below 5 %). The best value is chosen from the same runs, which biases the
    differences upwards. seed: of the bootstrap.
    """
    from scipy import stats

    rows = []
    for key, group in runs.groupby(SWEEP):
        samples = {value: part.to_numpy() for value, part in group.groupby("value")["objective_mm"]}
        best = min(samples, key=lambda value: np.median(samples[value]))
        pairs = []
        for value, sample in samples.items():
            if value != best:
                pair_seed = run_seed(seed, *key, value)
                label = dict(zip(SWEEP, key, strict=True)) | {"value": value, "best_value": best}
                test = {"p_value": float(stats.mannwhitneyu(sample, samples[best]).pvalue)}
                difference = _median_difference(sample, samples[best], pair_seed)
                pairs.append(label | {"median_mm": float(np.median(sample))} | difference | test)
        for pair, corrected in zip(pairs, _holm([pair["p_value"] for pair in pairs]), strict=True):
            rows.append(pair | {"p_holm": corrected, "distinguishable": corrected < _SIGNIFICANCE})
    return pd.DataFrame(rows)


def _kruskal(group: pd.DataFrame) -> dict[str, float]:
    """Kruskal-Wallis test of the objective over the values of a group of runs: statistic, p value, epsilon squared."""
    from scipy import stats

    samples = [part.to_numpy() for _, part in group.groupby("value")["objective_mm"]]
    if len(samples) < 2 or group["objective_mm"].nunique() < 2:
        return {"statistic": 0.0, "p_value": 1.0, "epsilon_squared": 0.0}
    test = stats.kruskal(*samples)
    share = float(test.statistic / (len(group) - 1))
    return {"statistic": float(test.statistic), "p_value": float(test.pvalue), "epsilon_squared": share}


def _median_difference(sample: FloatArray, reference: FloatArray, seed: int) -> dict[str, float]:
    """Difference of the medians and its 95 % percentile-bootstrap interval, each NaN where it is undefined."""
    from scipy import stats

    names = ("difference_mm", "difference_low_mm", "difference_high_mm")
    if not np.isfinite([*sample, *reference]).all():
        return dict.fromkeys(names, np.nan)
    difference = float(np.median(sample) - np.median(reference))
    if min(len(sample), len(reference)) < 2:
        return dict(zip(names, (difference, np.nan, np.nan), strict=True))
    interval = stats.bootstrap(
        (sample, reference),
        lambda a, b, axis=-1: np.median(a, axis=axis) - np.median(b, axis=axis),
        n_resamples=_BOOTSTRAP_RESAMPLES,
        confidence_level=1.0 - _SIGNIFICANCE,
        method="percentile",
        vectorized=True,
        rng=np.random.default_rng(seed),
    ).confidence_interval
    return dict(zip(names, (difference, float(interval.low), float(interval.high)), strict=True))


def _holm(p_values: Sequence[float]) -> list[float]:
    """P values adjusted by Holm's step-down method (S. Holm 1979), in the order given; SciPy does not have it."""
    corrected, floor = [0.0] * len(p_values), 0.0
    for rank, index in enumerate(np.argsort(p_values, kind="stable")):
        floor = max(floor, min(1.0, (len(p_values) - rank) * p_values[index]))
        corrected[index] = floor
    return corrected
