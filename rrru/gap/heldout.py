"""What a hypothesis predicts of points that it was not fitted on."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.linalg import cho_solve, solve_triangular

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
        """Log predictive score (n,) under noise, discrepancy and the prediction's own uncertainty."""
        residual, spread = self.coordinates
        return _log_score(residual, self.left_mm2 + (spread**2).sum(axis=-1))

    @property
    def coordinates(self):
        """Residuals (n, 3) and their spread (n, 3, k) as they are scored.

        Of series they are those of the cosines, whose scores have the points' sum over a series: what is smooth along a
        run is one thing to foretell and not one at every point.
        """
        if self.series is None:
            return self.residual_mm, self.spread
        together, _ = along_runs(np.concatenate([self.residual_mm[..., None], self.spread], axis=-1), self.series)
        return together[..., 0], together[..., 1:]


def _log_score(residual, variance):
    """`Prediction.log_score` (n,) of residuals (n, 3) with their variance (n, 3)."""
    return -0.5 * (residual**2 / variance + np.log(variance)).sum(axis=-1)


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
        linear, blocks = self.evidence.linear, self._blocks(terms)
        ends = np.cumsum([block.shape[-1] for block in blocks])
        residual = np.empty_like(linear.data)
        together = np.concatenate(blocks, axis=-1) if uncertain else linear.base[..., :0]
        spread = np.empty_like(together)
        for number, (unit, factor, mean) in self._fits(terms, strengths, level).items():
            out = self.fold == number
            parts = np.split(mean, ends[:-1])
            residual[out] = linear.data[out] - sum(b[out] @ part for b, part in zip(blocks, parts, strict=True))
            if uncertain:
                scaled = (together[out] * unit).reshape(-1, len(unit))
                spread[out] = _halved(factor, scaled).T.reshape(-1, 3, len(unit))
        return Prediction(residual, spread, self._left(level), self.case.series if self._whole_runs else None)

    def gains(self, terms, strengths, level):
        """Log predictive score that each of the terms adds to that of the others, at these strengths.

        Without the term its coefficients t are zero. Of a normal distribution with mean m and covariance C the others
        then have the mean m - C_.t C_tt^-1 m_t and the covariance C - C_.t C_tt^-1 C_t. .

        Readings at which a term lacks what it needs do not count.
        """
        part = self.on_complete(terms)
        if part is not self:
            return part.gains(terms, strengths, level)
        whole, fits = self.predict(terms, strengths, level), self._fits(terms, strengths, level)
        residuals, spread = whole.coordinates
        variances = whole.left_mm2 + (spread**2).sum(axis=-1)
        result, score = [], _log_score(residuals, variances).sum()
        for first, last in pairwise(np.cumsum([block.shape[-1] for block in self._blocks(terms)])):
            residual, variance = residuals.copy(), variances.copy()
            for number, (unit, factor, mean) in fits.items():
                out = self.fold == number
                half = _halved(factor, np.diag(unit)[first:last])
                root, moved = np.linalg.cholesky(half.T @ half), spread[out] @ half
                residual[out] += moved @ cho_solve((root, True), mean[first:last])
                taken = _halved(root, moved.reshape(-1, last - first))
                variance[out] -= (taken**2).sum(axis=0).reshape(-1, 3)
            result.append(float(score - _log_score(residual, variance).sum()))
        return result

    def on_complete(self, terms):
        """The predictions of the readings at which all effects of terms have what they need."""
        evidence = self.evidence.on_complete(terms)
        if evidence is self.evidence:
            return self
        return HeldOut(self.case.at_complete({term.effect for term in terms}), evidence)

    def _blocks(self, terms):
        """Columns (n, 3, k) of the calibration and of each term."""
        linear = self.evidence.linear
        return [linear.base, *signatures(self.evidence.library, linear, terms)]

    def _fits(self, terms, strengths, level):
        """What is fitted to the points of all folds but one, by its number.

        Units (k,) of the columns of calibration and terms, the lower Cholesky factor (k, k) of the coefficients'
        precision in these units, and their mean (k,).
        """
        free = np.zeros(self.evidence.linear.base.shape[-1])
        penalty = np.concatenate([free, self.evidence.scales(terms, strengths) ** -2.0])
        grams = {number: self._chosen(gram, terms) for number, gram in self._sums(level).items()}
        total, result = sum(grams.values()), {}
        unit = 1.0 / np.sqrt(np.maximum(np.diag(total)[:-1] + penalty, 1e-300))
        for number, gram in grams.items():
            rest = total - gram
            precision = unit[:, None] * (rest[:-1, :-1] + np.diag(penalty)) * unit
            factor = np.linalg.cholesky(precision + 1e-12 * np.eye(len(unit)))
            result[number] = unit, factor, unit * cho_solve((factor, True), unit * rest[:-1, -1])
        return result

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


def _halved(factor, rows):
    """Columns (k, r) of which products make those of rows (r, k) with the inverse of a matrix whose lower factor this
    is.
    """
    return solve_triangular(factor, rows.T, lower=True, check_finite=False)


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
