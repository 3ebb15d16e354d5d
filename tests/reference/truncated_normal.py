"""Evidence and moments of linear models with non-negative coefficients by importance sampling: slow and obvious.

Of coefficients c with normal priors of deviations s, halved where they cannot be negative, and data of Gram matrix G
and moments g, the log evidence over that of c = 0 is log of the mean of prior(c) exp(g c - c G c / 2) / q(c) over draws
of a density q: one coefficient after the other from its normal posterior given those before, cut off at zero (Geweke
1991; Hajivassiliou and Ruud 1994).
"""

from typing import NamedTuple

import numpy as np
from scipy.special import log_ndtr, ndtri_exp
from scipy.stats import norm, qmc


class Sampled(NamedTuple):
    """Log evidence and its standard error, effective share of the draws, mean (k,) and covariance (k, k)."""

    log: float
    error: float
    size: float
    mean: np.ndarray
    covariance: np.ndarray


def posterior(gram, moment, scale):
    """Mean (k,) and covariance (k, k) of coefficients with normal priors that are not halved."""
    covariance = np.linalg.inv(gram + np.diag(scale**-2.0))
    return covariance @ moment, 0.5 * (covariance + covariance.T)


def sample_evidence(gram, moment, scale, positive, seed=0, draws=2**13, repeats=8):
    """The log evidence, and the posterior's moments, of coefficients (k,); repeats: independent scrambled sequences."""
    mean, covariance = posterior(gram, moment, scale)
    order = _improbable_first(mean, covariance, positive)
    lower = np.linalg.cholesky(covariance[np.ix_(order, order)])
    logs, sizes, means, seconds = [], [], [], []
    for repeat in range(repeats):
        uniform = qmc.Sobol(len(mean), seed=np.random.default_rng([seed, repeat])).random(draws)
        c, log_q = _draw(uniform, mean[order], lower, positive[order])
        c = c[:, np.argsort(order)]
        prior = norm.logpdf(c, scale=scale).sum(axis=1) + positive.sum() * np.log(2.0)
        log = prior + c @ moment - 0.5 * np.einsum("nk,kl,nl->n", c, gram, c) - log_q
        weight = np.exp(log - log.max())
        logs.append(np.log(weight.mean()) + log.max())
        sizes.append(weight.sum() ** 2 / (weight**2).sum() / draws)
        share = weight / weight.sum()
        means.append(share @ c)
        seconds.append(np.einsum("n,nk,nl->kl", share, c, c))
    center = np.mean(means, axis=0)
    spread = np.mean(seconds, axis=0) - np.outer(center, center)
    return Sampled(np.mean(logs), np.std(logs, ddof=1) / np.sqrt(repeats), np.mean(sizes), center, spread)


def _improbable_first(mean, covariance, positive):
    """Numbers (k,) of the coefficients: non-negative ones by their probability, then the others."""
    z = mean / np.sqrt(np.diag(covariance))
    return np.argsort(np.where(positive, z, np.inf), kind="stable")


def _draw(uniform, mean, lower, positive):
    """Coefficients (n, k) from uniform numbers (n, k), and the log density (n,) that they are drawn from."""
    n, k = uniform.shape
    standard, log_q = np.zeros((n, k)), np.zeros(n)
    for i in range(k):
        center = mean[i] + standard[:, :i] @ lower[i, :i]
        log_share = log_ndtr(center / lower[i, i]) if positive[i] else np.zeros(n)
        # the upper tail of that share
        standard[:, i] = -ndtri_exp(np.log(np.maximum(uniform[:, i], 1e-16)) + log_share)
        log_q += norm.logpdf(standard[:, i]) - log_share - np.log(lower[i, i])
    return mean + standard @ lower.T, log_q
