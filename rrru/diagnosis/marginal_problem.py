"""Least squares of some coefficients with their priors, the calibration taken out, as the evidence needs it.

The many coefficients of a broad term are marginalised, which leaves a problem in the other columns. G is the whitened
Gram matrix, g are the moments and s the prior sizes of the term's own columns (z). The average over their coefficients
is a problem in the other columns (x) alone:

    G' = G_xx - G_xz A^-1 G_zx,  g' = g_x - G_xz A^-1 g_z,  A = G_zz + diag(s^-2)

to whose log evidence the term adds 1/2 g_z A^-1 g_z - 1/2 log |I + diag(s) G_zz diag(s)|.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt
from scipy.linalg import cho_solve, solve_triangular
from scipy.linalg.lapack import dposv
from scipy.optimize import nnls

from rrru.arrays import BoolArray, FloatArray, IntArray
from rrru.diagnosis import evidence_kernels as kernels
from rrru.diagnosis.aliases import Grams

PRIOR_SCALES = np.array([0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0])


class Prior(NamedTuple):
    """Prior of k coefficients: columns' numbers, sizes at prior scale 1, largest sizes, and which are positive."""

    columns: IntArray
    size: FloatArray
    largest: FloatArray
    positive: BoolArray

    @classmethod
    def normal(cls, index: IntArray) -> Self:
        """Prior of columns of unit deviation, which no prior scale changes."""
        nothing = np.zeros(len(index))
        return cls(index, nothing + 1.0, nothing + np.inf, nothing > 0.0)

    def at(self, prior_scale: float) -> FloatArray:
        """Sizes at a prior scale."""
        return np.minimum(prior_scale * self.size, self.largest)

    @property
    def log_scales(self) -> FloatArray:
        """Log prior (s,) of PRIOR_SCALES: even in the logarithm up to the scale at which no size grows any more.

        The first scale from there on has what is left of its step, those behind it are the same prior and have none.
        """
        highest = (self.largest / self.size).max()
        last = min(int(np.searchsorted(PRIOR_SCALES, highest)), len(PRIOR_SCALES) - 1)
        weights = (np.arange(len(PRIOR_SCALES)) <= last).astype(float)
        if last:
            step = np.log(highest / PRIOR_SCALES[last - 1]) / np.log(PRIOR_SCALES[last] / PRIOR_SCALES[last - 1])
            weights[last] = min(step, 1.0)
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(weights / weights.sum()))


