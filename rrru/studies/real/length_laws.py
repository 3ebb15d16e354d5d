"""Machines of which lengths are known: which laws beside the frame their readings speak for.

Each law may act or not; every combination is fitted and weighed by its evidence, with independent noise alone and with
a smooth error that no law explains beside it (`rrru.fit.lengths_evidence`).
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice

import numpy as np

from rrru.errors import FitError
from rrru.fit.lengths_evidence import evidence
from rrru.fit.lengths_model import frame_basis
from rrru.fit.lengths_only import fit_lengths, stands_out
from rrru.fit.lengths_search import search

UNEXPLAINED = "unexplained"
# starts beside the fit that judged the readings; readings that a law's fit leaves free at least
_STARTS, _FREEDOM = 3, 3
# rows are foretold from the others in so many parts of every tenth row
_FOLDS, _FEW = 10, 20
# standard deviations from which a reading is named
_STANDS_OUT = 5.0
# probability from which a smooth error is named, and the logarithm of its odds
_SURE, _ODDS = 0.9, np.log(9.0)
_DRAWS, _BLOCKS, _SEED = 1000, 20, 1


@dataclass(frozen=True, eq=False)
class Law:
    """One way for a law to act: effect, where in words, what it adds in words.

    columns (n d + 2 k, c): what its numbers `names` (c,) change of the machine's; ranges (c,): 1 sigma of how far
    they may go. believed: probability of acting this way before any reading.
    """

    effect: str
    where: str
    adds: str
    columns: np.ndarray
    names: tuple
    ranges: np.ndarray
    believed: float


@dataclass(frozen=True)
class Hypothesis:
    """A combination of laws with its fit and evidence; smooth: whether a smooth error that none explains is beside."""

    laws: tuple
    fit: object
    evidence: object

    @property
    def effects(self):
        """Names of the effects of its laws."""
        return tuple(law.effect for law in self.laws)

    @property
    def alike(self):
        """Whether neighbouring rows err alike: whether a smooth error beside is all but sure."""
        return self.evidence is not None and self.evidence.smooth - self.evidence.independent > _ODDS

    @property
    def standard_errors(self):
        """Of the numbers as `LengthFit` has them, where neighbouring rows err alike those beside the smooth error."""
        return self.evidence.standard_errors if self.alike else self.fit.standard_errors

    def logs(self):
        """Log evidence without and with a smooth error, each half believed beside the laws' own beliefs; (2,)."""
        if self.evidence is None:
            return np.full(2, -np.inf)
        return np.array([self.evidence.independent, self.evidence.smooth]) + np.log(0.5)


@dataclass(frozen=True)
class LengthCase:
    """What a set of lengths is fitted with.

    bare: LengthModel of the frame without any law. laws: {effect: Laws}, at most one of each effect acts. starts:
    function of a LengthModel that yields (theta, places).
    """

    bare: object
    laws: dict
    starts: object

    def model(self, laws):
        """The LengthModel under some laws."""
        columns = [self.bare.basis, *(law.columns for law in laws)]
        names = (*self.bare.names, *(name for law in laws for name in law.names))
        return replace(self.bare, basis=np.concatenate(columns, axis=1), names=names)

    @cached_property
    def _judged(self):
        """The fit under all laws, with most numbers that the readings tell, that judges the readings."""
        largest = [max(ways, key=lambda law: len(law.names)) for ways in self.laws.values()]
        for count in range(len(largest), -1, -1):
            model = self.model(largest[:count])
            if count and model.redundant < len(model.names):
                continue
            fit = fit_lengths(model, self.starts(model))
            if fit.identifiability.rank == len(model.names) or not count:
                return fit

    @property
    def weight(self):
        """Flags (N, k), 0 of bad readings."""
        return self._judged.weight

    @property
    def suspect(self):
        """Flags (N, k) of readings that stand out but not so far that they are left out."""
        return stands_out(self._judged, _STANDS_OUT) & (self.weight > 0.0)

    def _fit(self, laws):
        """The fit under some laws, begun from the fit under all and from a few of the starts."""
        model, judged = self.model(laws), self._judged
        full = judged.model.origin + judged.model.basis @ judged.theta
        near = np.linalg.pinv(model.basis) @ (full - model.origin), judged.places
        return fit_lengths(model, [near, *islice(self.starts(model), _STARTS)], self.weight)

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
            if self.model(laws).redundant < (_FREEDOM if laws else 1):
                untried += self._believed(laws)
                continue
            fit = self._fit(laws)
            ranges = np.concatenate([np.full(len(self.bare.names), np.inf), *(law.ranges for law in laws)])
            found.append(Hypothesis(laws, fit, evidence(fit, ranges)))
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
        names = tuple(f"{effect}_{k}" for k in range(columns.shape[1]))
        laws.append(Law(effect, where, adds, columns, names, reach(columns), believed))
    return tuple(laws)


