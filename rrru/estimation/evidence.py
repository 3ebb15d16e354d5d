"""Marginal likelihood (evidence) of a problem: the density of its readings with the parameters integrated out.

About an estimate the whitened readings are linear in the parameters x, and the integral over them has a closed form
(Laplace's approximation with the Gauss-Newton Hessian; MacKay, Bayesian interpolation, Neural Computation 4, 1992):

    r = r0 + A (x - x0),  x ~ N(m, S):   log p(y) = -1/2 |r'|^2 - 1/2 log |I + A S A'| - n/2 log 2 pi + log |W|

with r' the residual at the maximum, the prior's included. It is exact for a linear model. Bounds multiply it by the
posterior's probability between them over the prior's. A prior that is a mixture gives the mean over its components.

`marginalize` integrates over hyperparameters too. The noise's standard deviation times an unknown s of density 1/s^2
per s^2, with priors whose widths are in units of the noise, gives Student's integral (Gelman et al., Bayesian Data
Analysis, 3rd ed., section 14.2). Size and length scale of a smooth discrepancy are summed over a grid.
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import gammaln, log_ndtr, logsumexp

from rrru.arrays import FloatArray
from rrru.errors import FitError
from rrru.estimation.discrepancy import Discrepancy
from rrru.estimation.estimate import Estimate, triangle_of, with_prior
from rrru.estimation.problem import log_determinant

_LOG_2PI = float(np.log(2.0 * np.pi))
# a parameter is not determined where a smaller share of its column is independent of the others
_MIN_SHARE = 1e-9
# a bound that is so many standard deviations off holds no probability that matters: below 1e-15
_MAX_SD_TO_BOUND = 8.0
# relative error of a probability between several bounds, and points by which it is found
_PROBABILITY_ERROR, _PROBABILITY_POINTS = 1e-4, 100_000


@runtime_checkable
class Eliminating(Protocol):
    """Observations that leave readings out or eliminate parameters of their own: their number is not their size."""

    def normalization(self, values: FloatArray, /) -> tuple[int, float]:
        """Number of readings less that of eliminated parameters, and the log of the density's constant factor."""

    def eliminate(self, columns: FloatArray, values: FloatArray, /) -> FloatArray:
        """Columns (n, a, c) of changes of the residual, with the eliminated parameters following them."""


@dataclass(frozen=True, eq=False)
class MarginalLikelihood:
    """The marginal likelihood of a problem, and its parameters at the likeliest hyperparameters.

    log_evidence: natural logarithm, over all hyperparameters; noise_scale: factor on the problem's noise;
    discrepancy_scale: standard deviation of the discrepancy in units of the problem's noise; covariance (p, p): of the
    parameters at these.
    """

    log_evidence: float
    noise_scale: float
    discrepancy_scale: float
    covariance: FloatArray


def log_evidence(estimate: Estimate, common: Collection[str] = ()) -> float:
    """Log marginal likelihood of an estimate's problem, linearised at the estimate, under its known noise.

    common: names of parameters with a flat prior, which counts with density 1 per unit: only differences between
    problems that share them have a meaning. Raises FitError as `marginalize` does.
    """
    return marginalize(estimate, common=common, noise_known=True).log_evidence


def marginalize(
    estimate: Estimate,
    discrepancy: Discrepancy | None = None,
    *,
    common: Collection[str] = (),
    noise_known: bool = False,
) -> MarginalLikelihood:
    """The MarginalLikelihood over the size of the noise, unless it is known, and of a discrepancy where one is given.

    common: as of `log_evidence`. Where the noise's size is unknown, a probability between bounds is that at its
    estimate. Raises FitError where a parameter that is not common has a flat prior, readings and prior do not determine
    one, the noise's determinant is not known, the loss is robust, or no reading is left to determine an unknown noise.
    """
    model = _LinearModel(estimate, tuple(common), noise_known)
    found = [model.integrate(case.sd, *grid) for case in estimate.parameters.cases for grid in model.grid(discrepancy)]
    logs = np.array([one.log_evidence for one in found])
    best = found[int(logs.argmax())]
    log = float(logsumexp(logs) - np.log(len(logs)))
    return MarginalLikelihood(log, best.noise_scale, best.discrepancy_scale, best.covariance)


