"""Predictions of readings from the others: cross-validation of a linear-Gaussian model with proper priors.

A fold is left out, the parameters are estimated from its complement under the same priors and noise, and the fold is
predicted. The complement's sums of squares and products are added up fold by fold; a difference from the total would
lose half of the digits.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve, solve_triangular

from rrru.arrays import FloatArray, IntArray

# every combination of parameters keeps at least this share of its information when a fold is left out: with less the
# fold is extrapolated, which does not test the model
MIN_SHARE_IN_COMPLEMENT = 0.05
# a combination with less than this share of the best one's information is not determined
_UNDETERMINED = 1e-12
# added to the scaled precision, far below the information of any reading: a flat prior leaves it singular
_RIDGE = 1e-14


def complement_sums(sums: dict[int, FloatArray]) -> dict[int, FloatArray]:
    """Sum of the arrays of all other folds, by fold."""
    numbers = list(sums)
    zero = np.zeros_like(next(iter(sums.values())))
    before, after = [zero], [zero]
    for number in numbers[:-1]:
        before.append(before[-1] + sums[number])
    for number in numbers[:0:-1]:
        after.append(after[-1] + sums[number])
    return {number: a + b for number, a, b in zip(numbers, before, reversed(after), strict=True)}


def fold_sums(columns: FloatArray, fold: IntArray) -> dict[int, FloatArray]:
    """Sums of squares and products (k, k) of the rows (m, a, k) of each fold (m,)."""
    result = {}
    for number in np.unique(fold).tolist():
        rows = columns[fold == number].reshape(-1, columns.shape[-1])
        result[number] = rows.T @ rows
    return result


def least_share_in_complement(columns: FloatArray, fold: IntArray) -> float:
    """Smallest share of a combination's information that is left in the complement of a fold.

    columns (m, a, p): whitened derivatives by the parameters. Combinations that all readings together do not determine
    do not count.
    """
    sums = fold_sums(columns, fold)
    total = sum(sums.values(), np.zeros((columns.shape[-1], columns.shape[-1])))
    unit = 1.0 / np.sqrt(np.maximum(np.diag(total), 1e-300))
    size, turned = np.linalg.eigh(unit[:, None] * total * unit)
    seen = size > _UNDETERMINED * size[-1]
    half = unit[:, None] * turned[:, seen] / np.sqrt(size[seen])
    return float(min(np.linalg.eigvalsh(half.T @ part @ half)[0] for part in complement_sums(sums).values()))


def choose_folds(candidates: Iterable[IntArray], columns: FloatArray) -> IntArray:
    """The first of several fold numbers (m,) whose complements determine every parameter, else the best of them."""
    best, best_share = np.zeros(len(columns), dtype=np.int64), -np.inf
    for fold in candidates:
        share = least_share_in_complement(columns, fold) if len(np.unique(fold)) > 1 else -np.inf
        if share >= MIN_SHARE_IN_COMPLEMENT:
            return fold
        if share > best_share:
            best, best_share = fold, share
    return best


@dataclass(frozen=True, eq=False)
class ComplementFit:
    """Parameters (k,) estimated from the complement of a fold, or from all readings.

    mean (k,); unit (k,): scale of each parameter; factor (k, k): lower Cholesky factor of the precision in these units.
    """

    mean: FloatArray
    unit: FloatArray
    factor: FloatArray

    def half(self, rows: FloatArray) -> FloatArray:
        """Columns (k, r) whose products make the covariance of rows (r, k) of predictions."""
        return np.asarray(solve_triangular(self.factor, (rows * self.unit).T, lower=True, check_finite=False))


def complement_fits(
    columns: FloatArray, fold: IntArray, precision: FloatArray, moment: FloatArray
) -> dict[int, ComplementFit]:
    """ComplementFit by fold of the parameters (k,) of whitened columns (m, a, k + 1), the data last.

    fold (m,): numbers of the folds; precision (k,), moment (k,): of the normal priors, the moment being precision times
    mean.
    """
    sums = complement_sums(fold_sums(columns, fold))
    return {number: _fit(of_others, precision, moment) for number, of_others in sums.items()}


def whole_fit(columns: FloatArray, precision: FloatArray, moment: FloatArray) -> ComplementFit:
    """The ComplementFit of all readings, for arguments as of `complement_fits`."""
    rows = columns.reshape(-1, columns.shape[-1])
    return _fit(rows.T @ rows, precision, moment)


def _fit(sums: FloatArray, precision: FloatArray, moment: FloatArray) -> ComplementFit:
    """The ComplementFit of sums of squares and products (k + 1, k + 1)."""
    gram, target = sums[:-1, :-1], sums[:-1, -1] + moment
    unit: FloatArray = 1.0 / np.sqrt(np.maximum(np.diag(gram) + precision, 1e-300))
    scaled = unit[:, None] * (gram + np.diag(precision)) * unit
    factor: FloatArray = np.asarray(np.linalg.cholesky(scaled + _RIDGE * np.eye(len(unit))))
    return ComplementFit(unit * cho_solve((factor, True), unit * target), unit, factor)


def left_out_spread(spread: FloatArray, group: IntArray) -> FloatArray:
    """Spread (m, a, k) of predictions of the readings of each group (m,) from those of all others.

    spread (m, a, k): whitened, of the fit of all readings. With S the spread of a group and H = S S^T its leverage, the
    prediction without the group has the covariance (I - H)^-1 H in units of the noise (Cook and Weisberg, Residuals and
    influence in regression, 1982, section 2.2). A combination that a group alone determines is left with
    MIN_SHARE_IN_COMPLEMENT of its information.
    """
    result = np.empty_like(spread)
    for number in np.unique(group):
        own = group == number
        rows = spread[own].reshape(-1, spread.shape[-1])
        leverage, axes = np.linalg.eigh(rows @ rows.T)
        wider = 1.0 / np.sqrt(np.maximum(1.0 - leverage, MIN_SHARE_IN_COMPLEMENT))
        result[own] = (axes * wider @ axes.T @ rows).reshape(-1, *spread.shape[1:])
    return result
