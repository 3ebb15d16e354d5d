"""Machines with measured lengths: Bayesian selection of effect models in addition to the frame.

Each effect model may act or not. Every combination is fitted and weighted by its evidence, with independent noise alone
and with a smooth discrepancy (`rrru.estimation.evidence`). Errors of neighbouring rows are correlated wherever an
effect model is missing. F tests or BIC count them as independent and select any term that resembles the discrepancy.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice

import numpy as np

from rrru.calibration.lengths import LengthFit, fit_lengths, refit, standing_out
from rrru.errors import FitError
from rrru.estimation.evidence import MarginalLikelihood
from rrru.estimation.observations.length_starts import free_coordinates
from rrru.estimation.observations.lengths import Lengths
from rrru.estimation.parameters import Block, Parameters

UNEXPLAINED = "unexplained"
# starts in addition to the fit that judged the readings; least redundancy of a fit with an effect model
_STARTS, _FREEDOM = 3, 3
# folds of a cross-validation over every tenth row; largest number of rows for leave-one-out
_FOLDS, _FEW = 10, 20
# readings with a smaller share of their variance checked by the others of their row are not predicted
_MIN_CHECKED = 0.02
# least residual, in standard deviations, of a reading that is named
_STANDS_OUT = 5.0
# least probability of a smooth error that is named, and the logarithm of its odds
_SURE, _ODDS = 0.9, np.log(9.0)


@dataclass(frozen=True, eq=False)
class EffectModel:
    """One variant of an effect: effect, where it acts and what it adds in words.

    columns (n d + 2 k, c): derivatives of the machine's numbers by its parameters (c,); ranges (c,): their prior s.d.;
    believed: prior probability of this variant.
    """

    effect: str
    where: str
    adds: str
    columns: np.ndarray
    ranges: np.ndarray
    believed: float

    @property
    def block(self):
        """Its parameters, in mm where they are start lengths, else factors."""
        names = [f"{self.effect}_{k}" for k in range(len(self.ranges))]
        return Block.of(self.effect, names, [Lengths.unit] * len(names), self.ranges)


@dataclass(frozen=True)
class Hypothesis:
    """A combination of effect models, its fit, and its marginal likelihoods: None where it is not identifiable.

    independent: with noise alone; smooth: with noise and a smooth discrepancy.
    """

    effect_models: tuple
    fit: LengthFit
    independent: MarginalLikelihood | None
    smooth: MarginalLikelihood | None

    @property
    def effects(self):
        """Names of the effects of its effect models."""
        return tuple(effect_model.effect for effect_model in self.effect_models)

    @property
    def correlated(self):
        """Whether errors of neighbouring rows are correlated: the odds of a smooth discrepancy exceed 9."""
        return self.smooth is not None and self.smooth.log_evidence - self.independent.log_evidence > _ODDS

    @property
    def noise_mm(self):
        """Noise of a reading where there is a smooth discrepancy."""
        return self.smooth.noise_scale * self.fit.noise_mm

    @property
    def smooth_mm(self):
        """Standard deviation of the smooth discrepancy."""
        return self.smooth.discrepancy_scale * self.fit.noise_mm

    @property
    def standard_errors(self):
        """Standard errors of the machine's numbers, with a smooth discrepancy where errors are correlated."""
        if not self.correlated:
            return self.fit.standard_errors
        half = self.fit.lengths.basis @ self.smooth.covariance
        return np.sqrt((half * self.fit.lengths.basis).sum(axis=1))

    def logs(self):
        """Log evidence (2,) without and with a smooth discrepancy, each with prior probability 0.5."""
        if self.smooth is None:
            return np.full(2, -np.inf)
        return np.array([self.independent.log_evidence, self.smooth.log_evidence]) + np.log(0.5)


