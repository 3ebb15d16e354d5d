"""Inner loops of the evidence, all compiled functions in one file: Numba's cache does not see changes of other files.

The evidence of normal coefficients is that of their Cholesky factor. Non-negative ones, whose priors are halved, add
the logarithm of 2^p P, where P is the probability that they are positive under the posterior of the untruncated
coefficients; `tests.diagnosis.orthant` has its equations.
"""

import math

import numba
import numpy as np
from scipy import special

from rrru.arrays import BoolArray, FloatArray, IntArray

# standard deviations above zero from which a condition is certain: its probability is 1 - 3e-5
_CERTAIN_Z = 4.0
# standard deviations from zero between which moments come from a table, and its entries per standard deviation
_LOW_Z, _HIGH_Z, _PER_Z = -30.0, 9.0, 32
# relative change of a variance below which a factor stays, and updates of each: log P is stationary in the factors
_LOG_TOLERANCE, _MAX_LOG_SWEEPS = 0.02, 30
# smallest share of a precision that rounding leaves without the coefficient's own factor
_MIN_CAVITY = 1e-10
# rows that are looked back on for an equal one
_LOOK_BACK = 64
# product of pivots at which its logarithm is taken, far from overflow
_MAX_PRODUCT = 1e200
# columns of expectation propagation: precision and shift of a factor; of the coefficient without its factor (cavity)
# precision, standard deviation, mean over that, log probability of the condition, and mean and variance under the
# condition over that deviation; mean without any factor
_FACTOR, _SHIFT, _CAVITY, _DEVIATION, _Z, _LOG, _MEAN, _VARIANCE, _START = range(9)
COLUMNS = 9


@numba.njit(cache=True, error_model="numpy")
def log_ndtr(x: float) -> float:
    """Logarithm of the standard normal distribution function."""
    if x > -30.0:
        return math.log(0.5 * math.erfc(-x / math.sqrt(2.0)))
    # the tail's asymptotic series (Abramowitz and Stegun 26.2.12), good to 1e-7 here
    return -0.5 * x * x - math.log(-x) - 0.5 * math.log(2.0 * math.pi) - 1.0 / x**2 + 2.5 / x**4


def _tabulate() -> FloatArray:
    """Logarithm (n,) of the normal distribution function and its derivative, the inverse Mills ratio (n,)."""
    z = np.linspace(_LOW_Z, _HIGH_Z, round((_HIGH_Z - _LOW_Z) * _PER_Z) + 1)
    log = special.log_ndtr(z)
    return np.column_stack([log, np.exp(-0.5 * z * z - 0.5 * np.log(2.0 * np.pi) - log)])


_TABLE = _tabulate()


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def _truncate(z: float) -> tuple[float, float, float]:
    """Log probability of y > 0 with y ~ N(z, 1), and mean and variance of y under that condition.

    By cubic interpolation between values and derivatives of a table, good to 1e-8.
    """
    if z >= _HIGH_Z:
        return 0.0, z, 1.0
    if z < _LOW_Z:
        u = 1.0 / (z * z)
        return log_ndtr(z), -(1.0 - 2.0 * u + 10.0 * u * u) / z, u * (1.0 - 6.0 * u + 50.0 * u * u)
    place = (z - _LOW_Z) * _PER_Z
    i = int(place)
    t = place - i
    low, high = z - t / _PER_Z, z + (1.0 - t) / _PER_Z
    log, r, s = _TABLE[i, 0], _TABLE[i, 1], _TABLE[i + 1, 1]
    up, left, right = t * t * (3.0 - 2.0 * t), t * (1.0 - t) * (1.0 - t) / _PER_Z, -t * t * (1.0 - t) / _PER_Z
    log += up * (_TABLE[i + 1, 0] - log) + left * r + right * s
    # the ratio's own derivative is -ratio (z + ratio)
    ratio = r + up * (s - r) - left * r * (low + r) - right * s * (high + s)
    mean = z + ratio
    return log, mean, 1.0 - ratio * mean


