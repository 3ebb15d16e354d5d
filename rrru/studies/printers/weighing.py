"""Readings as a linear model under one ratio of noises, and what F says of columns that are added to it."""

from dataclasses import dataclass

import numpy as np
from scipy import special

from rrru.fit.identifiability import RANK_TOLERANCE


@dataclass(frozen=True)
class Weighing:
    """Readings under one ratio of noises.

    weight (n,): of every reading; absorbed (n, a): orthonormal basis of weighted readings that the fit absorbs; volume:
    logarithm of the weights' product over the weighted columns' volume, the likelihood's factor without data.
    """

    weight: np.ndarray
    absorbed: np.ndarray
    volume: float

    @classmethod
    def of(cls, jacobian, weight):
        """The weighing of a fit with columns (n, p)."""
        basis, triangle = np.linalg.qr(jacobian * weight[:, None])
        return cls(weight, basis, np.log(weight).sum() - np.log(np.abs(np.diag(triangle))).sum())

    def left(self, readings):
        """Readings (..., n) weighted, less what the fit absorbs."""
        weighted = readings * self.weight
        return weighted - (weighted @ self.absorbed) @ self.absorbed.T

    def basis(self, columns):
        """Orthonormal basis (n, r) of what the fit does not absorb of columns (n, k), and its volume's logarithm."""
        scale = np.linalg.norm(columns * self.weight[:, None], axis=0)
        basis, size, _ = np.linalg.svd(self.left((columns / scale).T).T, full_matrices=False)
        kept = size > RANK_TOLERANCE
        return basis[:, kept], np.log(size[kept]).sum() + np.log(scale).sum()

    def single(self):
        """Bases (n, n, 1) of every reading by itself, zero for one that the fit absorbs whole, and their volumes'."""
        free = np.eye(len(self.weight)) - self.absorbed @ self.absorbed.T
        size = np.linalg.norm(free, axis=1, keepdims=True)
        seen = size > RANK_TOLERANCE
        volume = np.log(np.where(seen, size, 1.0)[:, 0] * self.weight)
        return np.where(seen, free / size, 0.0)[..., None], volume

    def beside(self, columns):
        """The weighing of a fit that has columns (n, k) too."""
        basis, volume = self.basis(columns)
        return Weighing(self.weight, np.concatenate([self.absorbed, basis], axis=1), self.volume - volume)

    def p(self, bases, volumes, readings):
        """Probabilities (..., b) that noise explains as much of readings (..., n) as bases (b, n, r), and the log
        likelihoods (..., b) of what they leave; NaN without freedom.
        """
        left, count = self.left(readings), bases.shape[-1]
        explained = (np.einsum("...n,bnr->...br", left, bases) ** 2).sum(axis=-1)
        freedom = len(self.weight) - self.absorbed.shape[1] - count
        if not count or freedom < 1:
            return np.full(explained.shape, np.nan), np.zeros(explained.shape)
        rest = (left**2).sum(axis=-1)[..., None] - explained
        likelihood = self.volume - volumes - 0.5 * freedom * np.log(rest)
        return special.fdtrc(count, freedom, explained / count * freedom / rest), likelihood


def largest_p(weighings, bases, readings):
    """Largest p (..., b) over weighings of bases, as `Weighing.basis` gives them for each."""
    return np.max([one.p(*basis, readings)[0] for one, basis in zip(weighings, bases, strict=True)], axis=0)


def mean_p(weighings, bases, readings):
    """Mean p (..., b) over weighings of bases, weighed by their likelihoods."""
    parts = [one.p(*basis, readings) for one, basis in zip(weighings, bases, strict=True)]
    each, likelihood = (np.array(part) for part in zip(*parts, strict=True))
    return (each * special.softmax(likelihood, axis=0)).sum(axis=0)
