"""Averages over the many coefficients of a broad term: what they leave to be told by the other columns.

With the whitened Gram matrix G, moments g and prior sizes s of the term's own columns (z) the average over them is that
of a problem in the other columns (x) alone:

    G' = G_xx - G_xz A^-1 G_zx,  g' = g_x - G_xz A^-1 g_z,  A = G_zz + diag(s^-2)

and their evidence beside it is 1/2 g_z A^-1 g_z - 1/2 log |I + diag(s) G_zz diag(s)|.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve, solve_triangular


def beside(gram, index, apart=()):
    """Numbers (k,) of the columns of a Gram matrix (K, K) beside columns index (z,), and their part of it (k, k).

    apart: numbers of further columns to leave out, which no other term of a set has.
    """
    kept = np.setdiff1d(np.arange(len(gram)), np.union1d(index, np.asarray(apart, dtype=int)))
    return kept, gram[kept[:, None], kept]


@dataclass(frozen=True)
class Average:
    """Average over the coefficients of one term at one size.

    evidence: log evidence of the term alone; kept (k,): numbers of the other columns, in order; gram (k, k), moment
    (k,): of these after the average.
    """

    evidence: float
    kept: np.ndarray
    gram: np.ndarray
    moment: np.ndarray

    @classmethod
    def over(cls, gram, moment, index, size, others):
        """Of the columns index (z,) with prior sizes (z,) of a Gram matrix (K, K) and moments (K,).

        others: what is `beside` these.
        """
        kept, rest = others
        factor = _factor(gram, index, size)
        both = size[:, None] * np.column_stack([gram[index[:, None], kept], moment[index]])
        half = solve_triangular(factor, both, lower=True, check_finite=False)
        evidence = 0.5 * half[:, -1] @ half[:, -1] - np.log(np.diag(factor)).sum()
        taken = half[:, :-1].T @ half
        return cls(float(evidence), kept, rest - taken[:, :-1], moment[kept] - taken[:, -1])

    def rest(self, index):
        """Gram matrix (k, k) and moments (k,) of some of the other columns."""
        at = np.searchsorted(self.kept, index)
        return self.gram[at[:, None], at], self.moment[at]


def averaged_mean(gram, moment, index, size, others, values):
    """Mean (z,) of the coefficients of columns index (z,) where other columns (k,) have coefficients values (k,)."""
    target = size * (moment[index] - gram[index[:, None], others] @ values)
    return size * cho_solve((_factor(gram, index, size), True), target, check_finite=False)


def _factor(gram, index, size):
    """Lower Cholesky factor (z, z) of I + diag(size) G diag(size) of some columns."""
    return np.linalg.cholesky(size[:, None] * gram[index[:, None], index] * size + np.eye(len(size)))
