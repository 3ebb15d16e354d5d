"""Observations made of others: rows in standard deviations of each kind's own noise, and columns of more parameters."""

import numpy as np
import pytest

from rrru.errors import FitError
from rrru.estimation.observations.combined import Joined, Part, WithColumns
from rrru.estimation.parameters import Block, Parameters
from rrru.estimation.problem import Problem, WhiteNoise
from rrru.estimation.solver import solve


class LinearizedProblem:
    """Readings y = A x (n, a)."""

    def __init__(self, matrix, read):
        self._matrix, self._read = matrix, read

    def residual(self, values, /):
        """Read minus predicted (n, a)."""
        return self._read - self._matrix @ values

    def jacobian(self, values, /):
        """Derivative (n, a, p) of the residual."""
        return -self._matrix


def _parts(generator):
    """Two kinds, of three values and of the last two of them, with noises of 0.5 and 2, and their dense stack."""
    first, second = generator.normal(size=(4, 3, 3)), generator.normal(size=(5, 1, 2))
    parts = (
        Part(LinearizedProblem(first, generator.normal(size=(4, 3))), WhiteNoise(0.5)),
        Part(LinearizedProblem(second, generator.normal(size=(5, 1))), WhiteNoise(2.0), slice(1, 3)),
    )
    dense = np.concatenate([first.reshape(12, 3) / 0.5, np.pad(second.reshape(5, 2), ((0, 0), (1, 0))) / 2.0])
    read = np.concatenate([part.observations._read.ravel() / part.whiten.sd for part in parts])
    return parts, dense, read


def test_rows_are_whitened_kind_by_kind():
    parts, dense, read = _parts(np.random.default_rng(1))
    joined, at = Joined(parts), np.array([0.3, -0.2, 0.5])
    np.testing.assert_allclose(joined.residual(at)[:, 0], read - dense @ at, atol=1e-12)
    np.testing.assert_allclose(joined.jacobian(at)[:, 0], -dense, atol=1e-12)


def test_the_joint_estimate_is_generalised_least_squares():
    parts, dense, read = _parts(np.random.default_rng(2))
    parameters = Parameters((Block.of("x", ("a", "b", "c"), ("mm",) * 3, np.inf),))
    found = solve(Problem(Joined(parts), parameters), [np.zeros(3)])
    normal = dense.T @ dense
    np.testing.assert_allclose(found.values, np.linalg.solve(normal, dense.T @ read), atol=1e-9)
    np.testing.assert_allclose(found.covariance, np.linalg.inv(normal), atol=1e-9)


def test_more_parameters_change_the_readings_by_their_columns():
    generator = np.random.default_rng(1)
    matrix, columns, read = generator.normal(size=(6, 2, 3)), generator.normal(size=(6, 2, 2)), np.ones((6, 2))
    own, values = WithColumns(LinearizedProblem(matrix, read), columns), generator.normal(size=5)
    np.testing.assert_allclose(own.residual(values), read - matrix @ values[:3] - columns @ values[3:], atol=1e-12)
    np.testing.assert_array_equal(own.jacobian(values), -np.concatenate([matrix, columns], axis=2))


def test_columns_without_a_value_are_refused():
    with pytest.raises(FitError, match="columns of an effect are not finite"):
        WithColumns(LinearizedProblem(np.zeros((2, 1, 1)), np.zeros((2, 1))), np.full((2, 1, 1), np.nan))
