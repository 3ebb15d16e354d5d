"""Marginalisation over the many coefficients of a broad term, which leaves a problem in the other columns.

G is the whitened Gram matrix, g are the moments and s the prior sizes of the term's own columns (z). The average over
their coefficients is a problem in the other columns (x) alone:

    G' = G_xx - G_xz A^-1 G_zx,  g' = g_x - G_xz A^-1 g_z,  A = G_zz + diag(s^-2)

to whose log evidence the term adds 1/2 g_z A^-1 g_z - 1/2 log |I + diag(s) G_zz diag(s)|.
"""

from functools import cached_property

import numpy as np
from scipy.linalg import cho_solve, solve_triangular


class Average:
    """Average over the coefficients of one term at one size.

    gram (K, K), moment (K,): of all columns; index (z,): the term's own; size (z,): its prior deviations; apart:
    numbers of further columns to leave out, which no other term of a set has. evidence: log evidence of the term alone.
    """

    def __init__(self, gram, moment, index, size, apart=()):
        self._gram, self._moment, self._index, self._size = gram, moment, index, size
        self._apart = np.asarray(apart, dtype=int)
        self._factor = _factor(gram, index, size)
        self._half = solve_triangular(self._factor, size * moment[index], lower=True, check_finite=False)
        self.evidence = float(0.5 * self._half @ self._half - np.log(np.diag(self._factor)).sum())

    @cached_property
    def others(self):
        """Which columns (K,) other terms of a set may have."""
        result = np.full(len(self._moment), True)
        result[self._index] = result[self._apart] = False
        return result

    @cached_property
    def across(self):
        """Factor (K, z) of what is averaged out of the other columns' Gram matrix: its product with its transpose."""
        columns = self._size[:, None] * self._gram[self._index]
        half = solve_triangular(self._factor, columns, lower=True, check_finite=False)
        return np.where(self.others[:, None], half.T, 0.0)

    @cached_property
    def moment(self):
        """Moments (K,) of the other columns after the average."""
        return self._moment - self.across @ self._half

    def rest(self, index):
        """Gram matrix (k, k) and moments (k,) of some of the other columns after the average."""
        across = self.across[index]
        return self._gram.take(index, 0).take(index, 1) - across @ across.T, self.moment[index]

    def mean(self, others, values):
        """Mean (z,) of the term's coefficients where other columns (k,) have coefficients values (k,)."""
        target = self._size * (self._moment[self._index] - self._gram[self._index[:, None], others] @ values)
        return self._size * cho_solve((self._factor, True), target, check_finite=False)


def _factor(gram, index, size):
    """Lower Cholesky factor (z, z) of I + diag(size) G diag(size) of some columns."""
    return np.linalg.cholesky(size[:, None] * gram.take(index, 0).take(index, 1) * size + np.eye(len(size)))
