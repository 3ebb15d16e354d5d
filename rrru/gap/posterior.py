"""From the evidence of hypotheses to probabilities: of effects, of sets of them, and of what no effect explains."""

from dataclasses import dataclass
from functools import cached_property
from math import comb

import numpy as np

from rrru.gap.evidence_kernels import log_sum_exp
from rrru.gap.options import OPTIONS
from rrru.gap.terms import EACH, SAME, variants
from rrru.gap.unknown import UNKNOWN
from rrru.gap.whitened import levels_of


@dataclass(frozen=True)
class Posterior:
    """Hypotheses with logarithms (h, levels) of their weights up to a constant, and where they count as unexplained."""

    hypotheses: tuple
    log_weights: np.ndarray
    unexplained: np.ndarray

    @cached_property
    def weights(self):
        """Weights (h, levels) that sum to one."""
        return np.exp(self.log_weights - log_sum_exp(self.log_weights.ravel()))

    def best(self):
        """The hypothesis of highest weight and its level (an index)."""
        return self._best(range(len(self.hypotheses)), self.log_weights)

    def sets(self):
        """Probability by (frozenset of effects, unexplained), highest first."""
        result = {}
        for hypothesis, weight, unexplained in zip(self.hypotheses, self.weights, self.unexplained, strict=True):
            for flag in (False, True):
                if (unexplained == flag).any():
                    key = (hypothesis.effects - set(UNKNOWN), flag)
                    result[key] = result.get(key, 0.0) + float(weight[unexplained == flag].sum())
        return dict(sorted(result.items(), key=lambda item: (-item[1], sorted(item[0][0]), item[0][1])))

    @property
    def probability_unexplained(self):
        """Probability that something acts that the library does not hold."""
        return sum(p for (_, flag), p in self.sets().items() if flag)

    def marginal(self, effect):
        """Probability that an effect acts."""
        return float(self.weights[self._holding(effect)].sum())

    def without(self, effect):
        """The posterior with an effect ruled out."""
        keep = ~self._holding(effect)
        kept = tuple(h for h, fine in zip(self.hypotheses, keep, strict=True) if fine)
        return Posterior(kept, self.log_weights[keep], self.unexplained[keep])

    @property
    def height(self):
        """Logarithm of the highest weight, up to the constant."""
        return float(self.log_weights.max(initial=-np.inf))

    def legs(self, effect):
        """Probability by legs ("each", "same", 1, 2, 3) of an effect, given that it acts."""
        result = {}
        for hypothesis, weight in zip(self.hypotheses, self.weights, strict=True):
            for term in hypothesis.terms:
                if term.effect == effect:
                    result[term.legs] = result.get(term.legs, 0.0) + float(weight.sum())
        total = sum(result.values())
        return {legs: p / total for legs, p in result.items()} if total > 0.0 else {}

    def best_of(self, effects, unexplained=None):
        """The hypothesis of highest weight with exactly these effects, and its level; None where there is none.

        Unless `unexplained` is asked for, one without unknown functions.
        """
        hidden = set() if unexplained is None else set(UNKNOWN)
        rows = [k for k, h in enumerate(self.hypotheses) if h.effects - hidden == effects]
        if not rows:
            return None
        weights = self.log_weights[rows]
        if unexplained is not None:
            weights = np.where(self.unexplained[rows] == unexplained, weights, -np.inf)
        return self._best(rows, weights)

    def _best(self, rows, weights):
        """The hypothesis among some rows (k) of highest weight (k, levels), and its level (an index)."""
        row, level = np.unravel_index(weights.argmax(), weights.shape)
        return self.hypotheses[rows[row]], int(level)

    def _holding(self, effect):
        """Which hypotheses (h,) hold an effect."""
        return np.array([effect in h.effects for h in self.hypotheses])


def posterior(evidence, hypotheses, prior):
    """Posterior of the hypotheses that `rrru.gap.search.search` has found."""
    log_prior = _LogPrior(evidence.library, prior)
    log_weight = np.array([h.evidence + log_prior.terms(h.terms) for h in hypotheses])
    # single effects stay, however improbable: tables show what each does alone
    single = np.array([len(h.terms) <= 1 for h in hypotheses])
    worth = single | (log_weight.max(axis=1) > log_weight.max() - OPTIONS.negligible_nats)
    kept = tuple(h for h, fine in zip(hypotheses, worth, strict=True) if fine)
    log_weight = log_weight[worth]
    unexplained, levels = np.zeros(log_weight.shape, dtype=bool), levels_of(evidence.noise)
    for row, hypothesis in enumerate(kept):
        tolerated = prior.tolerance * evidence.explained(hypothesis, evidence.library.keys() - UNKNOWN)
        unexplained[row] = tolerated < np.maximum(levels, evidence.explained(hypothesis, set(UNKNOWN)))
        log_weight[row] += log_prior.levels(unexplained[row])
    return Posterior(kept, log_weight, unexplained)


class _LogPrior:
    """Logarithms of prior probabilities under a library."""

    def __init__(self, library, prior):
        self._prior, self._effects = prior, {}
        self._legs = {name: len(np.unique(effect.coordinates.legs)) for name, effect in library.items()}
        self._functions = sum(name in UNKNOWN for name in library)
        for name in library.keys() - UNKNOWN.keys():
            kinds = {term.legs if isinstance(term.legs, str) else "one" for term in variants(library[name])}
            coordinates = library[name].coordinates
            weights = coordinates.weights or np.full(len(coordinates.shapes), 1.0 / len(coordinates.shapes))
            self._effects[name] = np.log(weights) - np.log(len(kinds)) + coordinates.log_prior

    def terms(self, terms):
        """Of a set of terms, alike for all sets of one size."""
        known = [term for term in terms if term.effect not in UNKNOWN]
        total = self._prior.log_count(len(known)) - np.log(comb(len(self._effects), len(known)))
        total += (len(terms) - len(known)) * np.log(self._prior.unexplained / max(self._functions, 1))
        for term in known:
            total += self._effects[term.effect][term.shape]
            if term.legs not in (EACH, SAME):
                total -= np.log(self._legs[term.effect])
        return total

    def levels(self, unexplained):
        """Of the discrepancy's levels (levels,): half of what is not unexplained is none at all."""
        if unexplained.all():
            # its unknown function has paid for it
            return np.log(np.where(np.arange(len(unexplained)) == 0, 0.5, 0.5 / (len(unexplained) - 1)))
        explained, spare = 1.0 - self._prior.unexplained, np.count_nonzero(~unexplained) - 1
        result = np.full(len(unexplained), explained * (0.5 / spare if spare else 1.0))
        if spare:
            result[0] = explained * 0.5
        if unexplained.any():
            result[unexplained] = self._prior.unexplained / unexplained.sum()
        return np.log(result)