@numba.njit(cache=True, error_model="numpy")
def _cumulants(z: float, mean: float, variance: float) -> tuple[float, float]:
    """Skewness and excess kurtosis of y ~ N(z, 1) under y > 0, where its mean and variance are known."""
    if z < _LOW_Z:
        # those of the exponential distribution
        return 2.0, 6.0
    r = mean - z
    third = r * (mean * (mean + r) - 1.0)
    fourth = -r * (z * z * z + 7.0 * z * z * r + 12.0 * z * r * r + 6.0 * r * r * r - 3.0 * z - 4.0 * r)
    return third / (variance * math.sqrt(variance)), fourth / (variance * variance)


@numba.njit(cache=True, error_model="numpy")
def _find_least_probable(mean: FloatArray, covariance: FloatArray, order: IntArray, count: int) -> int:
    """Place in the order of the least probable coefficient without a factor, -1 where all these are certain."""
    best, lowest = -1, _CERTAIN_Z
    for place in range(count, len(order)):
        i = order[place]
        z = mean[i] / math.sqrt(covariance[i, i])
        if z < lowest:
            best, lowest = place, z
    return best


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def _multiply(mean: FloatArray, covariance: FloatArray, i: int, precision: float, shift: float) -> float:
    """Multiply a normal density by exp(-precision x_i^2 / 2 + shift x_i), in place; returns the variance's ratio."""
    p = len(mean)
    ratio: float = 1.0 + precision * covariance[i, i]
    step, reduced, inverse = (shift - precision * mean[i]) / ratio, precision / ratio, 1.0 / ratio
    for r in range(p):
        mean[r] += covariance[i, r] * step
        if r != i:
            factor = reduced * covariance[i, r]
            for c in range(r + 1):
                if c != i:
                    covariance[r, c] -= factor * covariance[i, c]
                    covariance[c, r] = covariance[r, c]
    for r in range(p):
        covariance[i, r] *= inverse
        covariance[r, i] = covariance[i, r]
    return ratio


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def match_factors(
    mean: FloatArray, covariance: FloatArray, order: IntArray, state: FloatArray, tolerance: float, sweeps: int
) -> tuple[int, float]:
    """Find factors that match the moments, and multiply a normal density, mean (p,) and covariance (p, p), by them.

    order (p,), state (p, COLUMNS): overwritten by the coefficients' numbers, those with a factor first, and by what is
    known of each factor; tolerance: relative change of a variance below which a factor stays; sweeps: most updates of
    each. Returns how many coefficients have a factor, and log |I + C diag(t)|.
    """
    p = len(mean)
    for i in range(p):
        order[i], state[i, _FACTOR], state[i, _SHIFT], state[i, _START] = i, 0.0, 0.0, mean[i]
    count, place, unchanged, determinant = 0, 0, 0, 0.0
    for _ in range(sweeps * p):
        if place == count:
            place = _find_least_probable(mean, covariance, order, count)
            if place >= 0:
                order[count], order[place] = order[place], order[count]
                place, count, unchanged = count, count + 1, 0
            else:
                place = 0
        if unchanged >= count:
            break
        i = order[place]
        place += 1
        total, factor = 1.0 / covariance[i, i], state[i, _FACTOR]
        cavity = max(total - factor, _MIN_CAVITY * total)
        deviation = 1.0 / math.sqrt(cavity)
        z = (mean[i] * total - state[i, _SHIFT]) * deviation
        log, matched, variance = _truncate(z)
        state[i, _CAVITY], state[i, _DEVIATION], state[i, _Z] = cavity, deviation, z
        state[i, _LOG], state[i, _MEAN], state[i, _VARIANCE] = log, matched, variance
        more = max(cavity / variance - cavity, 0.0) - factor
        if abs(more) < tolerance * total:
            unchanged += 1
            continue
        # a factor that has just changed matches
        unchanged = 1
        step = (matched / variance - z) / deviation - state[i, _SHIFT]
        determinant += math.log(_multiply(mean, covariance, i, more, step))
        state[i, _FACTOR] += more
        state[i, _SHIFT] += step
    return count, determinant


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def log_orthant(mean: FloatArray, covariance: FloatArray, order: IntArray, state: FloatArray) -> tuple[float, float]:
    """Log probability that x ~ N(mean, covariance) is positive, and the correction that it contains.

    mean (p,), covariance (p, p), order (p,), state (p, COLUMNS): overwritten.
    """
    if len(mean) == 1:
        return log_ndtr(mean[0] / math.sqrt(covariance[0, 0])), 0.0
    count, determinant = match_factors(mean, covariance, order, state, _LOG_TOLERANCE, _MAX_LOG_SWEEPS)
    total, correction = -0.5 * determinant, 0.0
    for place in range(count):
        i = order[place]
        factor, shift, cavity, z = state[i, _FACTOR], state[i, _SHIFT], state[i, _CAVITY], state[i, _Z]
        joint, both = z / state[i, _DEVIATION] + shift, cavity + factor
        # the integral of a factor over the density without it is the probability of the condition
        total += state[i, _LOG] + 0.5 * (math.log(both / cavity) + z * z - joint * joint / both)
        total += 0.5 * ((shift - factor * mean[i]) * state[i, _START] + mean[i] * shift)
        state[i, _MEAN], state[i, _VARIANCE] = _cumulants(z, state[i, _MEAN], state[i, _VARIANCE])
        state[i, _DEVIATION] = 1.0 / math.sqrt(covariance[i, i])
        for q in range(place):
            j = order[q]
            r = covariance[i, j] * state[i, _DEVIATION] * state[j, _DEVIATION]
            third, fourth = state[i, _MEAN] * state[j, _MEAN], state[i, _VARIANCE] * state[j, _VARIANCE]
            correction += r * r * r * (third / 6.0 + r * fourth / 24.0)
    return total + correction, correction


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def _factorize(
    gram: FloatArray,
    moment: FloatArray,
    scale: FloatArray,
    first: int,
    low: FloatArray,
    half: FloatArray,
    squares: FloatArray,
    logs: FloatArray,
) -> None:
    """Cholesky factor L of I + S gram S with S = diag(scale), and half = L^-1 S moment, from row first on.

    gram (k, k), of which the lower half is read, moment, scale (k,); low (k, k): L, on its diagonal reciprocals;
    half (k,); squares (k + 1,): sums of squares of the entries of half before each; logs (k + 1, 2): sums of the
    pivots' logarithms before each, and a product of pivots whose logarithm is yet to be added.
    """
    for r in range(first, len(half)):
        for c in range(r):
            entry = scale[r] * scale[c] * gram[r, c]
            for q in range(c):
                entry -= low[r, q] * low[c, q]
            low[r, c] = entry * low[c, c]
        pivot = 1.0 + scale[r] * scale[r] * gram[r, r]
        entry = scale[r] * moment[r]
        for q in range(r):
            pivot -= low[r, q] * low[r, q]
            entry -= low[r, q] * half[q]
        # pivots of the identity plus a Gram matrix are at least 1; rounding must not make them less
        pivot = max(pivot, 1.0)
        low[r, r] = 1.0 / math.sqrt(pivot)
        half[r] = entry * low[r, r]
        squares[r + 1] = squares[r] + half[r] * half[r]
        logs[r + 1, 0], logs[r + 1, 1] = logs[r, 0], logs[r, 1] * pivot
        if logs[r + 1, 1] > _MAX_PRODUCT:
            logs[r + 1, 0] += math.log(logs[r + 1, 1])
            logs[r + 1, 1] = 1.0


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def _find_moments(
    low: FloatArray,
    half: FloatArray,
    index: IntArray,
    first: int,
    fixed: int,
    inverse: FloatArray,
    known: FloatArray,
    mean: FloatArray,
    covariance: FloatArray,
) -> None:
    """Mean (p,) and covariance (p, p) of the coefficients index (p,) under the posterior of untruncated ones.

    low, half: of `_factorize`; inverse (p, k): columns of L^-1, of which rows before the first are up to date; known
    (p, p + 1): sums over the rows before `fixed`, which are up to date where the first is not one of these.
    """
    k = len(half)
    for a in range(len(index)):
        column = index[a]
        if column >= first:
            inverse[a, column] = low[column, column]
        for r in range(max(column + 1, first), k):
            entry = 0.0
            for q in range(column, r):
                entry -= low[r, q] * inverse[a, q]
            inverse[a, r] = entry * low[r, r]
        if first < fixed:
            known[a, -1] = _dot(inverse[a], half, column, fixed)
            for b in range(a + 1):
                known[a, b] = _dot(inverse[a], inverse[b], column, fixed)
        start = max(column, fixed)
        mean[a] = known[a, -1] + _dot(inverse[a], half, start, k)
        for b in range(a + 1):
            covariance[a, b] = covariance[b, a] = known[a, b] + _dot(inverse[a], inverse[b], start, k)


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"}, forceinline=True)
def _dot(one: FloatArray, other: FloatArray, start: int, end: int) -> float:
    """Sum of products of two vectors (k,) from an index to one before another."""
    entry = 0.0
    for r in range(start, end):
        entry += one[r] * other[r]
    return entry


