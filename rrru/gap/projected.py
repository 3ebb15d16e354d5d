"""Least squares of some coefficients with their priors, the calibration taken out, as the evidence needs it."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from rrru.gap import evidence_kernels as kernels


class Prior(NamedTuple):
    """Prior of k coefficients: columns' numbers, sizes at strength 1, largest sizes, and which are positive."""

    index: np.ndarray
    size: np.ndarray
    largest: np.ndarray
    positive: np.ndarray

    @classmethod
    def normal(cls, index):
        """Of columns of unit deviation, which no strength scales."""
        nothing = np.zeros(len(index))
        return cls(index, nothing + 1.0, nothing + np.inf, nothing > 0.0)

    def at(self, strength):
        """Sizes at a strength."""
        return np.minimum(strength * self.size, self.largest)


@dataclass(frozen=True)
class Projected:
    """Least squares of k coefficients with their priors, the calibration taken out.

    Those of the terms come first, then those of their shapes, last those of the weight, both owned by nobody. gram
    (levels, k, k), moment (levels, k); size, largest, positive, about (k,): of the prior; owner (k,): number of the
    term, the terms' count for nobody; index (r,): of the columns; mix (r, k): what makes the coefficients' columns of
    these, None where they are the same; weights: of the weight's coefficients whether each is a lean, no mass,
    and at_least (terms,): strengths under which the terms are as large as found.
    """

    gram: np.ndarray
    moment: np.ndarray
    size: np.ndarray
    largest: np.ndarray
    positive: np.ndarray
    about: np.ndarray
    owner: np.ndarray
    index: np.ndarray
    mix: np.ndarray | None = None
    weights: tuple[bool, ...] = ()
    at_least: np.ndarray | None = None

    @classmethod
    def of(cls, priors, count, grams):
        """Of the Priors of so many terms, and after them of their shapes.

        grams: from numbers (k,) of columns to their Gram matrices (levels, k, k) and moments (levels, k).
        """
        owner = np.repeat(np.minimum(np.arange(len(priors)), count), [len(prior.index) for prior in priors])
        index, *rest = (np.concatenate(parts) for parts in zip(*priors, strict=True))
        return cls(*grams(index), *rest, np.zeros(len(index)), owner, index)

    def on(self, grams, moments):
        """The problem on other Gram matrices (levels, r, r) and moments (levels, r) of its columns."""
        if self.mix is None:
            return replace(self, gram=grams, moment=moments)
        return replace(self, gram=self.mix.T @ grams @ self.mix, moment=moments @ self.mix)

    def scale(self, strengths):
        """Prior standard deviations (m, k) at strengths (m, terms)."""
        each = np.concatenate([strengths, np.ones((len(strengths), 1))], axis=1)
        return np.minimum(each[:, self.owner] * self.size, self.largest)


def gained(problem, strengths):
    """Log evidence (levels, m) of a Projected problem at strengths (m, terms) over that of none of its terms."""
    scale = np.ascontiguousarray(problem.scale(strengths))
    gram, moment = np.ascontiguousarray(problem.gram), np.ascontiguousarray(problem.moment)
    if not problem.about.any():
        return kernels.log_evidence(gram, moment, scale, problem.positive)
    explained = gram @ problem.about
    at_means = (moment - 0.5 * explained) @ problem.about
    return at_means[:, None] + kernels.log_evidence(gram, moment - explained, scale, problem.positive)


def posterior_mean(gram, moment, scale, positive, about):
    """The mean (k,) of normal coefficients, or where that has negative positive ones their most probable point.

    gram (k, k), moment (k,); scale, positive, about (k,): of the prior.
    """
    precision, moment = gram + np.diag(scale**-2.0), moment - gram @ about
    mean = np.linalg.solve(precision, moment)
    return about + (_not_negative(precision, moment, positive) if (mean[positive] < 0.0).any() else mean)


def _not_negative(precision, moment, positive):
    """The most probable point (k,) without negative positive coefficients: bounded least squares."""
    factor = np.linalg.cholesky(precision)
    low = np.where(positive, 0.0, -np.inf)
    return lsq_linear(factor.T, np.linalg.solve(factor, moment), bounds=(low, np.inf), method="bvls").x
