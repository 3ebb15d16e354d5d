"""What a hypothesis predicts of points that it was not fitted on."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.linalg import cho_solve

from rrru.campaign.noise import along_runs
from rrru.gap.case import Case
from rrru.gap.evidence import ModelEvidence
from rrru.gap.noise_model import lengths
from rrru.gap.terms import EACH, signatures
from rrru.gap.terms import spread as spread_of
from rrru.gap.whitened import LEVELS, spectrum

# where a trajectory was driven once only, its runs are cut into stretches of about this many points, and every
# so-manieth is left out
_STRETCH, _FOLDS = 5, 5
# fewer runs than this are resampled by stretches
_ENOUGH_RUNS = 10


@dataclass(frozen=True)
class Prediction:
    """Predictions of left-out points.

    residual_mm (n, 3): what they get wrong; spread (n, 3, k): the part of it that one standard deviation of each of k
    independent combinations of the fitted numbers makes; left_mm2 (n, 3): variance of what no fit predicts, noise and
    discrepancy, along the cosines of the series (n,) where these are told, else at each point.
    """

    residual_mm: np.ndarray
    spread: np.ndarray
    left_mm2: np.ndarray
    series: np.ndarray | None = None

    @property
    def uncertainty_mm2(self):
        """Expected squared distance (n,) between prediction and truth if the hypothesis holds."""
        return (self.spread**2).sum(axis=(1, 2))

    @property
    def log_score(self):
        """Log predictive score (n,) under noise, discrepancy and the prediction's own uncertainty.

        Of series it is that of their cosines, whose sum over a series is that of its points: what is smooth along a run
        is one thing to foretell and not one at every point.
        """
        together = np.concatenate([self.residual_mm[..., None], self.spread], axis=-1)
        if self.series is not None:
            together, _ = along_runs(together, self.series)
        variance = self.left_mm2 + (together[..., 1:] ** 2).sum(axis=-1)
        return -0.5 * (together[..., 0] ** 2 / variance + np.log(variance)).sum(axis=-1)


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
        result = (within(run, self.case.stop) // _STRETCH + run) % _FOLDS
        return np.unique(result, return_inverse=True)[1]

    def predict(self, terms, strengths, level, uncertain=True):
        """Prediction by the calibration together with a set of terms.

        The fit is that of `ModelEvidence.coefficients` at given strengths and discrepancy level (an index), with the
        laws as they are. uncertain: tell the prediction's spread, too.
        """
        evidence, linear = self.evidence, self.evidence.linear
        blocks = [linear.base, *signatures(evidence.library, linear, terms)]
        penalty = np.concatenate([np.zeros(linear.base.shape[-1]), evidence.scales(terms, strengths) ** -2.0])
        grams = {number: self._chosen(gram, terms) for number, gram in self._sums(level).items()}
        total = sum(grams.values())
        unit = 1.0 / np.sqrt(np.maximum(np.diag(total)[:-1] + penalty, 1e-300))
        residual = np.empty_like(linear.data)
        spread = np.empty((len(self.case), 3, len(unit) if uncertain else 0))
        for number, gram in grams.items():
            out, rest = self.fold == number, total - gram
            precision = unit[:, None] * (rest[:-1, :-1] + np.diag(penalty)) * unit
            factor = np.linalg.cholesky(precision + 1e-12 * np.eye(len(unit)))
            mean = unit * cho_solve((factor, True), unit * rest[:-1, -1])
            parts = np.split(mean, np.cumsum([block.shape[-1] for block in blocks])[:-1])
            residual[out] = linear.data[out] - sum(b[out] @ part for b, part in zip(blocks, parts, strict=True))
            if uncertain:
                half = unit[:, None] * np.linalg.inv(factor).T
                spread[out] = np.concatenate([block[out] for block in blocks], axis=-1) @ half
        return Prediction(residual, spread, self._left(level), self.case.series if self._whole_runs else None)

    def _sums(self, level):
        """Sums of squares and products (K + 1, K + 1) of all columns and the data, by fold, at a level (an index)."""
        if level not in self._made:
            weights, together = self._weighted(level)
            white = np.sqrt(weights)[..., None] * together
            self._made[level] = {}
            for number in np.unique(self.fold):
                own = white[self.fold == number].reshape(-1, white.shape[-1])
                self._made[level][number] = own.T @ own
        return self._made[level]

    def _chosen(self, gram, terms):
        """Of sums (K + 1, K + 1) those (k + 1, k + 1) of calibration, terms and data."""
        made = [(slice(0, self.evidence.linear.base.shape[-1]), None)]
        for term in terms:
            matrix = None if term.legs == EACH else spread_of(self.evidence.library[term.effect].coordinates, term.legs)
            made.append((self._places[term.effect, term.shape], matrix))

        def columns(whole):
            """Of columns (r, K + 1) the chosen ones."""
            parts = [whole[:, at] if matrix is None else whole[:, at] @ matrix for at, matrix in made]
            return np.concatenate([*parts, whole[:, -1:]], axis=1)

        return columns(columns(gram).T)

    @cached_property
    def _made(self):
        """Sums of the levels that have been asked for."""
        return {}

    @cached_property
    def _places(self):
        """Which columns of `_weighted` an effect (name, shape) has."""
        linear = self.evidence.linear
        ends = np.cumsum([linear.base.shape[-1], *(columns.shape[-1] for columns in linear.columns.values())])
        return {key: slice(*place) for key, place in zip(linear.columns, pairwise(ends), strict=True)}

    @cached_property
    def _whole_runs(self):
        """Whether every fold is of whole runs."""
        run = self.case.series
        return all(len(np.unique(self.fold[run == label])) == 1 for label in np.unique(run))

    def _left(self, level):
        """Variance (n, 3) of noise and discrepancy, along the runs' cosines where folds are whole runs."""
        noise, series = self.evidence.noise, self.case.series
        misfit = (noise.mean_mm * LEVELS[level]) ** 2
        if not self._whole_runs:
            size = noise.axis_mm**2 * (1.0 + noise.offset) + misfit
            return np.broadcast_to(size, self.evidence.linear.data.shape)
        return noise.variance(self._wave, lengths(series)) + misfit * spectrum(self._wave)[:, None]

    @cached_property
    def _wave(self):
        """Half-wave number (n,) of each row among the runs' cosines."""
        return along_runs(self.evidence.linear.data, self.case.series)[1]

    def _weighted(self, level):
        """Weights (n, 3) and all columns with the data (n, 3, K + 1) in which a fit is an ordinary weighted one.

        Where folds are whole runs they are along these runs' cosines.
        """
        linear = self.evidence.linear
        together = np.concatenate([linear.base, *linear.columns.values(), linear.data[..., None]], axis=-1)
        if self._whole_runs:
            together, _ = along_runs(together, self.case.series)
        return 1.0 / self._left(level), together


def within(run, at):
    """Number (m,) from 0 on of the stop in its run (m,); at (m,): at which stop of the campaign each row was read."""
    result = np.empty(len(run), dtype=int)
    for label in np.unique(run):
        result[run == label] = np.unique(at[run == label], return_inverse=True)[1]
    return result


def resampled_rows(case, generator, draws):
    """Rows (draws, m) of a case resampled by runs, or by stretches of five points where there are few runs."""
    block = run = case.run
    if len(np.unique(run)) < _ENOUGH_RUNS:
        block = run * (len(run) + 1) + within(run, case.stop) // _STRETCH
    groups = [np.flatnonzero(block == label) for label in dict.fromkeys(block.tolist())]
    result = np.empty((draws, len(run)), dtype=int)
    for k in range(draws):
        drawn = generator.integers(len(groups), size=2 * len(groups))
        result[k] = np.resize(np.concatenate([groups[g] for g in drawn]), len(run))
    return result
