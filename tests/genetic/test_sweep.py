"""Sweeps: seeds, tables, and statistics against published and hand-made numbers."""

import math

import numpy as np
import pandas as pd
import pytest

from rrru.errors import ConfigError
from rrru.genetic import sweep
from rrru.genetic.algorithm import minimise
from rrru.genetic.schemas import TABLES
from rrru.genetic.settings import GeneticSettings
from rrru.parameters import Parameter, ParameterSet
from rrru.seeds import run_seed

PARAMETERS = ParameterSet((Parameter("a", "mm", 0.0, -1.0, 1.0), Parameter("b", "rad", 0.0, -2.0, 2.0)))


def valley(deviations):
    return 0.5 + np.hypot(deviations[:, 0] - 0.2, 5.0 * (deviations[:, 0] + deviations[:, 1]))


def swept(parameter="crossover_fraction", value=0.5, seeds=range(3), study_seed=7, **settings):
    settings = GeneticSettings(**({"generations": 25} | settings))
    return sweep.run_sweep(valley, PARAMETERS, settings, parameter, value, seeds, study_seed)


def table(groups, parameter="crossover_fraction", population="one", operators="matlab_gaussian"):
    return pd.concat(
        [
            pd.DataFrame(
                {
                    "operators": operators,
                    "stop": "end",
                    "parameter": parameter,
                    "population": population,
                    "value": value,
                    "objective_mm": np.asarray(sample, float),
                }
            )
            for value, sample in groups.items()
        ],
        ignore_index=True,
    )


def test_a_sweep_s_rows_are_single_runs():
    tables = swept(value=0.3, seeds=(4, 9), populations=(10, 10))
    for name, frame in tables.items():
        schema = next(table for table in TABLES if table.name == name)
        assert sorted(frame.columns) == sorted(schema.names)
    for row in tables["sweep_runs"].itertuples():
        settings = GeneticSettings(0.3, populations=(10, 10), generations=25, stall_generations=0)
        seed = run_seed(7, "crossover_fraction", "islands", 0.3, row.seed)
        single = minimise(valley, PARAMETERS.low, PARAMETERS.high, settings, seed)
        assert (row.operators, row.population, row.stopped) == ("matlab_gaussian", "islands", "generations")
        assert (row.objective_mm, row.evaluations) == (single.objective, single.evaluations)
        found, own = (tables[name][tables[name]["seed"] == row.seed] for name in ("sweep_parameters", "sweep_history"))
        found = found[found["stop"] == row.stop]
        assert found[["name", "unit"]].to_numpy().tolist() == [["a", "mm"], ["b", "rad"]]
        np.testing.assert_array_equal(found["deviation"], single.deviations)
        np.testing.assert_array_equal(own["best_mm"], single.best_history)
        np.testing.assert_array_equal(own["mean_mm"], single.mean_history)


def test_a_run_that_stalls_is_there_twice():
    tables = swept(seeds=[1], generations=400, stall_generations=5, stall_tolerance=1e-3)
    stalled, ended = (tables["sweep_runs"][tables["sweep_runs"]["stop"] == stop].iloc[0] for stop in ("stall", "end"))
    assert (stalled["stopped"], ended["stopped"], ended["generations"]) == ("stalled", "generations", 400)
    assert stalled["generations"] < 400 and ended["objective_mm"] <= stalled["objective_mm"]
    history = tables["sweep_history"].set_index("generation")["best_mm"]
    assert stalled["objective_mm"] == history[stalled["generations"]]


def test_a_sweep_repeats_itself_and_its_seeds_do_not_depend_on_each_other():
    first, again, part = swept(), swept(), swept(seeds=[2])
    for name, frame in first.items():
        pd.testing.assert_frame_equal(frame, again[name])
        pd.testing.assert_frame_equal(frame[frame["seed"] == 2].reset_index(drop=True), part[name])


def test_long_histories_are_thinned_but_keep_the_last_generation():
    tables = swept(seeds=[0], generations=137, stall_generations=0)
    history = tables["sweep_history"]
    assert history["generation"].tolist() == [*range(101), 110, 120, 130, 137]
    assert history["best_mm"].iloc[-1] == tables["sweep_runs"]["objective_mm"].iloc[0]


def test_another_parameter_is_refused():
    with pytest.raises(ConfigError, match=r"'generations'.*crossover_fraction"):
        swept(parameter="generations", value=5)
    with pytest.raises(ConfigError, match="migration_fraction is 2"):
        swept(parameter="migration_fraction", value=2)


def test_kruskal_wallis_of_three_separate_groups():
    # by hand: rank sums 6, 15, 24 of n = 9 give H = 12 / (9 10) (36 + 225 + 576) / 3 - 3 10 = 7.2, and p = exp(-H / 2)
    # for two degrees of freedom
    effect = sweep.setting_effect(table({0.1: [1, 2, 3], 0.2: [4, 5, 6], 0.3: [7, 8, 9]})).iloc[0]
    assert effect["statistic"] == pytest.approx(7.2)
    assert effect["p_value"] == pytest.approx(math.exp(-3.6))
    assert effect["epsilon_squared"] == pytest.approx(0.9)
    assert (effect["settings"], effect["runs"]) == (3, 9)