class _LinearModel:
    """A problem linearised at its estimate."""

    def __init__(self, estimate: Estimate, common: tuple[str, ...], noise_known: bool) -> None:
        self._problem, self._values, self._noise_known = estimate.problem, estimate.values, noise_known
        parameters = self._problem.parameters
        flat = [name for name, sd in zip(parameters.names, parameters.sd, strict=True) if np.isinf(sd)]
        if not set(flat) <= set(common):
            raise FitError(f"flat priors of {', '.join(sorted(set(flat) - set(common)))}; allowed: proper priors")
        if self._problem.loss != "linear":
            raise FitError(f"a {self._problem.loss} loss has no likelihood; allowed: linear")
        observations = self._problem.observations
        if isinstance(observations, Eliminating):
            self._count, self._constant = observations.normalization(self._values)
        else:
            self._count = observations.residual(self._values).size
            self._constant = log_determinant(self._problem.whiten)
        if not noise_known and self._count - len(flat) < 1:
            text = f"{self._count} readings for {len(flat)} parameters without a prior do not determine the noise"
            raise FitError(f"{text}; allowed: more readings than such parameters, or a known noise")

    @cached_property
    def _rows(self) -> FloatArray:
        """Whitened derivative and residual (n a, p + 1) at the estimate."""
        observations, whiten = self._problem.observations, self._problem.whiten
        columns = whiten(observations.jacobian(self._values)).reshape(-1, len(self._values))
        return np.column_stack([columns, whiten(observations.residual(self._values)).ravel()])

    def grid(self, discrepancy: Discrepancy | None) -> Iterator[tuple[FloatArray, float, float]]:
        """Triangles (p + 1, p + 1) of the readings under every discrepancy, half its log determinant, and its size."""
        if discrepancy is None:
            yield triangle_of(self._rows), 0.0, 0.0
            return
        basis, upper = np.linalg.qr(self._whitened(discrepancy.columns))
        inside = basis.T @ self._rows
        outside = triangle_of(self._rows - basis @ inside)
        for amplitudes in discrepancy.amplitudes:
            half = upper * amplitudes
            variance, axes = np.linalg.eigh(half @ half.T)
            turned = axes.T @ inside
            for size in discrepancy.sizes:
                # (I + size^2 H H')^-1/2 in the eigenvectors of H H'
                grown = 1.0 + size**2 * np.maximum(variance, 0.0)
                triangle = triangle_of(np.concatenate([outside, turned / np.sqrt(grown)[:, None]]))
                yield triangle, 0.5 * float(np.log(grown).sum()), float(size)

    def _whitened(self, columns: FloatArray) -> FloatArray:
        """Whitened columns (n a, s) of a discrepancy (n, a, s), in units of the noise."""
        if isinstance(self._problem.observations, Eliminating):
            columns = self._problem.observations.eliminate(columns, self._values)
        return self._problem.whiten(columns).reshape(-1, columns.shape[-1])

    def integrate(
        self, sd: FloatArray, readings: FloatArray, half_determinant: float, size: float
    ) -> MarginalLikelihood:
        """The integral over the parameters, with priors of standard deviations (p,), and over an unknown noise."""
        parameters = self._problem.parameters
        flat = np.isinf(sd)
        root = np.where(flat, 0.0, 1.0 / sd)
        triangle = with_prior(readings, root, root * (self._values - parameters.mean))
        upper, square = triangle[:-1, :-1], float(triangle[-1, -1] ** 2)
        diagonal = np.abs(np.diag(upper))
        if not (known := diagonal > _MIN_SHARE * np.linalg.norm(upper, axis=0)).all():
            raise FitError(f"neither readings nor prior determine {np.array(parameters.names)[~known].tolist()}")
        freedom = self._count - int(flat.sum())
        log = self._constant - half_determinant - float(np.log(diagonal).sum()) + float(np.log(root[~flat]).sum())
        scale = 1.0
        if self._noise_known:
            log -= 0.5 * (freedom * _LOG_2PI + square)
        else:
            square = max(square, 1e-300)
            scale = float(np.sqrt(square / freedom))
            log += float(gammaln(0.5 * freedom)) - 0.5 * freedom * float(np.log(np.pi * square))
        half = solve_triangular(upper, np.eye(len(upper)))
        covariance = scale**2 * half @ half.T
        mean = self._values - half @ triangle[:-1, -1]
        bounds = parameters.low, parameters.high
        log += _log_probability(mean, covariance, *bounds)
        log -= _log_probability(parameters.mean, np.diag(np.where(flat, 0.0, scale * sd) ** 2), *bounds)
        return MarginalLikelihood(log, scale, size * scale, covariance)


def _log_probability(mean: FloatArray, covariance: FloatArray, low: FloatArray, high: FloatArray) -> float:
    """Log probability that normal values of a mean (p,) and covariance (p, p) are between bounds (p,)."""
    sd = np.sqrt(np.diag(covariance))
    near = (sd > 0.0) & ((mean - low < _MAX_SD_TO_BOUND * sd) | (high - mean < _MAX_SD_TO_BOUND * sd))
    chosen = np.flatnonzero(near)
    if not len(chosen):
        return 0.0
    covariance = covariance[np.ix_(chosen, chosen)]
    below, above = ((bound - mean)[chosen] for bound in (low, high))
    if not (covariance - np.diag(np.diag(covariance))).any():
        return float(_log_between(below / sd[chosen], above / sd[chosen]).sum())
    # loading it takes a fifth of a job's start, and few jobs come here
    from scipy.stats import multivariate_normal

    probability = multivariate_normal.cdf(
        above,
        cov=covariance,
        lower_limit=below,
        maxpts=_PROBABILITY_POINTS * len(chosen),
        abseps=0.0,
        releps=_PROBABILITY_ERROR,
        rng=np.random.default_rng(0),
        allow_singular=True,
    )
    return float(np.log(max(float(probability), 1e-300)))


def _log_between(low: FloatArray, high: FloatArray) -> FloatArray:
    """Log probability (k,) that standard normal values are between low and high (k,)."""
    # the difference is taken in the tail where it is not one of numbers near 1
    flip = low > 0.0
    low, high = np.where(flip, -high, low), np.where(flip, -low, high)
    return np.asarray(log_ndtr(high) + np.log1p(-np.exp(log_ndtr(low) - log_ndtr(high))))
