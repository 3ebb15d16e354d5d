"""Adaptive feasible mutation: its directions, its steps and what it keeps inside."""

import numpy as np
import pytest

from rrru.genetic import operators, plan
from rrru.genetic.algorithm import minimise
from rrru.genetic.settings import GeneticSettings


@pytest.fixture(scope="module")
def moves():
    return plan.directions(np.random.default_rng(0), 500, 6)


def test_moves_are_both_senses_of_a_triangular_basis(moves):
    # Audet and Dennis 2006: a lower triangular matrix with +-1 on its diagonal, rows and columns in any order
    assert moves.shape == (500, 12, 6)
    for own in moves[:50]:
        rows = {tuple(row) for row in own}
        assert len(rows) == 12 and all(tuple(-np.array(row)) in rows for row in rows)
        one_each = np.array([row for row in own if tuple(row) > tuple(-row)])
        assert abs(np.linalg.det(one_each)) == pytest.approx(1.0)
        assert sorted(np.count_nonzero(one_each, axis=1)) == [1, 2, 3, 4, 5, 6]
    assert np.abs(moves).max() == 1.0 and (np.abs(moves).max(axis=2) == 1.0).all()


def test_no_direction_is_preferred(moves):
    first = moves[:, 0]
    np.testing.assert_allclose(first.mean(axis=0), 0.0, atol=5 * 0.5 / 500**0.5)
    # a coordinate moves in 1 + 2 + .. + 6 of 36 cases
    np.testing.assert_allclose((first != 0.0).mean(axis=0), 21 / 36, atol=5 * 0.5 / 500**0.5)


def test_the_first_feasible_move_is_taken_and_a_cornered_parent_stays():
    population = np.array([[0.9, 0.5], [1.0, 0.0]])
    steps = np.array([[[0.2, 0.0], [0.0, 0.5], [0.1, 0.1]], [[0.1, 0.0], [0.0, -0.1], [-1.1, 0.0]]])
    mutants = np.empty((2, 2))
    operators.feasible(population, np.array([0, 1]), steps, mutants)
    assert mutants.tolist() == [[0.9, 1.0], [1.0, 0.0]]


def test_steps_double_after_a_better_generation_and_halve_after_another():
    best = np.array([5.0, 4.0, 4.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0])
    size, sizes = np.nan, []
    for generation in range(1, len(best)):
        size = operators.adapted(size, best, generation)
        sizes.append(size)
    smallest = 1e-3**0.5
    assert sizes == [1.0, 1.0, 0.5, 1.0, 0.5, 0.25, 0.125, 0.0625, smallest, smallest]


def test_all_children_stay_in_their_box_and_move_by_no_more_than_the_range():
    seen = []

    def objective(values):
        seen.append(values.copy())
        return np.abs(values - 0.95).sum(axis=1)

    low, high = np.array([-1.0, 0.0]), np.array([1.0, 4.0])
    settings = GeneticSettings(0.3, operators="matlab_adaptive", generations=200, stall_generations=0)
    result = minimise(objective, low, high, settings, 3)
    every = np.concatenate(seen)
    assert (every >= low).all() and (every <= high).all() and len(every) == result.evaluations
    np.testing.assert_allclose(result.deviations, 0.95, atol=0.02)