def test_the_setting_without_mutation_is_set_aside_for_crossover_only():
    random = np.random.default_rng(1)
    samples = {value: random.normal(0.51, 0.01, 20) for value in (0.2, 0.5, 0.8)} | {1.0: random.normal(0.65, 0.01, 20)}
    runs = pd.concat([table(samples), table(samples, "migration_fraction")])
    crossover, migration = (row for _, row in sweep.setting_effect(runs).iterrows())
    assert crossover["p_value"] < 1e-6
    assert crossover["p_value_mutating"] > 0.05
    assert not crossover["distinguishable_mutating"]
    alone = sweep.setting_effect(table({value: samples[value] for value in (0.2, 0.5, 0.8)})).iloc[0]
    # PyGAD's mutation does not hang on the crossover
    mutating = sweep.setting_effect(table(samples, operators="pygad")).iloc[0]
    assert mutating["p_value_mutating"] == mutating["p_value"]
    assert crossover["p_value_mutating"] == alone["p_value"]
    assert migration["p_value_mutating"] == migration["p_value"] < 1e-6


def test_scatter_alone_is_called_an_effect_as_seldom_as_promised():
    random = np.random.default_rng(2)
    keys = {
        "operators": "pygad",
        "stop": "end",
        "parameter": "migration_fraction",
        "population": np.repeat(np.arange(200), 200),
    }
    runs = pd.DataFrame(keys | {"value": np.tile(np.repeat(np.arange(10), 20), 200)})
    effects = sweep.setting_effect(runs.assign(objective_mm=random.exponential(size=len(runs))))
    # 5 % of 200 tables, standard deviation 3.1
    assert len(effects) == 200
    assert 0 < effects["distinguishable_mutating"].sum() < 10 + 3 * 3.1


@pytest.mark.parametrize(
    "groups",
    [{0.1: [0.5] * 4, 0.2: [0.5] * 4}, {0.1: [0.5, 0.6]}, {0.1: [0.5], 0.2: [0.5]}, {0.1: [np.inf], 1.0: [np.inf]}],
)
def test_nothing_to_tell_apart_gives_p_one(groups):
    effect = sweep.setting_effect(table(groups)).iloc[0]
    assert effect[["p_value", "p_value_mutating"]].tolist() == [1.0, 1.0]
    assert effect["epsilon_squared"] == 0.0
    pairs = sweep.setting_pairs(table(groups))
    assert len(pairs) == len(groups) - 1
    if len(pairs):
        assert pairs["p_holm"].tolist() == [1.0]
        assert not pairs["distinguishable"].any()


def test_holm_correction():
    # R: p.adjust(c(0.01, 0.04, 0.03, 0.005), "holm") gives 0.03 0.06 0.06 0.02
    assert sweep._holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert sweep._holm([0.9, 0.8]) == [1.0, 1.0]
    assert sweep._holm([]) == []


def test_pairs_tell_a_known_shift_from_none():
    random = np.random.default_rng(3)
    samples = {
        value: random.normal(0.51 + shift, 0.01, 40)
        for value, shift in ((0.1, 0.05), (0.6, 0.0), (0.8, 0.001), (1.0, 0.14))
    }
    pairs = sweep.setting_pairs(table(samples)).set_index("value")
    best = min(samples, key=lambda value: np.median(samples[value]))
    other = {0.6: 0.8, 0.8: 0.6}[best]
    assert (pairs["best_value"] == best).all()
    assert pairs["distinguishable"].to_dict() == {0.1: True, 1.0: True, other: False}
    for value, shift in ((0.1, 0.05), (1.0, 0.14)):
        row = pairs.loc[value]
        assert row["difference_low_mm"] < row["difference_mm"] < row["difference_high_mm"]
        assert row["difference_low_mm"] - 0.004 < shift < row["difference_high_mm"] + 0.004
        assert row["difference_mm"] == pytest.approx(np.median(samples[value]) - np.median(samples[best]))
        assert row["p_holm"] >= row["p_value"]
    assert pairs.loc[other, "difference_low_mm"] < 0.002


def test_the_bootstrap_interval_covers_as_often_as_promised():
    random = np.random.default_rng(4)
    covered = 0
    for trial in range(60):
        found = sweep._median_difference(random.normal(1.0, 1.0, 25), random.normal(0.0, 1.0, 25), trial)
        covered += found["difference_low_mm"] <= 1.0 <= found["difference_high_mm"]
    # 95 % of 60 is 57, standard deviation 1.7; the percentile interval of medians errs to the wide side
    assert covered >= 52


def test_pairs_are_reproducible_and_do_not_depend_on_each_other():
    random = np.random.default_rng(5)
    samples = {value: random.exponential(size=10) for value in (0.1, 0.2, 0.3)}
    samples[0.2] -= 5.0
    pairs = sweep.setting_pairs(table(samples))
    pd.testing.assert_frame_equal(
        pairs, sweep.setting_pairs(table(samples).sample(frac=1.0, random_state=1).sort_index())
    )
    alone = sweep.setting_pairs(table({value: samples[value] for value in (0.2, 0.3)}))
    columns = ["difference_mm", "difference_low_mm", "difference_high_mm", "p_value"]
    assert pairs.loc[pairs["value"] == 0.3, columns].to_numpy().tolist() == alone[columns].to_numpy().tolist()


def test_single_and_infeasible_runs_leave_the_interval_open():
    single = sweep.setting_pairs(table({0.1: [0.5], 0.2: [0.7]})).iloc[0]
    assert single["difference_mm"] == pytest.approx(0.2)
    assert np.isnan(single["difference_low_mm"])
    infeasible = sweep.setting_pairs(table({0.1: [0.5, 0.6], 0.2: [0.7, np.inf]})).iloc[0]
    assert infeasible["median_mm"] == np.inf
    assert np.isnan(infeasible["difference_mm"])