@dataclass(frozen=True)
class MarginalProblem:
    """Least squares of k coefficients with their priors, the calibration taken out.

    Those of the terms come first, then those of their shapes, last those of payload and tilt, both without owner. gram
    (levels, k, k), moment (levels, k); size, largest, positive, about (k,): of the prior; owner (k,): number of the
    term, the terms' count without one; index (r,): of the columns, those of terms and shapes first, each of one
    coefficient; mix (s, q): what makes the columns of q coefficients of payload and tilt of the last s, None without
    these; weights: of each coefficient of payload and tilt whether it is a tilt, no
    mass; and at_least (terms,): prior scales under which the terms are as large as found.
    """

    gram: FloatArray
    moment: FloatArray
    size: FloatArray
    largest: FloatArray
    positive: BoolArray
    about: FloatArray
    owner: IntArray
    index: IntArray
    mix: FloatArray | None = None
    weights: tuple[bool, ...] = ()
    at_least: FloatArray = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def of(cls, priors: Sequence[Prior], count: int, grams: Grams) -> Self:
        """The problem with the Priors of so many terms, and after them of their shapes.

        grams: from numbers (k,) of columns to their Gram matrices (levels, k, k) and moments (levels, k).
        """
        owner = np.repeat(np.minimum(np.arange(len(priors)), count), [len(prior.columns) for prior in priors])
        index, size, largest, positive = (np.concatenate(parts) for parts in zip(*priors, strict=True))
        gram, moment = grams(index)
        about, at_least = np.zeros(len(index)), np.zeros(count)
        return cls(gram, moment, size, largest, positive, about, owner, index, at_least=at_least)

    def on(self, grams: FloatArray, moments: FloatArray) -> Self:
        """The problem on other Gram matrices (levels, r, r) and moments (levels, r) of its columns."""
        if self.mix is None:
            return replace(self, gram=grams, moment=moments)
        f = len(self.index) - len(self.mix)
        gram = np.empty((len(grams), len(self.size), len(self.size)))
        gram[:, :f, :f] = grams[:, :f, :f]
        gram[:, :f, f:] = across = grams[:, :f, f:] @ self.mix
        gram[:, f:, :f] = across.transpose(0, 2, 1)
        gram[:, f:, f:] = self.mix.T @ grams[:, f:, f:] @ self.mix
        return replace(self, gram=gram, moment=np.concatenate([moments[:, :f], moments[:, f:] @ self.mix], axis=1))

    def of_columns(self, coefficients: FloatArray) -> FloatArray:
        """Coefficients (r,) of the columns from those of the problem (k,)."""
        if self.mix is None:
            return coefficients
        f = len(self.index) - len(self.mix)
        return np.concatenate([coefficients[:f], self.mix @ coefficients[f:]])

    def of_coefficients(self, rows: FloatArray) -> FloatArray:
        """Rows (k, n) of the coefficients' columns from those of the columns (r, n)."""
        if self.mix is None:
            return rows
        f = len(self.index) - len(self.mix)
        return np.concatenate([rows[:f], self.mix.T @ rows[f:]])

    def reordered(self, terms: Sequence[int], coefficients: IntArray) -> Self:
        """The problem with terms (terms,), and coefficients (k,) of these and of shapes, in an order of old numbers."""
        k = np.concatenate([coefficients, np.arange(len(coefficients), len(self.size))])
        rank = np.append(np.argsort(terms), len(terms))
        arrays = {name: getattr(self, name)[k] for name in ("size", "largest", "positive", "about")}
        index = np.concatenate([self.index[coefficients], self.index[len(coefficients) :]])
        gram, moment, owner = self.gram[:, k[:, None], k], self.moment[:, k], rank[self.owner[k]]
        return replace(
            self, gram=gram, moment=moment, owner=owner, at_least=self.at_least[terms], index=index, **arrays
        )

    def scale(self, prior_scales: FloatArray) -> FloatArray:
        """Prior standard deviations (m, k) at prior_scales (m, terms)."""
        scales = np.ones((len(prior_scales), prior_scales.shape[1] + 1))
        scales[:, :-1] = prior_scales
        return np.minimum(scales.take(self.owner, axis=1) * self.size, self.largest)


def gained(problem: MarginalProblem, scale: FloatArray) -> FloatArray:
    """Log evidence (levels, m) of a MarginalProblem at prior deviations (m, k) over that of none of its terms."""
    if not problem.about.any():
        return gained_about_zero(problem, scale)
    scale = np.ascontiguousarray(scale)
    gram, moment = np.ascontiguousarray(problem.gram), np.ascontiguousarray(problem.moment)
    explained = gram @ problem.about
    at_means = (moment - 0.5 * explained) @ problem.about
    return at_means[:, None] + kernels.log_evidence(gram, moment - explained, scale, problem.positive)


def gained_about_zero(problem: MarginalProblem, scale: FloatArray) -> FloatArray:
    """`gained` (levels, m) where all priors are about zero."""
    gram, moment = np.ascontiguousarray(problem.gram), np.ascontiguousarray(problem.moment)
    return kernels.log_evidence(gram, moment, np.ascontiguousarray(scale), problem.positive)


def evidence_error(problem: MarginalProblem, scale: FloatArray) -> FloatArray:
    """How far (levels, m) `gained` may be off at prior deviations (m, k): the size of the correction in it.

    It comes from the probability of the coefficients that cannot be negative, see `tests.diagnosis.orthant`.
    """
    gram, moment = np.ascontiguousarray(problem.gram), problem.moment - problem.gram @ problem.about
    correction = kernels.log_evidence_and_correction(gram, moment, np.ascontiguousarray(scale), problem.positive)[1]
    return np.abs(correction)


def posterior_mean(problem: MarginalProblem, scale: FloatArray) -> FloatArray:
    """The mean (k,) of a MarginalProblem of one level at prior deviations (k,).

    Where that has negative positive coefficients their most probable point.
    """
    gram, about, positive = problem.gram[0], problem.about, problem.positive
    precision = _precision(gram, scale)
    moment = scale * (problem.moment[0] - gram @ about)
    mean = _solved(precision, moment)
    if (mean[positive] < 0.0).any():
        mean = _not_negative(precision, moment, positive)
    return about + scale * mean


