"""Migration by hand and by property."""

import numpy as np
import pytest

from rrru.genetic import algorithm, plan
from rrru.genetic.algorithm import minimise
from rrru.genetic.settings import GeneticSettings


def _population(sizes, seed=0):
    random = np.random.default_rng(seed)
    return random.uniform(size=(sum(sizes), 3)), random.uniform(1.0, 9.0, sum(sizes))


def _migrate(population, score, sizes, fraction):
    rows, leaving = plan.make_plan(sizes, 0.05, 0.8), plan.migrants_of(sizes, fraction)
    return plan.migrate(population, score, rows, leaving)


def test_islands_lie_one_after_the_other():
    assert plan.make_plan((30,), 0.05, 0.8)[:, :2].tolist() == [[0, 30]]
    assert plan.make_plan((12, 30, 5), 0.05, 0.8)[:, :2].tolist() == [[0, 12], [12, 42], [42, 47]]


@pytest.mark.parametrize(("fraction", "expected"), [(0.0, 0), (0.1, 1), (0.15, 2), (0.7, 7), (1.0, 10)])
def test_migrants_are_the_fraction_of_the_smaller_island(fraction, expected):
    assert plan.migrant_count(fraction, 10, 30) == expected
    assert plan.migrant_count(fraction, 30, 10) == expected


def test_the_best_go_over_the_worst_of_the_next_and_stay_where_they_were():
    population = np.arange(9.0)[:, None]
    score = np.array([3.0, 1.0, 2.0, 6.0, 4.0, 5.0, 7.0, 9.0, 8.0])
    arrived, arrived_score = _migrate(population, score, (3, 3, 3), 0.34)
    # best: 1, 4, 6; worst: 0, 3, 7; the last island goes to the first
    assert arrived[:, 0].tolist() == [6.0, 1.0, 2.0, 1.0, 4.0, 5.0, 6.0, 4.0, 8.0]
    assert arrived_score.tolist() == [7.0, 1.0, 2.0, 1.0, 4.0, 5.0, 7.0, 4.0, 8.0]


def test_a_whole_island_moves_one_island_on_at_fraction_one():
    population, score = _population((5, 5, 5))
    arrived, arrived_score = _migrate(population, score, (5, 5, 5), 1.0)
    for source, target in ((0, 1), (1, 2), (2, 0)):
        here, there = slice(5 * source, 5 * source + 5), slice(5 * target, 5 * target + 5)
        assert sorted(arrived_score[there]) == sorted(score[here])
        assert sorted(map(tuple, arrived[there])) == sorted(map(tuple, population[here]))


@pytest.mark.parametrize("fraction", [0.1, 0.5, 0.7, 1.0])
@pytest.mark.parametrize("sizes", [(4, 4), (3, 9, 5), (10, 2, 10, 2)])
def test_scores_stay_with_their_individuals_and_the_best_is_never_lost(fraction, sizes):
    for seed in range(20):
        population, score = _population(sizes, seed)
        owner = {tuple(row): value for row, value in zip(population, score, strict=True)}
        before = population.copy(), score.copy()
        arrived, arrived_score = _migrate(population, score, sizes, fraction)
        assert all(owner[tuple(row)] == value for row, value in zip(arrived, arrived_score, strict=True))
        assert arrived_score.min() == score.min()
        np.testing.assert_array_equal(population, before[0])
        np.testing.assert_array_equal(score, before[1])


def test_infeasible_individuals_are_the_first_to_be_replaced():
    population, score = _population((4, 4))
    score[[4, 6]] = np.inf
    _, arrived_score = _migrate(population, score, (4, 4), 0.5)
    assert np.isfinite(arrived_score[4:]).all()


def test_one_population_has_nobody_to_exchange_with():
    population, score = _population((30,))
    arrived, arrived_score = _migrate(population, score, (30,), 0.9)
    np.testing.assert_array_equal(arrived, population)
    np.testing.assert_array_equal(arrived_score, score)


def test_migration_follows_every_twentieth_generation(monkeypatch):
    rated, due = [], []

    def valley(values):
        rated.append(len(values))
        return np.abs(values).sum(axis=1)

    def migrate(population, score, _plan, _migrants):
        due.append(len(rated) - 1)
        return population, score

    monkeypatch.setattr(algorithm, "migrate", migrate)
    settings = GeneticSettings(populations=(5, 5), migration_interval=20, generations=70, stall_generations=0)
    minimise(valley, [-1.0], [1.0], settings, 0)
    assert due == [20, 40, 60]
