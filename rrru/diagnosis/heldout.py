"""Cross-validation: what a hypothesis predicts of points that it was not fitted on."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
import pandas as pd
from scipy.linalg import cho_solve, solve_triangular
from scipy.special import ndtr, stdtrit

from rrru.arrays import FloatArray, IntArray
from rrru.cache import Latest, read_only
from rrru.campaign.noise import along_runs
from rrru.diagnosis.drive_spectra import jumps, over_range
from rrru.diagnosis.evidence import ModelEvidence
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.diagnosis.state import LeftByCalibration
from rrru.diagnosis.terms import EffectTerm, signatures, spread
from rrru.diagnosis.whitened import DISCREPANCY_SCALES, discrepancy_scales, spectrum
from rrru.estimation.cross_validation import (
    ComplementFit,
    choose_folds,
    complement_fits,
    left_out_spread,
    whole_fit,
)
from rrru.estimation.noise_model import half_waves, lengths


@dataclass(frozen=True)
class Prediction:
    """Predictions of left-out points.

    residual_mm (n, 3): errors of the predictions; spread (n, 3, k): changes of the predictions by one standard
    deviation of each of k independent combinations of the fitted parameters; left_mm2 (n, 3): variance of noise and
    discrepancy, along the cosines of the series (n,) where these are given, else at each point.
    """

    residual_mm: FloatArray
    spread: FloatArray
    left_mm2: FloatArray
    series: IntArray | None = None

    @property
    def uncertainty_mm2(self) -> FloatArray:
        """Expected squared distance (n,) between prediction and truth if the hypothesis holds."""
        return np.asarray((self.spread**2).sum(axis=(1, 2)))

    @property
    def log_score(self) -> FloatArray:
        """Log predictive score (n,) under noise, discrepancy and the prediction's own uncertainty."""
        residual, spread = self.coordinates
        return _log_score(residual, self.left_mm2 + (spread**2).sum(axis=-1))

    @property
    def coordinates(self) -> tuple[FloatArray, FloatArray]:
        """Residuals (n, 3) and their spread (n, 3, k) as they are scored.

        With series they are those of the cosines, whose scores have the same sum over a series as those of the points:
        a smooth part of a run is one prediction, not one at every point.
        """
        if self.series is None:
            return self.residual_mm, self.spread
        together, _ = along_runs(np.concatenate([self.residual_mm[..., None], self.spread], axis=-1), self.series)
        return together[..., 0], together[..., 1:]


def _log_score(residual: FloatArray, variance: FloatArray) -> FloatArray:
    """`Prediction.log_score` (n,) of residuals (n, 3) with their variance (n, 3)."""
    return np.asarray(-0.5 * (residual**2 / variance + np.log(variance)).sum(axis=-1))


