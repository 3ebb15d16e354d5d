"""The descent to the nearest optimum, against SciPy's bounded least squares and an optimum known in advance."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from rrru.studies.rrru3.twin_descent import descend

_NEVER = np.zeros(6, dtype=bool)


def linear(seed):
    """A linear problem in six genes, some of which end at a bound: matrix, right side, and SciPy's solution."""
    generator = np.random.default_rng(seed)
    matrix, right = generator.normal(size=(12, 6)) * np.logspace(0.0, 2.0, 6), generator.normal(size=12) * 60.0
    return matrix, right, lsq_linear(matrix, right, bounds=(0.0, 1.0), tol=1e-14).x


@pytest.mark.parametrize("seed", range(5))
def test_a_linear_problem_ends_at_the_bounded_least_squares(seed):
    matrix, right, expected = linear(seed)
    genes, residuals = descend(lambda genes, _tolerance: genes @ matrix.T - right, np.full(6, 0.5), _NEVER)
    assert ((genes >= 0.0) & (genes <= 1.0)).all() and (expected == expected.clip(0.0, 1.0)).all()
    best = np.sum((matrix @ expected - right) ** 2)
    assert residuals @ residuals == pytest.approx(best, abs=2.0)
    np.testing.assert_allclose(residuals, matrix @ genes - right)


def test_an_angle_comes_round_to_its_optimum():
    def circle(genes, _tolerance):
        angle = 2.0 * np.pi * (genes[:, :1] - 0.95)
        return 30.0 * np.concatenate([1.0 - np.cos(angle), np.sin(angle), genes[:, 1:] - 0.3], axis=1)

    genes, residuals = descend(circle, np.array([0.1, 0.6]), np.array([True, False]))
    np.testing.assert_allclose(genes, [0.95, 0.3], atol=2e-3)
    assert residuals @ residuals < 0.1


def test_candidates_that_cannot_be_driven_are_no_obstacle_and_a_start_among_them_ends_at_once():
    matrix, right, _ = linear(1)
    asked = []

    def lost(genes, tolerance):
        asked.append(tolerance)
        found = genes @ matrix.T - right
        found[genes[:, 0] > 0.5] = np.nan
        return found

    genes, residuals = descend(lost, np.full(6, 0.5), _NEVER)
    assert np.isfinite(residuals).all() and genes[0] <= 0.5
    assert residuals @ residuals < np.sum((matrix @ np.full(6, 0.5) - right) ** 2)
    # with a tolerance first, without it at the end
    assert asked[0] > 0.0 and asked[-1] == 0.0 and sorted(asked, reverse=True) == asked
    genes, residuals = descend(lost, np.full(6, 0.6), _NEVER)
    assert np.isnan(residuals).all() and (genes == 0.6).all()
