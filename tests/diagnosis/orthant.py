"""Probability and moments of a multivariate normal distribution whose coefficients cannot be negative.

A half-normal prior needs the probability of the positive orthant under the posterior of the untruncated coefficients,

    P = Pr(x_i > 0 for all i),    x ~ N(m, C),

and the mean and covariance of x in the orthant. Expectation propagation replaces each condition x_i > 0 by a factor
exp(-t_i x_i^2 / 2 + n_i x_i), so that mean and variance of x_i equal those under the condition (Cunningham, Hennig and
Lacoste-Julien, Gaussian probabilities and expectation propagation, arXiv:1111.6832, 2011). The first sweep takes the
least probable coefficient first; it is the sequential conditioning of Mendell and Elston (Multifactorial qualitative
traits, Biometrics 30, 1974). The next terms of the series whose sum is exact correct log P by

    sum over i < j of r_ij^3 (s_i s_j / 6 + r_ij k_i k_j / 24)

with skewness s, excess kurtosis k and correlation r (Opper, Paquet and Winther, Perturbative corrections for
approximate inference in Gaussian latent variable models, Journal of Machine Learning Research 14, 2013). The size of
this correction shows how far log P may be off.
"""

import numpy as np

from rrru.diagnosis import evidence_kernels as kernels

# relative change of a variance below which a factor stays, and updates of each: unlike log P moments are not stationary
_TOLERANCE, _MAX_SWEEPS = 1e-8, 1000


def log_orthant(mean, covariance):
    """Log P of x ~ N(mean, covariance), and the correction that it contains; one coefficient is exact.

    mean (p,), covariance (p, p), positive definite.

    >>> log, correction = log_orthant([0.0, 0.0], [[1.0, 0.5], [0.5, 1.0]])
    >>> round(float(np.exp(log)), 3), round(correction, 3)  # exact: 1/4 + asin(0.5) / (2 pi) = 1/3
    (0.333, 0.002)
    """
    mean, covariance = np.array(mean, dtype=float), np.array(covariance, dtype=float)
    return kernels.log_orthant(mean, covariance, *_workspace(len(mean)))


def truncated_moments(mean, covariance, positive):
    """Mean (k,) and covariance (k, k) of x ~ N(mean, covariance) under x_i > 0 for the coefficients positive (k,).

    mean (k,), covariance (k, k), positive definite. Expectation propagation matches mean and variance of every
    non-negative coefficient; the others follow by their regression on these. Raises LinAlgError where the covariance of
    the non-negative coefficients is singular.
    """
    mean, covariance = np.array(mean, dtype=float), np.array(covariance, dtype=float)
    index = np.flatnonzero(positive)
    own = covariance[np.ix_(index, index)]
    matched, within = mean[index], own.copy()
    kernels.match_factors(matched, within, *_workspace(len(index)), _TOLERANCE, _MAX_SWEEPS)
    regression = np.linalg.solve(own, covariance[index]).T
    change = regression @ (within - own) @ regression.T
    return mean + regression @ (matched - mean[index]), covariance + 0.5 * (change + change.T)


def _workspace(count):
    """Arrays that the kernels overwrite."""
    return np.empty(count, dtype=np.int64), np.empty((count, kernels.COLUMNS))