@dataclass(frozen=True)
class HeldOut:
    """Predictions of every used reading of a problem from those of the other folds, on one linearisation."""

    problem: DiagnosisProblem
    evidence: ModelEvidence

    @cached_property
    def fold(self) -> IntArray:
        """Fold numbers (m,) whose complements determine the calibration, see `rrru.estimation.cross_validation`.

        Runs where every trajectory was driven more than once, and with every payload. Else five interleaved stretches:
        leaving out the only run of a kind would require extrapolation, which says nothing about the effect. Where one
        fold alone determines a parameter, as of a target that was seen at a few stops, every fifth stop.
        """
        white = self.evidence.linear.base / self.problem.noise_mm
        return choose_folds(self._candidates(), white)

    def _candidates(self) -> Iterator[IntArray]:
        """Fold numbers (m,), the most demanding ones first."""
        frame, run = self.problem.points, self.problem.run
        by_run = np.unique(run, return_inverse=True)[1] % OPTIONS.max_run_folds
        repeated = frame.groupby("trajectory")["run"].nunique() > 1
        with_payload = pd.Series(by_run).groupby(frame["payload_kg"].to_numpy()).nunique() > 1
        if repeated.all() and with_payload.all():
            yield by_run
        place = within(run, self.problem.stop)
        for length in (OPTIONS.points_per_stretch, 1):
            yield np.unique((place // length + run) % OPTIONS.stretch_folds, return_inverse=True)[1]

    def predict(
        self,
        terms: Sequence[EffectTerm],
        prior_scales: Sequence[float] | FloatArray,
        level: int,
        uncertain: bool = True,
    ) -> Prediction:
        """Prediction by the calibration together with a set of terms.

        The fit is that of `ModelEvidence.coefficients` at given prior scales and discrepancy level (an index), with the
        effect models as they are. uncertain: state the prediction's spread, too.
        """
        linear = self.evidence.linear
        together = np.concatenate(self._blocks(terms), axis=-1)
        residual, spread = np.empty_like(linear.data), np.empty_like(together if uncertain else linear.base[..., :0])
        for number, fit in self._fits(terms, prior_scales, level).items():
            out = self.fold == number
            residual[out] = linear.data[out] - together[out] @ fit.mean
            if uncertain:
                spread[out] = fit.half(together[out].reshape(-1, len(fit.mean))).T.reshape(-1, 3, len(fit.mean))
        return Prediction(residual, spread, self._left(level), self.problem.series if self._whole_runs else None)

    def log_score_alone(self, level: int) -> FloatArray:
        """`Prediction.log_score` (n,) of the calibration alone at a discrepancy level (an index)."""
        return np.asarray(self._alone.of(level, lambda: read_only(self.predict((), [], level).log_score)))

    @cached_property
    def _alone(self) -> Latest:
        return Latest(len(DISCREPANCY_SCALES))

    def shares(
        self, terms: Sequence[EffectTerm], prior_scales: Sequence[float] | FloatArray, level: int
    ) -> dict[str, float]:
        """Share of the gap's mean square by effect: the mean product of its predicted part and the gap.

        An effect has half of what it shares with another one (covariance decomposition: Li et al., Global sensitivity
        analysis for systems with independent and/or correlated inputs, Journal of Physical Chemistry A 114, 2010). Two
        large parts that cancel have none, and none takes the part of another one because it comes first. A part is
        predicted at each reading by the fit without its fold: what a rough function follows by chance is no share. The
        gap and the parts are those at the positions on the robot that a calibration leaves; without a gap beyond the
        noise all shares are zero. Readings at which a term lacks what it needs do not count.
        """
        part = self.on_complete(terms)
        if part is not self:
            return part.shares(terms, prior_scales, level)
        linear, rows = self.evidence.linear, self.problem.on_robot
        calibration, *blocks = self._blocks(terms)
        ends = np.cumsum([block.shape[-1] for block in (calibration, *blocks)])
        parts = np.empty((*linear.data.shape, len(terms)))
        for number, fit in self._fits(terms, prior_scales, level).items():
            out = self.fold == number
            for k, (block, first) in enumerate(zip(blocks, ends, strict=False)):
                parts[out, :, k] = block[out] @ fit.mean[first : first + block.shape[-1]]
        calibrated = LeftByCalibration(linear.calibration_basis, rows)
        left = calibrated.residual(
            np.concatenate([parts, linear.data[..., None]], axis=-1).reshape(linear.data.size, -1)
        )
        gap = left[:, -1]
        total = float(gap @ gap) - gap.size * self.problem.noise_mm**2 * (1.0 - calibrated.taken)
        inverse = 1.0 / total if total > 0.0 else 0.0
        return {term.effect: float(left[:, k] @ gap) * inverse for k, term in enumerate(terms)}

    def spread_at_new_stops(
        self, terms: Sequence[EffectTerm], prior_scales: Sequence[float] | FloatArray, level: int
    ) -> FloatArray:
        """`Prediction.spread` (n, 3, k) for the fit of all readings, at stops that are none of its own.

        Each stop is predicted from all others: from four fifths of them the fit is less certain than the one that is
        used. Where folds are whole runs, it is the spread of their predictions. As far as a function jumps, which
        `jumps_mm2` counts between the stops, it is that of the fit at its own stops.
        """
        if self._whole_runs:
            return self.predict(terms, prior_scales, level).spread
        fit, size = whole_fit(*self._system(terms, prior_scales, level)), np.sqrt(self._left(level))[..., None]
        together = np.concatenate(self._blocks(terms), axis=-1) / size
        own = fit.half(together.reshape(-1, len(fit.mean))).T.reshape(together.shape)
        steps = max((self.evidence.library[term.effect].steps for term in terms), default=0.0)
        away = left_out_spread(own, self.problem.stop)
        near, far = ((one**2).sum(axis=(1, 2)) for one in (own, away))
        share = np.sqrt(steps * near / np.maximum(far, 1e-300) + 1.0 - steps)
        return np.asarray(size * share[:, None, None] * away)

    def jumps_mm2(
        self, terms: Sequence[EffectTerm], prior_scales: Sequence[float] | FloatArray, level: int
    ) -> FloatArray:
        """Mean squared error (n,) of each reading over the drives' ranges by jumps of their functions between stops."""
        result = np.zeros(len(self.problem))
        for size_mm2, jumping in self._jumping(terms, prior_scales, level):
            result += jumping.mean * size_mm2
        return result

    def drawn_jumps_mm2(
        self,
        terms: Sequence[EffectTerm],
        prior_scales: Sequence[float] | FloatArray,
        level: int,
        drawn: tuple[np.random.Generator, int],
    ) -> FloatArray:
        """Draws (b, n) of `jumps_mm2`; drawn: generator and number of draws."""
        generator, draws = drawn
        result = np.zeros((draws, len(self.problem)))
        for size_mm2, jumping in self._jumping(terms, prior_scales, level):
            result += np.outer(jumping.drawn(generator, draws), size_mm2)
        return result

    def _jumping(
        self, terms: Sequence[EffectTerm], prior_scales: Sequence[float] | FloatArray, level: int
    ) -> Iterator[tuple[FloatArray, "_Jumping"]]:
        """By drive whose function may jump: squares (n,) that a unit of its error makes at the readings, in mm2, and
        the function.
        """
        linear, library, motion = self.evidence.linear, self.evidence.library, self.problem.motion
        if not any(library[term.effect].steps for term in terms):
            return
        start, mean = linear.base.shape[-1], whole_fit(*self._system(terms, prior_scales, level)).mean
        used = motion.drive[self.problem.used]
        for term, block in zip(terms, signatures(library, linear, terms), strict=True):
            of_term = mean[start : start + block.shape[-1]]
            start += block.shape[-1]
            effect = library[term.effect]
            if not effect.steps or effect.along_drives is None:
                continue
            coordinates = spread(effect.coordinates, term.legs) @ of_term
            functions = enumerate(effect.along_drives(replace(motion, drive=used)))
            between = effect.along_drives(replace(motion, drive=over_range(used)))
            for (k, function), fitted, value in zip(functions, between, over_range(used).T, strict=True):
                if not np.ptp(value):
                    # a drive that stands still has no values between its stops
                    continue
                own = coordinates[effect.coordinates.legs == k + 1]
                before, after, share = jumps(value, used[:, k], function @ own)
                squares = (fitted @ own - before) ** 2, (fitted @ own - after) ** 2
                way = np.searchsorted(np.unique(used[:, k]), value, side="right")
                yield (linear.drive[:, :, k] ** 2).sum(axis=1), _Jumping(effect.steps, *squares, share, way)

    def gains(self, terms: Sequence[EffectTerm], prior_scales: Sequence[float] | FloatArray, level: int) -> list[float]:
        """Log predictive score that each of the terms adds to that of the others, at these prior scales.

        Without the term its coefficients t are zero. The others then have the mean m - C_.t C_tt^-1 m_t and the
        covariance C - C_.t C_tt^-1 C_t. of a normal distribution with mean m and covariance C.

        Readings at which a term lacks what it needs do not count.
        """
        part = self.on_complete(terms)
        if part is not self:
            return part.gains(terms, prior_scales, level)
        whole, fits = self.predict(terms, prior_scales, level), self._fits(terms, prior_scales, level)
        residuals, spread = whole.coordinates
        variances = whole.left_mm2 + (spread**2).sum(axis=-1)
        result, score = [], _log_score(residuals, variances).sum()
        for first, last in pairwise(np.cumsum([block.shape[-1] for block in self._blocks(terms)])):
            residual, variance = residuals.copy(), variances.copy()
            for number, fit in fits.items():
                out = self.fold == number
                half = fit.half(np.eye(len(fit.mean))[first:last])
                root, moved = np.linalg.cholesky(half.T @ half), spread[out] @ half
                residual[out] += moved @ cho_solve((root, True), fit.mean[first:last])
                taken = solve_triangular(root, moved.reshape(-1, last - first).T, lower=True, check_finite=False)
                variance[out] -= (taken**2).sum(axis=0).reshape(-1, 3)
            result.append(float(score - _log_score(residual, variance).sum()))
        return result

    def misleading(
        self, terms: Sequence[EffectTerm], prior_scales: Sequence[float] | FloatArray, level: int
    ) -> EffectTerm | None:
        """The term without which predictions are nearest, where they are further off than by the calibration alone.

        That is so where their mean square is larger, and more stops are further off than by chance: by more than two
        standard deviations of a fair coin (sign test; a few stops far off would hide it from a test of means). A rough
        function can follow the readings themselves where something else leaves more than the noise. It knows how
        uncertain it is between them, so that the log score does not tell. None where it is not so.
        """
        part = self.on_complete(terms)
        if part is not self:
            return part.misleading(terms, prior_scales, level)
        if not terms:
            return None
        _, stop = np.unique(self.problem.stop, return_inverse=True)

        def squares_mm2(some: Sequence[int]) -> FloatArray:
            chosen, scales = [terms[k] for k in some], [prior_scales[k] for k in some]
            residual = self.predict(chosen, scales, level, uncertain=False).residual_mm
            return np.bincount(stop, (residual**2).sum(axis=1)) / np.bincount(stop)

        further = squares_mm2(range(len(terms))) - squares_mm2(())
        excess = np.sign(further).sum() / np.sqrt(len(further))
        if not (further.mean() > 0.0 and excess > OPTIONS.max_further_off):
            return None
        without = [[k for k in range(len(terms)) if k != out] for out in range(len(terms))]
        return terms[int(np.argmin([squares_mm2(some).mean() for some in without]))]

    def on_complete(self, terms: Sequence[EffectTerm]) -> "HeldOut":
        """The predictions of the readings at which all effects of terms have what they need."""
        evidence = self.evidence.on_complete(terms)
        if evidence is self.evidence:
            return self
        return HeldOut(self.problem.at_complete({term.effect for term in terms}), evidence)

    def _blocks(self, terms: Sequence[EffectTerm]) -> list[FloatArray]:
        """Columns (n, 3, k) of the calibration and of each term."""
        linear = self.evidence.linear
        return [linear.base, *signatures(self.evidence.library, linear, terms)]

    def _fits(
        self, terms: Sequence[EffectTerm], prior_scales: Sequence[float] | FloatArray, level: int
    ) -> dict[int, ComplementFit]:
        """ComplementFit of calibration and terms by the number of the fold that is left out."""
        white, precision, moment = self._system(terms, prior_scales, level)
        return complement_fits(white, self.fold, precision, moment)

    def _system(
        self, terms: Sequence[EffectTerm], prior_scales: Sequence[float] | FloatArray, level: int
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Whitened columns (n, 3, k + 1) of calibration and terms, the data last; precision and moment (k,) of their
        priors.
        """
        linear, count = self.evidence.linear, self.evidence.linear.base.shape[-1]
        sd, mean = linear.base_prior or (np.full(count, np.inf), np.zeros(count))
        precision = np.concatenate([sd, self.evidence.scales(terms, prior_scales)]) ** -2.0
        moment = np.zeros(len(precision))
        moment[:count] = np.where(np.isfinite(sd), mean, 0.0) * precision[:count]
        together = np.concatenate([*self._blocks(terms), linear.data[..., None]], axis=-1)
        if self._whole_runs:
            together, _ = along_runs(together, self.problem.series)
        return together / np.sqrt(self._left(level))[..., None], precision, moment

    @cached_property
    def _whole_runs(self) -> bool:
        """Whether every fold is of whole runs."""
        run = self.problem.series
        return all(len(np.unique(self.fold[run == label])) == 1 for label in np.unique(run))

    def _left(self, level: int) -> FloatArray:
        """Variance (n, 3) of noise and discrepancy, along the runs' cosines where folds are whole runs."""
        noise, series = self.evidence.noise, self.problem.series
        misfit = (noise.mean_mm * discrepancy_scales(noise)[level]) ** 2
        if not self._whole_runs:
            size = noise.axis_mm**2 * (1.0 + noise.offset) + misfit
            return np.broadcast_to(size, self.evidence.linear.data.shape)
        waves = half_waves(series)
        return np.asarray(noise.variance(waves, lengths(series)) + misfit * spectrum(waves)[:, None])


@dataclass(frozen=True)
class _Jumping:
    """A fitted function at places (p,) over a drive's range, which jumps between two stops with a probability.

    steps: that probability; before, after (p,): its squared errors at places before and beyond the jump; share (p,): of
    the way between two stops at which each place is, number way (p,): the jump is before it with this probability.
    """

    steps: float
    before: FloatArray
    after: FloatArray
    share: FloatArray
    way: IntArray

    @property
    def mean(self) -> float:
        """Expected mean square error over the range."""
        return self.steps * float((self.share * self.after + (1.0 - self.share) * self.before).mean())

    def drawn(self, generator: np.random.Generator, draws: int) -> FloatArray:
        """Draws (b,) of the mean square error over the range, each with one place of the jump for every way."""
        acts = generator.random(draws) < self.steps
        place = generator.random((draws, int(self.way.max()) + 1))[:, self.way]
        return np.asarray(acts * np.where(self.share > place, self.after, self.before).mean(axis=1))


def within(run: IntArray, at: IntArray) -> IntArray:
    """Number (m,) from 0 on of the stop in its run (m,); at (m,): at which stop of the campaign each row was read."""
    result = np.empty(len(run), dtype=int)
    for label in np.unique(run):
        result[run == label] = np.unique(at[run == label], return_inverse=True)[1]
    return result


def resampled_groups(problem: DiagnosisProblem) -> IntArray:
    """Labels (m,) of the runs, or of stretches of five points where there are few runs, that are resampled as one."""
    run = problem.run
    if len(np.unique(run)) >= OPTIONS.min_resampled_runs:
        return np.asarray(run)
    return np.asarray(run * (len(run) + 1) + within(run, problem.stop) // OPTIONS.points_per_stretch)


def resampled_quantiles(groups: IntArray) -> tuple[float, float]:
    """Quantiles of statistics of `resampled_rows` between which their 95 % interval is.

    groups: labels of `resampled_groups` of the readings that the statistics are of. Resampling n groups makes the
    variance n / (n - 1) too small and knows no uncertainty of it. The quantiles are those of the normal distribution at
    sqrt(n / (n - 1)) times the quantiles of Student's t of n - 1 degrees of freedom (T. Hesterberg, What teachers
    should know about the bootstrap, The American Statistician 69, 2015, section 3.3).
    """
    count = len(np.unique(groups))
    if count < 2:
        return 0.0, 1.0
    low, high = (
        float(ndtr(np.sqrt(count / (count - 1.0)) * stdtrit(count - 1, one))) for one in OPTIONS.interval_quantiles
    )
    return low, high


def resampled_rows(problem: DiagnosisProblem, generator: np.random.Generator, draws: int) -> IntArray:
    """Rows (draws, m) of a problem resampled by `resampled_groups`."""
    run, block = problem.run, resampled_groups(problem)
    groups = [np.flatnonzero(block == label) for label in dict.fromkeys(block.tolist())]
    result = np.empty((draws, len(run)), dtype=int)
    for k in range(draws):
        drawn = generator.integers(len(groups), size=2 * len(groups))
        result[k] = np.resize(np.concatenate([groups[g] for g in drawn]), len(run))
    return result
