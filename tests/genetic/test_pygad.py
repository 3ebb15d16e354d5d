"""PyGAD's own operators: the package's run is the one a user of PyGAD gets, and islands migrate between runs."""

from dataclasses import replace

import numpy as np
import pygad
import pytest

from rrru.errors import FitError
from rrru.genetic import pygad_run
from rrru.genetic.algorithm import minimise
from rrru.genetic.settings import GeneticSettings

LOW, HIGH = np.full(4, -2.0), np.full(4, 2.0)
SETTINGS = GeneticSettings(0.4, populations=(12,), operators="pygad", generations=60, stall_generations=0)


def valley(values):
    return 0.5 + np.abs(values - 0.3).sum(axis=1)


def as_a_user(seed, **options):
    """PyGAD called one individual at a time, by its own documentation."""
    ga = pygad.GA(
        num_generations=60,
        num_parents_mating=12,
        fitness_func=lambda _ga, genes, _row: -valley((LOW + genes * (HIGH - LOW))[None])[0],
        sol_per_pop=12,
        num_genes=4,
        init_range_low=0.0,
        init_range_high=1.0,
        parent_selection_type="sus",
        crossover_probability=0.4,
        mutation_by_replacement=True,
        random_mutation_min_val=0.0,
        random_mutation_max_val=1.0,
        random_seed=seed,
        suppress_warnings=True,
        **options,
    )
    ga.run()
    return -np.array(ga.best_solutions_fitness)


def test_a_run_is_plain_pygads():
    result = minimise(valley, LOW, HIGH, SETTINGS, 5)
    np.testing.assert_allclose(result.best_history, as_a_user(5))
    assert result.generations == 60 and valley(result.deviations[None])[0] == result.objective


def test_stalling_is_pygads_saturation():
    expected = as_a_user(6, stop_criteria="saturate_8")
    stopped = minimise(valley, LOW, HIGH, replace(SETTINGS, stall_generations=8), 6)
    assert stopped.stopped == "stalled" and len(expected) - 1 == stopped.generations < 60
    np.testing.assert_allclose(stopped.best_history, expected)
    np.testing.assert_array_equal(minimise(valley, LOW, HIGH, SETTINGS, 6).stalled(8, 0.0).found, stopped.found)


def test_islands_without_migrants_are_runs_of_their_own():
    settings = replace(SETTINGS, populations=(8, 6), migration_fraction=0.0, migration_interval=70)
    joint = minimise(valley, LOW, HIGH, settings, 9)
    alone = [
        minimise(valley, LOW, HIGH, replace(SETTINGS, populations=(size,)), 9 + k) for k, size in enumerate((8, 6))
    ]
    np.testing.assert_array_equal(joint.best_history, np.min([one.best_history for one in alone], axis=0))
    assert joint.evaluations == sum(one.evaluations for one in alone)


def test_migrants_come_every_interval_and_the_best_is_never_lost(monkeypatch):
    exchanged = []

    def migrate(population, score, plan, migrants):
        exchanged.append(score.min())
        np.testing.assert_allclose(valley(LOW + population * (HIGH - LOW)), score)
        return original(population, score, plan, migrants)

    original = pygad_run.migrate
    monkeypatch.setattr(pygad_run, "migrate", migrate)
    settings = replace(SETTINGS, populations=(6, 6, 6), migration_interval=20, generations=70)
    result = minimise(valley, LOW, HIGH, settings, 2)
    assert len(exchanged) == 3 and result.generations == 70
    np.testing.assert_allclose(exchanged, result.best_history[[20, 40, 60]])
    assert (np.diff(result.best_history) <= 0.0).all()


def test_nowhere_feasible_is_refused():
    with pytest.raises(FitError, match="PyGAD"):
        minimise(lambda values: np.full(len(values), np.inf), LOW, HIGH, SETTINGS, 1)
