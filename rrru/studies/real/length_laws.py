"""Machines of which lengths are known: which laws beside the frame their readings speak for.

Each law may act or not; every combination is fitted and weighed by its evidence, with independent noise alone and with
a smooth discrepancy that no law explains (`rrru.estimation.evidence`). Neighbouring rows err alike wherever a law is
lacking; F tests or BIC, which count them as independent, then find whatever term resembles the discrepancy.
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
# starts beside the fit that judged the readings; readings that a law's fit leaves free at least
_STARTS, _FREEDOM = 3, 3
# rows are predicted from the others in so many parts of every tenth row
_FOLDS, _FEW = 10, 20
# readings that the others of their row check by a smaller share of their variance are not predicted
_MIN_CHECKED = 0.02
# standard deviations from which a reading is named
_STANDS_OUT = 5.0
# probability from which a smooth error is named, and the logarithm of its odds
_SURE, _ODDS = 0.9, np.log(9.0)


@dataclass(frozen=True, eq=False)
class Law:
    """One way for a law to act: effect, where in words, what it adds in words.

    columns (n d + 2 k, c): what its parameters (c,) change of the machine's numbers; ranges (c,): their prior standard
    deviations. believed: prior probability of acting this way.
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
    """A combination of laws, its fit, and its marginal likelihoods: None where the readings do not determine it.

    independent: with noise alone; smooth: with noise and a smooth discrepancy.
    """

    laws: tuple
    fit: LengthFit
    independent: MarginalLikelihood | None
    smooth: MarginalLikelihood | None

    @property
    def effects(self):
        """Names of the effects of its laws."""
        return tuple(law.effect for law in self.laws)

    @property
    def alike(self):
        """Whether neighbouring rows err alike: whether a smooth discrepancy is all but sure."""
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
        """Of the machine's numbers as `LengthFit` has them, under a smooth discrepancy where neighbours err alike."""
        if not self.alike:
            return self.fit.standard_errors
        half = self.fit.lengths.basis @ self.smooth.covariance
        return np.sqrt((half * self.fit.lengths.basis).sum(axis=1))

    def logs(self):
        """Log evidence without and with a smooth discrepancy, each half as probable before; (2,)."""
        if self.smooth is None:
            return np.full(2, -np.inf)
        return np.array([self.independent.log_evidence, self.smooth.log_evidence]) + np.log(0.5)


@dataclass(frozen=True)
class LengthCase:
    """What a set of lengths is fitted with.

    bare: Lengths of the frame without any law. laws: {effect: Laws}, at most one of each effect acts. starts: function
    of Lengths that yields values (p,) to start from.
    """

    bare: Lengths
    laws: dict
    starts: Callable

    def model(self, laws):
        """The Lengths under some laws."""
        columns = [self.bare.basis, *(law.columns for law in laws)]
        return replace(self.bare, basis=np.concatenate(columns, axis=1))

    def parameters(self, laws):
        """The Parameters under some laws: flat priors of the frame's, which all combinations share."""
        names = [f"frame_{number}" for number in range(self.bare.basis.shape[1])]
        frame = Block.of("frame", names, [Lengths.unit] * len(names), np.inf)
        return Parameters((frame, *(law.block for law in laws)))

    @cached_property
    def _judged(self):
        """The fit under all laws, with most parameters that the readings tell, that judges the readings."""
        largest = [max(ways, key=lambda law: len(law.ranges)) for ways in self.laws.values()]
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
        """Flags (N, k) of readings that stand out but not so far that they are left out."""
        return standing_out(self._judged, _STANDS_OUT) & self.used

    def _fit(self, laws):
        """The fit under some laws, begun from the fit under all and from a few of the starts."""
        model, judged = self.model(laws), self._judged
        full = judged.lengths.origin + judged.lengths.basis @ judged.values
        near = np.linalg.pinv(model.basis) @ (full - model.origin)
        return fit_lengths(model, [near, *islice(self.starts(model), _STARTS)], self.used)

    def _believed(self, laws):
        """Probability of a combination before any reading."""
        acting = {law.effect for law in laws}
        rest = [1.0 - sum(law.believed for law in ways) for effect, ways in self.laws.items() if effect not in acting]
        return float(np.prod([law.believed for law in laws]) * np.prod(rest))

    @cached_property
    def hypotheses(self):
        """Every combination of laws that the readings are enough for, and its probabilities (h, 2).

        Columns of the probabilities: without and with a smooth error. What was not tried keeps what was believed of it.
        Raises FitError where none can be fitted.
        """
        combinations = [()]
        for ways in self.laws.values():
            combinations += [(*laws, law) for laws in combinations for law in ways]
        found, logs, untried = [], [], 0.0
        for laws in combinations:
            if self.model(laws).redundancy < (_FREEDOM if laws else 1):
                untried += self._believed(laws)
                continue
            fit = self._fit(laws)
            found.append(Hypothesis(laws, fit, *fit.marginals(self.parameters(laws)) or (None, None)))
            logs.append(found[-1].logs() + np.log(self._believed(laws)))
        logs = np.array(logs).reshape(-1, 2)
        if not np.isfinite(logs).any():
            raise FitError("the lengths do not tell the frame: they are too few or too much alike", found)
        weights = np.exp(logs - logs.max())
        return tuple(found), (1.0 - untried) * weights / weights.sum()

    def verdict(self):
        """Effects of the likeliest combination of effects, its probability, and the likeliest Hypothesis with them.

        UNEXPLAINED is among them, and the probability that of it too, where a smooth error beside is all but sure.
        """
        found, probability = self.hypotheses
        sums = {}
        for one, row in zip(found, probability, strict=True):
            sums[one.effects] = sums.get(one.effects, 0.0) + row
        effects = max(sums, key=lambda key: sums[key].sum())
        alike = [number for number, one in enumerate(found) if one.effects == effects]
        chosen = found[max(alike, key=lambda number: probability[number].sum())]
        _, smooth = sums[effects]
        if smooth > _SURE * sums[effects].sum():
            return (*effects, UNEXPLAINED), float(smooth), chosen
        return effects, float(sums[effects].sum()), chosen

    def probability_of(self, asked):
        """Probability of all combinations of which asked(laws) holds."""
        found, probability = self.hypotheses
        return float(sum(row.sum() for one, row in zip(found, probability, strict=True) if asked(one.laws)))

    def hypothesis(self, laws):
        """The Hypothesis of some laws, None where it cannot be fitted."""
        return next((one for one in self.hypotheses[0] if one.laws == tuple(laws)), None)


def ways_of(effect, told, reach):
    """Laws of an effect from (where, adds, columns, believed); reach(columns): how far its numbers may go, 1 sigma."""
    laws = []
    for where, adds, columns, believed in told:
        laws.append(Law(effect, where, adds, columns, reach(columns), believed))
    return tuple(laws)


def frame_columns(count, dimensions, readings):
    """Columns (n d + 2 k, c) of the anchors' free coordinates and their places in the machine's numbers."""
    free = np.flatnonzero(free_coordinates(count, dimensions))
    return np.eye(count * dimensions + 2 * readings)[:, free], free


def predict_held_out(fit, held_out=None):
    """Held-out errors (N, k) in mm: of every length as predicted by other rows and the other lengths of its row.

    Each over the root of the share of its variance that the others check, so that noise alone gives its own size; NaN
    for readings left out and for those that nothing checks. Machines are fitted to every tenth row's complement, or
    without one row where there are at most 20. held_out (N,): the rows to hold out where they are given.
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
