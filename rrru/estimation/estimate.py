"""Result of an estimation: values, covariance by name, residuals, rank and null space."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from scipy.linalg import solve_triangular

from rrru.arrays import BoolArray, FloatArray, IntArray
from rrru.estimation.intervals import QUANTILE_95, NormalMixture
from rrru.estimation.parameters import Parameters
from rrru.estimation.problem import Problem

# a flat prior counts as a prior this many times wider than the uncertainty that the parameter's column alone leaves
_FLAT = 1e9
# a direction is determined where the readings have at least as much information on it as the prior
_AS_PRIOR = 1.0
# more columns than this are factored by their products, many times faster, with half the digits of the least seen ones
_MANY = 200
# added to their scaled products, about the rounding of these
_RIDGE = 1e-14


@dataclass(frozen=True)
class SearchEnd:
    """Result of a search.

    converged: at a minimum; straight: every step was accepted as it was; message: in words; cost: the objective;
    evaluations: of the model.
    """

    converged: bool
    straight: bool
    message: str
    cost: float
    evaluations: int


@dataclass(frozen=True, eq=False)
class Estimate:
    """Estimated parameters of a Problem.

    values (p,); covariance (p, p): of the posterior, linearised at the values, zero for a parameter at a bound and inf
    on the diagonal of one that neither readings nor prior determine; at_bound (p,): which parameters a bound holds;
    end: how the search ended.
    cases: of a prior that is a mixture, the posterior probability and the Estimate of each case that counts. Covariance
    and intervals are those of this mixture. first_case: the Estimate of the first case, whether it counts or not.
    bias: the part of the covariance (p, p) that a discrepancy of the model makes, None where it is taken as complete.
    """

    problem: Problem
    values: FloatArray
    covariance: FloatArray
    at_bound: BoolArray
    end: SearchEnd
    cases: tuple[tuple[float, Self], ...] = ()
    first_case: Self | None = None
    bias: FloatArray | None = None

    @classmethod
    def at(cls, problem: Problem, values: FloatArray, white: FloatArray, free: BoolArray, end: SearchEnd) -> Self:
        """The Estimate at values (p,) from whitened derivative and residual (n, p + 1) there.

        free (p,): parameters that no bound holds.
        """
        parameters = problem.parameters
        _, covariance = _posterior(white, parameters.sd, parameters.mean - values, free)
        return cls(problem, values, covariance, ~free, end)

    @classmethod
    def over_cases(
        cls,
        problem: Problem,
        values: FloatArray,
        at_bound: BoolArray,
        end: SearchEnd,
        cases: Sequence[tuple[float, Self]],
    ) -> Self:
        """The Estimate at values (p,) with the covariance of a mixture of `Estimate.cases`."""
        share, means = np.array([share for share, _ in cases]), np.array([one.values for _, one in cases])
        apart = means - share @ means
        spread = sum(share * one.covariance for share, one in cases)
        covariance = np.asarray(spread + np.einsum("c,ci,cj->ij", share, apart, apart))
        return cls(problem, values, covariance, at_bound, end, tuple(cases))

    @cached_property
    def readings_triangle(self) -> FloatArray:
        """Triangle (p + 1, p + 1) of the whitened readings' derivative by the parameters and of their residual."""
        columns = self.problem.whiten(self.problem.observations.jacobian(self.values)).reshape(-1, len(self.values))
        return triangle_of(np.column_stack([columns, self.standardized_residual.ravel()]))

    @cached_property
    def _seen(self) -> tuple[FloatArray, FloatArray]:
        """Singular values (p,) of the whitened readings' derivative in units of the prior, and directions (p, p)."""
        return _seen_by_readings(self.readings_triangle[:, :-1], self.parameters)

    @property
    def singular_values(self) -> FloatArray:
        """Singular values (p,) of the whitened readings' derivative in units of the prior's standard deviations."""
        return self._seen[0]

    @property
    def directions(self) -> FloatArray:
        """Directions (p, p) of the singular values row by row, in the parameters' units."""
        return self._seen[1]

    @property
    def parameters(self) -> Parameters:
        """The parameters that were estimated."""
        return self.problem.parameters

    @property
    def rank(self) -> int:
        """Number of combinations of parameters that the readings determine better than the prior."""
        return int((self.singular_values > _AS_PRIOR).sum())

    @property
    def null_space(self) -> FloatArray:
        """Combinations (k, p) of parameters that the prior determines and not the readings, row by row."""
        return self.directions[self.singular_values <= _AS_PRIOR]

    @cached_property
    def standard_errors(self) -> FloatArray:
        """Standard errors (p,); NaN at a bound, inf for a parameter that neither readings nor prior determine."""
        return np.where(self.at_bound, np.nan, np.sqrt(np.diag(self.covariance)))

    def prior_shares(self, priors: slice = slice(None)) -> FloatArray:
        """Shares (p,) of the variances that come from priors and not from the noise: diag(C P C) over diag(C).

        P: precisions of the priors of the parameters in `priors`, by default of all. Next to 1 for a parameter whose
        unit vector the readings do not determine; NaN where there is no variance. Of a mixture the mean over its cases.
        """
        if self.cases:
            return np.asarray(sum(share * one.prior_shares(priors) for share, one in self.cases))
        complete = self.covariance if self.bias is None else self.covariance - self.bias
        precision = np.zeros(len(self.values))
        precision[priors] = self.parameters.prior_precision[priors]
        variance = np.diag(self.covariance)
        known = (variance > 0.0) & np.isfinite(variance)
        covariance = complete[np.ix_(known, known)]
        result = np.where(np.isinf(variance), 1.0, np.nan)
        result[known] = (covariance**2 @ precision[known]) / variance[known]
        return result

    @cached_property
    def intervals(self) -> FloatArray:
        """Credible intervals (p, 2) of 95 %: the shortest ones of the linearised posterior between the bounds.

        For a parameter at a bound: that of its posterior without the bound, truncated there. From -inf to inf for a
        parameter that neither readings nor prior determine.
        """
        half = QUANTILE_95 * np.sqrt(np.diag(self.covariance))
        result, parameters = np.stack([self.values - half, self.values + half], axis=1), self.parameters
        cut = (result[:, 0] < parameters.low) | (result[:, 1] > parameters.high)
        chosen = np.flatnonzero((cut | self.at_bound | bool(self.cases)) & np.isfinite(half))
        cases = self.cases or ((1.0, self),)
        share, marginals = np.array([share for share, _ in cases]), [one.marginals(chosen) for _, one in cases]
        means, sds = (np.array(numbers) for numbers in zip(*marginals, strict=True))
        for place, k in enumerate(chosen):
            if np.isfinite(sds[:, place]).all():
                marginal = NormalMixture(share, means[:, place], sds[:, place])
                result[k] = marginal.interval(parameters.low[k], parameters.high[k])
        return result

    def marginals(self, chosen: IntArray) -> tuple[FloatArray, FloatArray]:
        """Means and standard deviations (k,) of the linearised posterior of parameters of these numbers (k,).

        Those of a parameter at a bound are without this bound. For a prior that is no mixture.
        """
        means, sds = self.values[chosen], np.sqrt(np.diag(self.covariance))[chosen]
        for place in np.flatnonzero(self.at_bound[chosen]):
            free, k = ~self.at_bound, chosen[place]
            free[k] = True
            off = self.parameters.mean - self.values
            step, covariance = _posterior(self.readings_triangle, self.parameters.sd, off, free)
            means[place] += step[k]
            sds[place] = np.sqrt(covariance[k, k] + (0.0 if self.bias is None else self.bias[k, k]))
        return means, sds

    @cached_property
    def residual(self) -> FloatArray:
        """Readings minus prediction (n, a) in their unit."""
        return self.problem.observations.residual(self.values)

    @cached_property
    def jacobian(self) -> FloatArray:
        """Derivative (n, a, p) of the residual by the parameters, in the readings' unit."""
        return self.problem.observations.jacobian(self.values)

    @cached_property
    def standardized_residual(self) -> FloatArray:
        """Whitened residuals (n, a): independent with unit variance where the model is complete."""
        return self.problem.whiten(self.residual)

    def value(self, name: str) -> float:
        """The value of one parameter; raises ValueError for an unknown name."""
        return float(self.values[self.parameters.names.index(name)])

    def standard_error(self, name: str) -> float:
        """The standard error of one parameter; raises ValueError for an unknown name."""
        return float(self.standard_errors[self.parameters.names.index(name)])

    def covariance_of(self, names: Iterable[str]) -> FloatArray:
        """Covariance (k, k) of some parameters by name; raises ValueError for an unknown name."""
        places = [self.parameters.names.index(name) for name in names]
        return self.covariance[np.ix_(places, places)]

    def block(self, name: str) -> FloatArray:
        """Values (k,) of a block of parameters; raises KeyError for an unknown name."""
        return self.values[self.parameters.slices[name]]

    def block_errors(self, name: str) -> FloatArray:
        """Standard errors (k,) of a block of parameters; raises KeyError for an unknown name."""
        return self.standard_errors[self.parameters.slices[name]]

    def biased(self, bias: FloatArray) -> Self:
        """The Estimate whose errors have a further part of covariance (p, p), made by a discrepancy of the model."""
        cases = tuple((share, one.biased(bias)) for share, one in self.cases)
        return replace(self, covariance=self.covariance + bias, cases=cases, bias=bias)

    def scaled(self, factor: float) -> Self:
        """The Estimate under a noise that is larger by a factor, for readings that weigh far more than the prior."""
        cases = tuple((share, one.scaled(factor)) for share, one in self.cases)
        return replace(self, covariance=self.covariance * factor**2, cases=cases)