def posterior_covariance(problem: MarginalProblem, scale: FloatArray) -> FloatArray:
    """The covariance (k, k) of a MarginalProblem of one level at prior deviations (k,)."""
    return scale[:, None] * np.linalg.inv(_precision(problem.gram[0], scale)) * scale


def _precision(gram: FloatArray, scale: FloatArray) -> FloatArray:
    """Precision (k, k) of the coefficients over their prior deviations (k,)."""
    return scale[:, None] * gram * scale + np.eye(len(scale))


def _solved(precision: FloatArray, moment: FloatArray) -> FloatArray:
    """Solution (k,) or (k, n) of a symmetric positive definite system; half the work of a general one."""
    if not len(precision):
        return moment
    _, solution, info = dposv(precision.T, moment, lower=True)
    if info:
        raise np.linalg.LinAlgError(f"precision of the coefficients is not positive definite (row {info})")
    return np.asarray(solution)


def _not_negative(precision: FloatArray, moment: FloatArray, positive: BoolArray) -> FloatArray:
    """The most probable point (k,) without negative positive coefficients, the others found from these."""
    free = ~positive
    both = np.column_stack([precision[free][:, positive], moment[free]])
    taken = _solved(precision[free][:, free], both)
    left = np.column_stack([precision[positive][:, positive], moment[positive]]) - both[:, :-1].T @ taken
    factor = np.linalg.cholesky(left[:, :-1])
    result = np.empty(len(moment))
    result[positive], _ = nnls(factor.T, solve_triangular(factor, left[:, -1], lower=True))
    result[free] = taken[:, -1] - taken[:, :-1] @ result[positive]
    return result


class Average:
    """Average over the coefficients of one term at one size.

    gram (K, K), moment (K,): of all columns; index (z,): the term's own; size (z,): its prior deviations; apart:
    numbers of further columns to leave out, which no other term of a set has. evidence: log evidence of the term alone.
    """

    def __init__(
        self, gram: FloatArray, moment: FloatArray, index: IntArray, size: FloatArray, apart: npt.ArrayLike = ()
    ) -> None:
        self._gram, self._moment, self._index, self._size = gram, moment, index, size
        self._apart = np.asarray(apart, dtype=int)
        self._factor = _factor(gram, index, size)
        self._half = solve_triangular(self._factor, size * moment[index], lower=True, check_finite=False)
        self.evidence = float(0.5 * self._half @ self._half - np.log(np.diag(self._factor)).sum())

    @cached_property
    def others(self) -> BoolArray:
        """Which columns (K,) other terms of a set may have."""
        result = np.full(len(self._moment), True)
        result[self._index] = result[self._apart] = False
        return result

    @cached_property
    def across(self) -> FloatArray:
        """Factor (K, z) of what is averaged out of the other columns' Gram matrix: its product with its transpose."""
        columns = self._size[:, None] * self._gram[self._index]
        half = solve_triangular(self._factor, columns, lower=True, check_finite=False)
        return np.where(self.others[:, None], half.T, 0.0)

    @cached_property
    def moment(self) -> FloatArray:
        """Moments (K,) of the other columns after the average."""
        return np.asarray(self._moment - self.across @ self._half)

    def rest(self, index: IntArray) -> tuple[FloatArray, FloatArray]:
        """Gram matrix (k, k) and moments (k,) of some of the other columns after the average."""
        across = self.across[index]
        return self._gram.take(index, 0).take(index, 1) - across @ across.T, self.moment[index]

    def mean(self, others: IntArray, values: FloatArray) -> FloatArray:
        """Mean (z,) of the term's coefficients where other columns (k,) have coefficients values (k,)."""
        target = self._size * (self._moment[self._index] - self._gram[self._index[:, None], others] @ values)
        return np.asarray(self._size * cho_solve((self._factor, True), target, check_finite=False))


def _factor(gram: FloatArray, index: IntArray, size: FloatArray) -> FloatArray:
    """Lower Cholesky factor (z, z) of I + diag(size) G diag(size) of some columns."""
    return np.asarray(np.linalg.cholesky(size[:, None] * gram.take(index, 0).take(index, 1) * size + np.eye(len(size))))
