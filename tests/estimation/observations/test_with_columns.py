"""Readings with linear effects of more parameters: the dense sum, and columns that are refused."""

import numpy as np
import pytest

from rrru.errors import FitError
from rrru.estimation.observations.with_columns import WithColumns
from tests.estimation.observations.test_joined import LinearizedProblem


def test_more_parameters_change_the_readings_by_their_columns():
    generator = np.random.default_rng(1)
    matrix, columns, read = generator.normal(size=(6, 2, 3)), generator.normal(size=(6, 2, 2)), np.ones((6, 2))
    own, values = WithColumns(LinearizedProblem(matrix, read), columns), generator.normal(size=5)
    np.testing.assert_allclose(own.residual(values), read - matrix @ values[:3] - columns @ values[3:], atol=1e-12)
    np.testing.assert_array_equal(own.jacobian(values), -np.concatenate([matrix, columns], axis=2))


def test_columns_without_a_value_are_refused():
    with pytest.raises(FitError, match="columns of an effect are not finite"):
        WithColumns(LinearizedProblem(np.zeros((2, 1, 1)), np.zeros((2, 1))), np.full((2, 1, 1), np.nan))