def numerical_rank(columns: FloatArray, tolerance: float = 1e-9) -> int:
    """Number of combinations of columns (n, k) that differ from zero by more than a share of the largest.

    Each column counts by its own length. Columns are taken some rows at a time, so that few are held at once.
    """
    size = np.maximum(np.sqrt(np.einsum("ij,ij->j", columns, columns)), 1e-300)
    triangle = np.zeros((0, len(size)))
    for some in np.array_split(columns, len(columns) // 4000 + 1):
        triangle = np.asarray(np.linalg.qr(np.concatenate([triangle, some / size]), mode="r"))
    return int(np.linalg.matrix_rank(triangle, rtol=tolerance))


def triangle_of(rows: FloatArray) -> FloatArray:
    """Upper triangle (k, k) with the same sums of squares and products as rows (n, k)."""
    if rows.shape[1] > _MANY:
        squares = rows.T @ rows
        size = np.sqrt(np.maximum(np.diag(squares), 1e-300))
        try:
            scaled = squares / np.outer(size, size) + _RIDGE * np.eye(len(size))
            return np.asarray(np.linalg.cholesky(scaled).T * size)
        except np.linalg.LinAlgError:
            # columns that depend on each other: by orthogonal transformations instead
            pass
    if (short := rows.shape[1] - len(rows)) > 0:
        rows = np.pad(rows, ((0, short), (0, 0)))
    return np.asarray(np.linalg.qr(rows, mode="r"))


def with_prior(white: FloatArray, root: FloatArray, off: FloatArray) -> FloatArray:
    """The triangle (p + 1, p + 1) of whitened readings (n, p + 1) and priors: roots (p,) of precisions, means missed
    by off (p,).
    """
    prior = np.column_stack([np.diag(root), off])[root > 0.0]
    return triangle_of(np.concatenate([white, prior]))


def _seen_by_readings(columns: FloatArray, parameters: Parameters) -> tuple[FloatArray, FloatArray]:
    """Singular values (p,) of the readings' derivative in units of the prior, and directions (p, p) row by row."""
    length = np.linalg.norm(columns, axis=0)
    flat = _FLAT / np.where(length > 0.0, length, 1.0)
    wide = np.where(np.isfinite(parameters.wide_sd), parameters.wide_sd, parameters.sd)
    scale = np.where(np.isfinite(wide), wide, np.where(length > 0.0, flat, 1.0))
    _, sizes, directions = np.linalg.svd(columns * scale)
    count = len(scale)
    return np.pad(sizes, (0, count - len(sizes))), directions[:count] * scale


def _posterior(white: FloatArray, sd: FloatArray, mean: FloatArray, free: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Mean step (p,) and covariance (p, p) of the linearised problem.

    sd, mean (p,): of the normal priors, the mean as a step from where it is linearised; free (p,): the others are held.
    """
    root = 1.0 / sd
    count = len(sd)
    triangle = with_prior(white, root, -root * np.where(np.isfinite(sd), mean, 0.0))
    if not free.all():
        triangle = triangle_of(triangle[:, [*np.flatnonzero(free), count]])
    columns, target = triangle[:-1, :-1], triangle[:-1, -1]
    length = np.linalg.norm(columns, axis=0)
    unit = 1.0 / np.where(length > 0.0, length, 1.0)
    step, covariance = np.zeros(count), np.zeros((count, count))
    scaled = columns * unit
    if len(scaled) and np.abs(np.diag(scaled)).min() > 1.0 / _FLAT:
        half = unit[:, None] * solve_triangular(scaled, np.eye(len(scaled)))
        step[free], covariance[np.ix_(free, free)] = -half @ target, half @ half.T
        return step, covariance
    # directions that neither readings nor priors determine
    left, size, right = np.linalg.svd(scaled)
    seen = size > size.max(initial=0.0) / _FLAT
    half = unit[:, None] * right[seen].T / size[seen]
    step[free] = -half @ (left[:, seen].T @ target)
    covariance[np.ix_(free, free)] = half @ half.T
    unseen = np.flatnonzero(free)[(right[~seen] ** 2).sum(axis=0) > 1e-8]
    covariance[unseen, unseen] = np.inf
    return step, covariance
