"""What a hypothesis predicts of points that it was not fitted on."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cho_solve

from rrru.campaign.noise import along_runs
from rrru.gap.case import Case
from rrru.gap.evidence import LEVELS, ModelEvidence, spectrum
from rrru.gap.noise_model import lengths
from rrru.gap.terms import signatures

# where a trajectory was driven once only, its runs are cut into stretches of about this many points, and every
# so-manieth is left out
_STRETCH, _FOLDS = 5, 5
# fewer runs than this are resampled by stretches
_ENOUGH_RUNS = 10


@dataclass(frozen=True)
class Prediction:
    """Predictions of left-out points.

    residual_mm (n, 3): what they get wrong; spread (n, 3, k): the part of it that one standard deviation of each of k
    independent combinations of the fitted numbers makes; log_score (n,): under noise and this uncertainty.
    """

    residual_mm: np.ndarray
    spread: np.ndarray
    noise_mm: float

    @property
    def uncertainty_mm2(self):
        """Expected squared distance (n,) between prediction and truth if the hypothesis holds."""
        return (self.spread**2).sum(axis=(1, 2))

    @property
    def log_score(self):
        """Log predictive score (n,) under the instrument's noise and the prediction's own uncertainty."""
        variance = self.noise_mm**2 + self.uncertainty_mm2 / 3.0
        return -0.5 * (self.residual_mm**2).sum(axis=1) / variance - 1.5 * np.log(variance)


@dataclass(frozen=True)
class HeldOut:
    """Predictions of every used point of a case from the points of the other folds, on one linearisation."""

    case: Case
    evidence: ModelEvidence

    @cached_property
    def fold(self):
        """Fold numbers (n,): one fold per run where every trajectory was driven more than once, else five.

        Those are interleaved stretches: leaving out the only run of a kind would ask for extrapolation, which says
        nothing about the effect.
        """
        frame, run = self.case.points, self.case.run
        if (frame.groupby("trajectory")["run"].nunique() > 1).all():
            return np.unique(run, return_inverse=True)[1]
        result = (within(run, self.case.at) // _STRETCH + run) % _FOLDS
        return np.unique(result, return_inverse=True)[1]

    def predict(self, terms, strengths, level, uncertain=True):
        """Prediction by the calibration together with a set of terms.

        The fit is that of `ModelEvidence.coefficients` at given strengths and discrepancy level (an index), with the
        laws as they are. uncertain: tell the prediction's spread, too.
        """
        evidence, linear = self.evidence, self.evidence.linear
        columns = np.concatenate([linear.base, *signatures(evidence.library, linear, terms)], axis=-1)
        penalty = np.concatenate([np.zeros(linear.base.shape[-1]), evidence.scales(terms, strengths) ** -2.0])
        weights, transformed, data = self._weighted(columns, level)
        root = np.sqrt(weights)
        white, target = root[..., None] * transformed, root * data
        grams, moments = {}, {}
        for number in np.unique(self.fold):
            own = white[self.fold == number].reshape(-1, columns.shape[-1])
            grams[number], moments[number] = own.T @ own, own.T @ target[self.fold == number].ravel()
        total, total_moment = sum(grams.values()), sum(moments.values())
        unit = 1.0 / np.sqrt(np.maximum(np.diag(total) + penalty, 1e-300))
        residual = np.empty_like(linear.data)
        spread = np.empty((len(self.case), 3, columns.shape[-1] if uncertain else 0))
        for number in grams:
            out = self.fold == number
            precision = total - grams[number] + np.diag(penalty)
            factor = np.linalg.cholesky(unit[:, None] * precision * unit + 1e-12 * np.eye(len(unit)))
            mean = unit * cho_solve((factor, True), unit * (total_moment - moments[number]))
            residual[out] = linear.data[out] - columns[out] @ mean
            if uncertain:
                half = unit[:, None] * np.linalg.inv(factor).T
                spread[out] = columns[out] @ half
        return Prediction(residual, spread, self.case.noise_mm)

    def _weighted(self, columns, level):
        """Weights (n, 3), columns and data in which the fit is an ordinary weighted one.

        Where folds are whole runs they are along these runs' cosines.
        """
        data, run, noise = self.evidence.linear.data, self.case.series, self.evidence.noise
        size, misfit = noise.axis_mm**2 * (1.0 + noise.offset), (noise.mean_mm * LEVELS[level]) ** 2
        if not all(len(np.unique(self.fold[run == label])) == 1 for label in np.unique(run)):
            return np.broadcast_to(1.0 / (size + misfit), data.shape), columns, data
        together, wave = along_runs(np.concatenate([columns, data[..., None]], axis=-1), run)
        weights = 1.0 / (noise.variance(wave, lengths(run)) + misfit * spectrum(wave)[:, None])
        return weights, together[..., :-1], together[..., -1]


def within(run, at):
    """Number (m,) from 0 on of the point in its run (m,); at (m,): of which point of the campaign each row is."""
    result = np.empty(len(run), dtype=int)
    for label in np.unique(run):
        result[run == label] = np.unique(at[run == label], return_inverse=True)[1]
    return result


def resampled_rows(case, generator, draws):
    """Rows (draws, m) of a case resampled by runs, or by stretches of five points where there are few runs."""
    block = run = case.run
    if len(np.unique(run)) < _ENOUGH_RUNS:
        block = run * (len(run) + 1) + within(run, case.at) // _STRETCH
    groups = [np.flatnonzero(block == label) for label in dict.fromkeys(block.tolist())]
    result = np.empty((draws, len(run)), dtype=int)
    for k in range(draws):
        drawn = generator.integers(len(groups), size=2 * len(groups))
        result[k] = np.resize(np.concatenate([groups[g] for g in drawn]), len(run))
    return result
