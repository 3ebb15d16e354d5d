"""Inner loops of the evidence."""

import math

import numba
import numpy as np


@numba.njit(cache=True, error_model="numpy")
def log_ndtr(x):
    """Logarithm of the standard normal distribution function."""
    if x > -30.0:
        return math.log(0.5 * math.erfc(-x / math.sqrt(2.0)))
    # the tail's asymptotic series (Abramowitz and Stegun 26.2.12), good to 1e-7 here
    return -0.5 * x * x - math.log(-x) - 0.5 * math.log(2.0 * math.pi) - 1.0 / x**2 + 2.5 / x**4


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def _with_positive(total, low, half, inverse, positive, first):
    """A log evidence with the positive coefficients' halves; rows of the factor's inverse before the first stand."""
    k = len(half)
    for c in range(k):
        if not positive[c]:
            continue
        if c >= first:
            inverse[c, c] = 1.0 / low[c, c]
        for r in range(max(c + 1, first), k):
            entry = 0.0
            for q in range(c, r):
                entry -= low[r, q] * inverse[q, c]
            inverse[r, c] = entry / low[r, r]
        mean, variance = 0.0, 0.0
        for r in range(c, k):
            mean += inverse[r, c] * half[r]
            variance += inverse[r, c] * inverse[r, c]
        total += log_ndtr(mean / math.sqrt(variance)) + math.log(2.0)
    return total


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def log_evidence(gram, moment, scale, positive):
    """Logarithm of the evidence of k normal coefficients over that of zero coefficients.

    gram (v, k, k), moment (v, k): of the whitened columns, for v noise levels; scale (m, k): prior standard deviations;
    positive (k,): coefficients whose prior is the positive half, whose posterior is counted as independent of the
    others. Returns (v, m).
    """
    v, k = moment.shape
    m = scale.shape[0]
    result = np.empty((v, m))
    low, inverse = np.zeros((k, k)), np.zeros((k, k))
    half, gained = np.empty(k), np.zeros(k + 1)
    for level in range(v):
        for j in range(m):
            # rows of the factor stand as long as no scale up to them changes
            first = 0
            while j > 0 and first < k and scale[j, first] == scale[j - 1, first]:
                first += 1
            for r in range(first, k):
                for c in range(r + 1):
                    entry = scale[j, r] * scale[j, c] * gram[level, r, c]
                    if r == c:
                        entry += 1.0
                    for q in range(c):
                        entry -= low[r, q] * low[c, q]
                    # pivots of the identity plus a Gram matrix are at least 1; rounding must not make them less
                    low[r, c] = math.sqrt(max(entry, 1.0)) if r == c else entry / low[c, c]
                entry = scale[j, r] * moment[level, r]
                for q in range(r):
                    entry -= low[r, q] * half[q]
                half[r] = entry / low[r, r]
                gained[r + 1] = gained[r] + (0.5 * half[r] * half[r] - math.log(low[r, r]))
            result[level, j] = _with_positive(gained[k], low, half, inverse, positive, first)
    return result


def log_sum_exp(value):
    """Logarithm of the sums of exponentials along the last axis: scipy's, without what it costs on small arrays."""
    top = value.max(axis=-1, keepdims=True)
    largest = value == top
    count = largest.sum(axis=-1)
    rest = np.exp(np.where(largest, -np.inf, value) - top).sum(axis=-1)
    return np.log1p(rest / count) + np.log(count) + top[..., 0]
