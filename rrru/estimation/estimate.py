"""What an estimation found: values, covariance by name, residuals, rank and null space."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Self

import numpy as np
import numpy.typing as npt

from rrru.estimation.parameters import Parameters
from rrru.estimation.problem import Problem

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

# a parameter with a flat prior counts as one whose prior is so many times wider than what one column alone tells
_FLAT = 1e9
# a direction is determined where the readings tell as much of it as the prior
_AS_PRIOR = 1.0


@dataclass(frozen=True)
class SearchEnd:
    """How a search ended.

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
    singular_values (p,): of the whitened readings' derivative in units of the prior's standard deviations, with
    directions (p, p) row by row in the parameters' units; end: how the search ended; readings_triangle (p + 1, p + 1):
    of the whitened readings, derivative and residual.
    """

    problem: Problem
    values: FloatArray
    covariance: FloatArray
    at_bound: BoolArray
    singular_values: FloatArray
    directions: FloatArray
    end: SearchEnd
    readings_triangle: FloatArray

    @classmethod
    def at(cls, problem: Problem, values: FloatArray, readings: FloatArray, free: BoolArray, end: SearchEnd) -> Self:
        """The Estimate at values (p,) from the readings' triangle there; free (p,): what no bound holds.

        Where a prior is a mixture the values move to the mean over its components, each weighted by its evidence on
        the linearisation, and the covariance is that of the mixture.
        """
        parameters = problem.parameters
        sizes, directions = _seen_by_readings(readings[:, :-1], parameters)
        moved, covariance = _over_mixtures(readings, parameters, values, free)
        return cls(problem, values + moved, covariance, ~free, sizes, directions, end, readings)

    @property
    def parameters(self) -> Parameters:
        """What was estimated."""
        return self.problem.parameters

    @property
    def rank(self) -> int:
        """How many combinations of parameters the readings determine better than the prior."""
        return int((self.singular_values > _AS_PRIOR).sum())

    @property
    def null_space(self) -> FloatArray:
        """Combinations (k, p) of parameters that the prior determines and not the readings, row by row."""
        return self.directions[self.singular_values <= _AS_PRIOR]

    @cached_property
    def standard_errors(self) -> FloatArray:
        """Standard errors (p,); NaN at a bound, inf for what neither readings nor prior determine."""
        return np.where(self.at_bound, np.nan, np.sqrt(np.diag(self.covariance)))

    @cached_property
    def residual(self) -> FloatArray:
        """Readings minus prediction (n, a) in their unit."""
        return self.problem.observations.residual(self.values)

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
        return self.values[self.parameters.places[name]]

    def block_errors(self, name: str) -> FloatArray:
        """Standard errors (k,) of a block of parameters; raises KeyError for an unknown name."""
        return self.standard_errors[self.parameters.places[name]]

    def scaled(self, factor: float) -> Self:
        """The Estimate under a noise that is larger by a factor, for readings that weigh far more than the prior."""
        return replace(self, covariance=self.covariance * factor**2)


def triangle_of(rows: FloatArray) -> FloatArray:
    """Upper triangle (k, k) with the same sums of squares and products as rows (n, k)."""
    short = max(rows.shape[1] - len(rows), 0)
    return np.asarray(np.linalg.qr(np.pad(rows, ((0, short), (0, 0))) if short else rows, mode="r"))


def with_prior(readings: FloatArray, root: FloatArray, off: FloatArray) -> FloatArray:
    """The triangle (p + 1, p + 1) of readings together with priors: roots (p,) of precisions, means missed by off."""
    if not root.any():
        return readings
    prior = np.column_stack([np.diag(root), off])[root > 0.0]
    return triangle_of(np.concatenate([readings, prior]))


def _seen_by_readings(columns: FloatArray, parameters: Parameters) -> tuple[FloatArray, FloatArray]:
    """Singular values (p,) of the readings' derivative in units of the prior, and directions (p, p) row by row."""
    length = np.linalg.norm(columns, axis=0)
    flat = _FLAT / np.maximum(length, 1e-300)
    wide = np.where(np.isfinite(parameters.wide_sd), parameters.wide_sd, parameters.sd)
    scale = np.where(np.isfinite(wide), wide, np.where(length > 0.0, flat, 1.0))
    _, sizes, directions = np.linalg.svd(columns * scale)
    count = len(scale)
    return np.pad(sizes, (0, count - len(sizes))), directions[:count] * scale


def _over_mixtures(
    readings: FloatArray, parameters: Parameters, values: FloatArray, free: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Step (p,) from the values to the posterior mean, zero without mixtures, and the covariance (p, p)."""
    mixed = np.flatnonzero(np.isfinite(parameters.wide_sd) & free)
    if not len(mixed):
        return np.zeros(len(values)), _posterior(readings, parameters.sd, parameters.mean - values, free)[1]
    logs, means, covariances = [], [], []
    for case in product((parameters.sd, parameters.wide_sd), repeat=len(mixed)):
        sd = parameters.sd.copy()
        sd[mixed] = [one[place] for one, place in zip(case, mixed, strict=True)]
        mean, covariance, log = _posterior(readings, sd, parameters.mean - values, free)
        logs.append(log)
        means.append(mean)
        covariances.append(covariance)
    share = np.exp(np.array(logs) - max(logs))
    share /= share.sum()
    mean = share @ np.array(means)
    apart = np.array(means) - mean
    covariance = np.einsum("c,cij->ij", share, covariances) + np.einsum("c,ci,cj->ij", share, apart, apart)
    return mean, covariance


def _posterior(
    readings: FloatArray, sd: FloatArray, mean: FloatArray, free: BoolArray
) -> tuple[FloatArray, FloatArray, float]:
    """Mean step (p,), covariance (p, p) and log evidence, up to a constant, of the linearised problem.

    sd, mean (p,): of the normal priors, the mean as a step from where it is linearised; free (p,): the others are held.
    """
    with np.errstate(divide="ignore"):
        root = 1.0 / sd
    count = len(sd)
    triangle = with_prior(readings, root, -root * np.where(np.isfinite(sd), mean, 0.0))
    columns = triangle[:, :count][:, free]
    length = np.linalg.norm(columns, axis=0)
    unit = 1.0 / np.where(length > 0.0, length, 1.0)
    left, size, right = np.linalg.svd(columns * unit, full_matrices=False)
    seen = size > size.max(initial=0.0) / _FLAT
    half = unit[:, None] * right[seen].T / size[seen]
    step, covariance = np.zeros(count), np.zeros((count, count))
    step[free] = -half @ (left[:, seen].T @ triangle[:, -1])
    covariance[np.ix_(free, free)] = half @ half.T
    lost = (right[~seen] ** 2).sum(axis=0) > 1e-8
    unseen = np.flatnonzero(free)[lost]
    covariance[unseen, unseen] = np.inf
    rest = triangle[:, -1] - left[:, seen] @ (left[:, seen].T @ triangle[:, -1])
    log = -0.5 * float(rest @ rest) - float(np.log(size[seen]).sum()) + float(np.log(unit).sum())
    log += float(np.log(root[free & (root > 0.0)]).sum())
    return step, covariance, log