@numba.njit(cache=True, error_model="numpy")
def _order_columns(scale: FloatArray, positive: BoolArray) -> tuple[IntArray, int, int]:
    """Order (k,) of columns in which little is computed again; how many begin it that are alike in all rows (m, k).

    Those alike come first, of these the ones that may be negative, which are counted, too: they are eliminated. The
    others stay in their order, since the last ones change most often.
    """
    m, k = scale.shape
    order, count, eliminated = np.empty(k, dtype=np.int64), 0, 0
    alike = np.full(k, True)
    for c in range(k):
        for j in range(1, m):
            if scale[j, c] != scale[0, c]:
                alike[c] = False
                break
    for kind in range(3):
        for c in range(k):
            if (2 if not alike[c] else 1 if positive[c] else 0) == kind:
                order[count] = c
                count += 1
        if kind == 0:
            eliminated = count
    return order, eliminated, alike.sum()


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def _eliminate(
    gram: FloatArray, moment: FloatArray, scale: FloatArray, low: FloatArray, half: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Gram matrix (k - e, k - e), of which the lower half is made, and moments of what the first e columns leave.

    gram (k, k), of which the lower half is read, moment (k,): of all; scale (e,), low (e, e), half (e,): of the first
    ones, `_factorize`. Returns their log evidence as well.
    """
    e, k = len(scale), len(moment)
    squares, logs = np.zeros(e + 1), np.zeros((e + 1, 2))
    logs[0, 1] = 1.0
    _factorize(gram, moment, scale, 0, low, half, squares, logs)
    left, rest, across = np.empty((k - e, k - e)), np.empty(k - e), np.empty((k - e, e))
    for r in range(k - e):
        for c in range(e):
            entry = scale[c] * gram[e + r, c]
            for q in range(c):
                entry -= low[c, q] * across[r, q]
            across[r, c] = entry * low[c, c]
        rest[r] = moment[e + r] - _dot(across[r], half, 0, e)
        for c in range(r + 1):
            left[r, c] = gram[e + r, e + c] - _dot(across[r], across[c], 0, e)
    return left, rest, 0.5 * (squares[e] - logs[e, 0] - math.log(logs[e, 1]))


@numba.njit(cache=True, error_model="numpy")
def _earlier_alike(rows: FloatArray) -> IntArray:
    """Number (m,) of a row before each of some rows (m, k) that is equal to it, its own where there is none near it."""
    m, k = rows.shape
    result = np.arange(m)
    for j in range(m):
        for i in range(max(j - _LOOK_BACK, 0), j):
            # rows differ most often in their last entries
            c = k - 1
            while c >= 0 and rows[i, c] == rows[j, c]:
                c -= 1
            if c < 0:
                result[j] = result[i]
                break
    return result


@numba.njit(cache=True, error_model="numpy")
def log_evidence_and_correction(
    gram: FloatArray, moment: FloatArray, scale: FloatArray, positive: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """`log_evidence` (v, m), and the correction (v, m) of the probability of non-negative coefficients in it."""
    (v, k), m = moment.shape, len(scale)
    columns, eliminated, alike = _order_columns(scale, positive)
    n, fixed = k - eliminated, alike - eliminated
    always, deviations = scale[0, columns[:eliminated]], scale[:, columns[eliminated:]]
    index = np.flatnonzero(positive[columns[eliminated:]])
    p = len(index)
    ordered, target = np.empty((k, k)), np.empty(k)
    result, corrections = np.empty((v, m)), np.zeros((v, m))
    first_low, first_half = np.zeros((eliminated, eliminated)), np.empty(eliminated)
    low, half, squares, logs = np.zeros((n, n)), np.empty(n), np.zeros(n + 1), np.zeros((n + 1, 2))
    logs[0, 1] = 1.0
    inverse, mean, covariance = np.zeros((p, n)), np.empty(p), np.empty((p, p))
    known = np.zeros((p, p + 1))
    order, state = np.empty(p, dtype=np.int64), np.empty((p, COLUMNS))
    # prior scales that an effect's upper bound caps have the same deviations
    same = _earlier_alike(deviations)
    for level in range(v):
        for r in range(k):
            target[r] = moment[level, columns[r]]
            for c in range(r + 1):
                ordered[r, c] = gram[level, columns[r], columns[c]]
        left, rest, gained = _eliminate(ordered, target, always, first_low, first_half)
        before = 0
        for j in range(m):
            if same[j] < j:
                result[level, j], corrections[level, j] = result[level, same[j]], corrections[level, same[j]]
                continue
            # rows of the factor stay as long as no scale up to them changes
            first = 0
            while j > 0 and first < n and deviations[j, first] == deviations[before, first]:
                first += 1
            before = j
            _factorize(left, rest, deviations[j], first, low, half, squares, logs)
            total = gained + 0.5 * (squares[n] - logs[n, 0] - math.log(logs[n, 1]))
            if p:
                _find_moments(low, half, index, first, fixed, inverse, known, mean, covariance)
                probability, corrections[level, j] = log_orthant(mean, covariance, order, state)
                total += probability + p * math.log(2.0)
            result[level, j] = total
    return result, corrections


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def log_evidence_of_blocks(
    gram: FloatArray,
    moment: FloatArray,
    across: FloatArray,
    numbers: IntArray,
    ends: IntArray,
    scale: FloatArray,
    positive: BoolArray,
) -> FloatArray:
    """Log evidence (b, m) of each of several blocks of columns alone, at m prior deviations.

    gram (k, k) less across (k, x) times its transpose, and moment (k,): of all columns; numbers (n,): columns of the
    blocks one after another, which end at ends (b + 1,), 0 first; scale (m, n), positive (n,): as in `log_evidence`.
    """
    result = np.empty((len(ends) - 1, len(scale)))
    for b in range(len(ends) - 1):
        first, size = ends[b], ends[b + 1] - ends[b]
        block, target = np.empty((1, size, size)), np.empty((1, size))
        for r in range(size):
            i = numbers[first + r]
            target[0, r] = moment[i]
            for c in range(r + 1):
                j = numbers[first + c]
                entry = gram[i, j]
                for q in range(across.shape[1]):
                    entry -= across[i, q] * across[j, q]
                block[0, r, c] = block[0, c, r] = entry
        deviation, kinds = scale[:, first : first + size].copy(), positive[first : first + size]
        result[b] = log_evidence_and_correction(block, target, deviation, kinds)[0][0]
    return result


def log_evidence(gram: FloatArray, moment: FloatArray, scale: FloatArray, positive: BoolArray) -> FloatArray:
    """Logarithm of the evidence of k normal coefficients over that of zero coefficients.

    gram (v, k, k), moment (v, k): of the whitened columns, for v noise levels; scale (m, k): prior standard deviations;
    positive (k,): coefficients that cannot be negative, whose prior is half-normal. Returns (v, m).
    """
    return log_evidence_and_correction(gram, moment, scale, positive)[0]


@numba.njit(cache=True, error_model="numpy")
def _log_sums(value: FloatArray) -> FloatArray:
    """Logarithm (r,) of the sums of exponentials of each row of values (r, m)."""
    result = np.empty(len(value))
    for r in range(len(value)):
        top, count, others = value[r].max(), 0, 0.0
        for entry in value[r]:
            if entry == top:
                count += 1
            else:
                others += math.exp(entry - top)
        result[r] = math.log1p(others / count) + math.log(count) + top
    return result


def log_sum_exp(value: FloatArray) -> FloatArray:
    """Logarithm of the sums of exponentials along the last axis: scipy's, without what it costs on small arrays."""
    rows = np.ascontiguousarray(value).reshape(-1, value.shape[-1])
    result: FloatArray = _log_sums(rows).reshape(value.shape[:-1])[()]
    return result
