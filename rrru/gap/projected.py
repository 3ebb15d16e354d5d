"""Least squares of some coefficients with their priors, the calibration taken out, as the evidence needs it."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from rrru.gap import evidence_kernels as kernels


class Prior(NamedTuple):
    """Prior of k coefficients: their columns' numbers, sizes at strength 1, largest sizes, and which are positive."""

    index: np.ndarray
    size: np.ndarray
    largest: np.ndarray
    positive: np.ndarray

    def at(self, strength):
        """Sizes at a strength."""
        return np.minimum(strength * self.size, self.largest)


@dataclass(frozen=True)
class Projected:
    """Least squares of k coefficients with their priors, the calibration taken out.

    Those of the terms come first, those of their shapes, owned by nobody, last. gram (levels, k, k), moment (levels,
    k); size, largest, positive (k,): of the prior; owner (k,): number of the term, the terms' count for nobody; index
    (k,): of the columns.
    """

    gram: np.ndarray
    moment: np.ndarray
    size: np.ndarray
    largest: np.ndarray
    positive: np.ndarray
    owner: np.ndarray
    index: np.ndarray

    def scale(self, strengths):
        """Prior standard deviations (m, k) at strengths (m, terms)."""
        each = np.concatenate([strengths, np.ones((len(strengths), 1))], axis=1)
        return np.minimum(each[:, self.owner] * self.size, self.largest)


def gained(problem, strengths):
    """Log evidence (levels, m) of a Projected problem at strengths (m, terms) over that of none of its terms."""
    scale = np.ascontiguousarray(problem.scale(strengths))
    gram, moment = np.ascontiguousarray(problem.gram), np.ascontiguousarray(problem.moment)
    return kernels.log_evidence(gram, moment, scale, problem.positive)


def posterior_mean(precision, moment, positive):
    """The mean (k,) of normal coefficients, or where that has negative positive ones their most probable point."""
    mean = np.linalg.solve(precision, moment)
    return _not_negative(precision, moment, positive) if (mean[positive] < 0.0).any() else mean


def _not_negative(precision, moment, positive):
    """The most probable point (k,) without negative positive coefficients: bounded least squares."""
    factor = np.linalg.cholesky(precision)
    low = np.where(positive, 0.0, -np.inf)
    return lsq_linear(factor.T, np.linalg.solve(factor, moment), bounds=(low, np.inf), method="bvls").x
