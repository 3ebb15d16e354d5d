"""What a hypothesis predicts of points that it was not fitted on."""

from dataclasses import dataclass

import numpy as np

from rrru.gap.evidence import LEVELS, along_runs, spectrum
from rrru.gap.terms import spread

# where a trajectory was driven once only, its runs are cut into stretches of about this many points, and every
# so-manieth is left out
_STRETCH, _FOLDS = 5, 5


def folds(case):
    """Fold numbers (n,): one fold per run where every trajectory was driven more than once, else five of interleaved
    stretches.

    Leaving out the only run of a kind would ask for extrapolation, which says nothing about the effect.
    """
    frame = case.measurements.iloc[np.flatnonzero(case.used)]
    passes = frame.groupby("trajectory")["run"].nunique()
    if (passes > 1).all():
        return np.unique(case.run, return_inverse=True)[1]
    result = np.empty(len(frame), dtype=int)
    for run in np.unique(case.run):
        rows = np.flatnonzero(case.run == run)
        result[rows] = (np.arange(len(rows)) // _STRETCH + run) % _FOLDS
    return np.unique(result, return_inverse=True)[1]


@dataclass(frozen=True)
class Prediction:
    """Residuals (n, 3) in mm of predictions of left-out points, and the part (n, 3, k) of them that one standard
    deviation of each of k independent combinations of the fitted numbers makes: the prediction's own uncertainty.
    """

    residual_mm: np.ndarray
    spread: np.ndarray

    @property
    def uncertainty_mm2(self):
        """Expected squared distance (n,) between prediction and truth if the hypothesis holds."""
        return (self.spread**2).sum(axis=(1, 2))


def predict(case, evidence, terms, strengths, level, fold):
    """Prediction of every used point from the other folds (n,) by the calibration together with a set of terms.

    The fit is that of `Evidence.posterior` at given strengths and discrepancy level (an index), with the laws as they
    are.
    """
    linear = evidence.linear
    columns = np.concatenate([linear.base, *_chosen(evidence, terms)], axis=-1)
    penalty = np.concatenate([np.zeros(linear.base.shape[-1]), evidence.scales(terms, strengths) ** -2.0])
    weights, transformed, data = _weighted(case, evidence, columns, level, fold)
    gram = np.einsum("nak,nal,n->nkl", transformed, transformed, weights)
    moment = np.einsum("nak,na,n->nk", transformed, data, weights)
    total, total_moment = gram.sum(axis=0), moment.sum(axis=0)
    unit = 1.0 / np.sqrt(np.maximum(np.diag(total) + penalty, 1e-300))
    residual, spread = np.empty_like(linear.data), np.empty((len(case), 3, columns.shape[-1]))
    for number in np.unique(fold):
        out = fold == number
        precision = total - gram[out].sum(axis=0) + np.diag(penalty)
        factor = np.linalg.cholesky(unit[:, None] * precision * unit + 1e-12 * np.eye(len(unit)))
        half = unit[:, None] * np.linalg.inv(factor).T
        mean = half @ (half.T @ (total_moment - moment[out].sum(axis=0)))
        residual[out] = linear.data[out] - columns[out] @ mean
        spread[out] = columns[out] @ half
    return Prediction(residual, spread)


def log_score(prediction, case):
    """Log predictive score (n,) of left-out points under the instrument's noise and the prediction's own
    uncertainty.
    """
    variance = case.noise_mm**2 + prediction.uncertainty_mm2 / 3.0
    return -0.5 * (prediction.residual_mm**2).sum(axis=1) / variance - 1.5 * np.log(variance)


def _chosen(evidence, terms):
    """Columns of the terms' free numbers."""
    return [
        evidence.linear.columns[t.effect, t.shape] @ spread(evidence.library[t.effect].coordinates, t.legs)
        for t in terms
    ]


def _weighted(case, evidence, columns, level, fold):
    """Weights (n,), columns and data in which the fit is an ordinary weighted one: along the runs' cosines if folds are
    whole runs.
    """
    data = evidence.linear.data
    whole = all(len(np.unique(fold[case.run == run])) == 1 for run in np.unique(case.run))
    if not whole:
        return np.full(len(case), 1.0 / (case.noise_mm**2 * (1.0 + LEVELS[level] ** 2))), columns, data
    together, wave = along_runs(np.concatenate([columns, data[..., None]], axis=-1), case.run)
    weights = 1.0 / (case.noise_mm**2 * (1.0 + LEVELS[level] ** 2 * spectrum(wave)))
    return weights, together[..., :-1], together[..., -1]


def resampled_rows(run, generator, draws):
    """Rows (draws, n) of points resampled by runs (n,), or by stretches of five points where there are fewer than ten
    runs.
    """
    block = run
    if len(np.unique(run)) < 10:
        within = np.concatenate([np.arange(np.count_nonzero(run == label)) for label in dict.fromkeys(run.tolist())])
        block = run * (len(run) + 1) + within // _STRETCH
    groups = [np.flatnonzero(block == label) for label in dict.fromkeys(block.tolist())]
    result = np.empty((draws, len(run)), dtype=int)
    for k in range(draws):
        drawn = generator.integers(len(groups), size=2 * len(groups))
        result[k] = np.resize(np.concatenate([groups[g] for g in drawn]), len(run))
    return result