def frame_columns(count, dimensions, readings):
    """Columns (n d + 2 k, c) of the anchors' free coordinates and their places in the machine's numbers."""
    free = np.flatnonzero(frame_basis(count, dimensions))
    return np.eye(count * dimensions + 2 * readings)[:, free], free


def foretold(fit, held_out=None):
    """Errors (N, k) in mm of every length as the other rows and the other lengths of its row foretell it.

    Each over the root of the share of its variance that the others check, so that noise alone gives its own size; NaN
    for readings left out and for those that nothing checks. Machines are fitted to every tenth row's complement, or
    without one row where there are at most 20. held_out (N,): the rows to foretell where they are given.
    """
    rows = len(fit.weight)
    folds = np.arange(rows) % min(rows if rows <= _FEW else _FOLDS, rows)
    parts = [folds == fold for fold in range(folds.max() + 1)] if held_out is None else [held_out]
    errors = np.full(fit.weight.shape, np.nan)
    for part in parts:
        left, out = fit.model.rows(~part), fit.model.rows(part)
        theta, _ = search(left, fit.theta, fit.places[~part], fit.weight[~part])
        places = fit.places[part]
        if fit.model.unknown:
            _, places = search(out, theta, places, fit.weight[part], rows_only=True)
        errors[part] = out.residual(theta, places) / np.sqrt(_checked(out, theta, places, fit.weight[part]))
    return np.where(fit.weight > 0.0, errors, np.nan)


def _checked(model, theta, places, weight):
    """Share (N, k) of a reading's variance that the row's unknowns leave; NaN where that is next to nothing."""
    if not model.unknown:
        return np.ones(weight.shape)
    _, by_place = model.slopes(theta, places)
    basis, _ = np.linalg.qr(weight[..., None] * by_place)
    share = 1.0 - (basis**2).sum(axis=-1)
    return np.where(share > 0.02, share, np.nan)


def rms(values):
    """Root mean square of the values that are not NaN."""
    return float(np.sqrt(np.nanmean(values**2)))


def share_closed(before, after, noise_mm):
    """Share of the gap that errors (N, k) close, and its 95 % interval by drawing blocks of neighbouring rows."""
    generator = np.random.default_rng(_SEED)
    blocks = np.array_split(np.arange(len(before)), min(_BLOCKS, len(before)))
    counts = np.array([np.isfinite(before[block]).sum() for block in blocks])
    first, second = (np.array([np.nansum(one[block] ** 2) for block in blocks]) for one in (before, after))
    drawn = generator.integers(len(counts), size=(_DRAWS, len(counts)))

    def share(chosen):
        total = np.maximum(counts[chosen].sum(axis=-1), 1)
        gaps = [np.sqrt(np.maximum(one[chosen].sum(axis=-1) / total - noise_mm**2, 0.0)) for one in (first, second)]
        return np.where(gaps[0] > 0.0, np.maximum(1.0 - gaps[1] / np.maximum(gaps[0], 1e-12), -1.0), 0.0)

    value = float(share(np.arange(len(counts))))
    low, high = np.quantile(share(drawn), [0.025, 0.975])
    return value, float(min(low, value)), float(max(high, value))