@dataclass(frozen=True)
class LengthCase:
    """Model selection problem of a set of lengths.

    bare: Lengths of the frame without effect models. effect_models: {effect: EffectModels}, of which at most one per
    effect acts. starts: function of Lengths that yields start values (p,).
    """

    bare: Lengths
    effect_models: dict
    starts: Callable

    def model(self, effect_models):
        """The Lengths with some effect models."""
        columns = [self.bare.basis, *(effect_model.columns for effect_model in effect_models)]
        return replace(self.bare, basis=np.concatenate(columns, axis=1))

    def parameters(self, effect_models):
        """The Parameters with some effect models; those of the frame, common to all combinations, have flat priors."""
        names = [f"frame_{number}" for number in range(self.bare.basis.shape[1])]
        frame = Block.of("frame", names, [Lengths.unit] * len(names), np.inf)
        return Parameters((frame, *(effect_model.block for effect_model in effect_models)))

    @cached_property
    def _judged(self):
        """The fit that judges the readings: with as many effect models as the readings determine."""
        largest = [max(ways, key=lambda effect_model: len(effect_model.ranges)) for ways in self.effect_models.values()]
        for count in range(len(largest), -1, -1):
            model = self.model(largest[:count])
            if count and model.redundancy < model.basis.shape[1]:
                continue
            fit = fit_lengths(model, self.starts(model))
            if fit.determined or not count:
                return fit

    @property
    def used(self):
        """Flags (N, k), False of bad readings."""
        return self._judged.used

    @property
    def suspect(self):
        """Flags (N, k) of readings with large residuals that are still used."""
        return standing_out(self._judged, _STANDS_OUT) & self.used

    def _fit(self, effect_models):
        """The fit with some effect models, started from the judging fit and from a few of the starts."""
        model, judged = self.model(effect_models), self._judged
        full = judged.lengths.origin + judged.lengths.basis @ judged.values
        near = np.linalg.pinv(model.basis) @ (full - model.origin)
        return fit_lengths(model, [near, *islice(self.starts(model), _STARTS)], self.used)

    def _prior(self, effect_models):
        """Prior probability of a combination."""
        acting = {effect_model.effect for effect_model in effect_models}
        absent = [
            1.0 - sum(effect_model.believed for effect_model in ways)
            for effect, ways in self.effect_models.items()
            if effect not in acting
        ]
        return float(np.prod([effect_model.believed for effect_model in effect_models]) * np.prod(absent))

    @cached_property
    def hypotheses(self):
        """Every combination of effect models that the readings determine, and its probabilities (h, 2).

        Columns of the probabilities: without and with a smooth error. Untested combinations keep their prior
        probability. Raises FitError where none can be fitted.
        """
        combinations = [()]
        for ways in self.effect_models.values():
            combinations += [(*effect_models, effect_model) for effect_models in combinations for effect_model in ways]
        found, logs, untried = [], [], 0.0
        for effect_models in combinations:
            if self.model(effect_models).redundancy < (_FREEDOM if effect_models else 1):
                untried += self._prior(effect_models)
                continue
            fit = self._fit(effect_models)
            found.append(Hypothesis(effect_models, fit, *fit.marginals(self.parameters(effect_models)) or (None, None)))
            logs.append(found[-1].logs() + np.log(self._prior(effect_models)))
        logs = np.array(logs).reshape(-1, 2)
        if not np.isfinite(logs).any():
            raise FitError("the lengths do not determine the frame: use more lengths, or places further apart", found)
        weights = np.exp(logs - logs.max())
        return tuple(found), (1.0 - untried) * weights / weights.sum()

    def verdict(self):
        """Effects of the most probable combination, its probability, and the most probable Hypothesis with them.

        UNEXPLAINED is among them, and its probability included, where a smooth error has a probability above 0.9.
        """
        found, probability = self.hypotheses
        sums = {}
        for hypothesis, row in zip(found, probability, strict=True):
            sums[hypothesis.effects] = sums.get(hypothesis.effects, 0.0) + row
        effects = max(sums, key=lambda key: sums[key].sum())
        candidates = [number for number, hypothesis in enumerate(found) if hypothesis.effects == effects]
        chosen = found[max(candidates, key=lambda number: probability[number].sum())]
        _, smooth = sums[effects]
        if smooth > _SURE * sums[effects].sum():
            return (*effects, UNEXPLAINED), float(smooth), chosen
        return effects, float(sums[effects].sum()), chosen

    def probability_of(self, asked):
        """Total probability of the combinations for which asked(effect_models) is true."""
        found, probability = self.hypotheses
        return float(sum(row.sum() for one, row in zip(found, probability, strict=True) if asked(one.effect_models)))

    def hypothesis(self, effect_models):
        """The Hypothesis of some effect models, None where it cannot be fitted."""
        return next((one for one in self.hypotheses[0] if one.effect_models == tuple(effect_models)), None)


def variants_of(effect, variants, prior_sd):
    """EffectModels of an effect from (where, adds, columns, prior probability); prior_sd: of every parameter."""
    return tuple(
        EffectModel(effect, where, adds, columns, np.full(columns.shape[1], prior_sd), probability)
        for where, adds, columns, probability in variants
    )


def frame_columns(count, dimensions, readings):
    """Columns (n d + 2 k, c) of the anchors' free coordinates and their places in the machine's numbers."""
    free = np.flatnonzero(free_coordinates(count, dimensions))
    return np.eye(count * dimensions + 2 * readings)[:, free], free


def predict_held_out(fit, held_out=None):
    """Held-out errors (N, k) in mm of every length, predicted from other rows and the other lengths of its row.

    Each is divided by the root of the share of its variance that the others check, so that pure noise keeps its own
    size. NaN for rejected readings and for those without redundancy. The folds are every tenth row, or single rows
    where there are at most 20. held_out (N,): the rows to hold out where they are given.
    """
    rows = len(fit.lengths)
    folds = np.arange(rows) % min(rows if rows <= _FEW else _FOLDS, rows)
    parts = [folds == fold for fold in range(folds.max() + 1)] if held_out is None else [held_out]
    errors = np.full(fit.used.shape, np.nan)
    for part in parts:
        values = refit(fit, ~part).values
        out = fit.lengths.rows(part)
        checked = 1.0 - out.place_leverage(values)
        errors[part] = out.residual(values) / np.sqrt(np.where(checked > _MIN_CHECKED, checked, np.nan))
    return np.where(fit.used, errors, np.nan)
