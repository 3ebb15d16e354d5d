"""Posterior probabilities of effects, of sets of them, and of a discrepancy, from the evidence of hypotheses."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import comb
from typing import NamedTuple, Self

import numpy as np

from rrru.arrays import BoolArray, FloatArray
from rrru.diagnosis.aliases import CauseSet
from rrru.diagnosis.discrepancy_basis import UNKNOWN
from rrru.diagnosis.evidence import ModelEvidence
from rrru.diagnosis.evidence_kernels import log_sum_exp
from rrru.diagnosis.hypothesis import Answer, Hypothesis
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.settings import Prior
from rrru.diagnosis.terms import EffectTerm, OnLegs, may_be_on_some, shape_probabilities, variants
from rrru.diagnosis.whitened import discrepancy_scales


@dataclass(frozen=True)
class Weighed:
    """A Hypothesis with the logarithms (levels,) of its weights, and at which levels something is unexplained."""

    hypothesis: Hypothesis
    log_weights: FloatArray
    unexplained: BoolArray

    @cached_property
    def height(self) -> float:
        """Logarithm of the sum of its weights."""
        return float(log_sum_exp(self.log_weights))


@dataclass(frozen=True)
class Posterior:
    """Hypotheses with logarithms (h, levels) of their weights up to a constant, and where they count as unexplained.

    apart: largest difference of a cause's probability between searches from different starts; expanded: probability of
    the sets all of whose neighbours have been looked at.
    """

    hypotheses: tuple[Hypothesis, ...]
    log_weights: FloatArray
    unexplained: BoolArray
    apart: float = 0.0
    expanded: float = 1.0

    @classmethod
    def of(cls, weighed: Sequence[Weighed], apart: float = 0.0, expanded: float = 1.0) -> Self:
        """The Posterior of a list of Weighed hypotheses without negligible sets of several effects.

        Single effects stay, however improbable: tables show each of them alone.
        """
        least = max(one.height for one in weighed) - OPTIONS.negligible_nats
        chosen = [one for one in weighed if one.height > least or len(one.hypothesis.terms) <= 1]
        weights, flags = (np.array([getattr(one, name) for one in chosen]) for name in ("log_weights", "unexplained"))
        return cls(tuple(one.hypothesis for one in chosen), weights, flags, apart, expanded)

    @property
    def total(self) -> float:
        """Logarithm of the sum of all weights, up to the constant."""
        return float(log_sum_exp(self.log_weights.ravel()))

    @cached_property
    def weights(self) -> FloatArray:
        """Weights (h, levels) that sum to one."""
        return np.exp(self.log_weights - self.total)

    def best(self) -> Answer:
        """The hypothesis of highest weight and its level (an index)."""
        return self._best(range(len(self.hypotheses)), self.log_weights)

    @cached_property
    def sets(self) -> Mapping[CauseSet, float]:
        """Probability by (frozenset of effects, unexplained), highest first."""
        result: dict[CauseSet, float] = {}
        for hypothesis, weight, unexplained in zip(self.hypotheses, self.weights, self.unexplained, strict=True):
            for flag in (False, True):
                if (unexplained == flag).any():
                    key = (hypothesis.effects - set(UNKNOWN), flag)
                    result[key] = result.get(key, 0.0) + float(weight[unexplained == flag].sum())
        return dict(sorted(result.items(), key=lambda item: (-item[1], sorted(item[0][0]), item[0][1])))

    @property
    def probability_unexplained(self) -> float:
        """Probability that something acts that the library does not hold."""
        return sum(p for (_, flag), p in self.sets.items() if flag)

    def marginal(self, effect: str) -> float:
        """Probability that an effect acts."""
        return float(self.weights[self._holding(effect)].sum())

    def any_of(self, effects: Iterable[str]) -> float:
        """Probability that at least one of some effects acts."""
        return float(self.weights[np.any([self._holding(effect) for effect in effects], axis=0)].sum())

    def both(self, first: str, second: str) -> float:
        """Probability that two effects act together."""
        return float(self.weights[self._holding(first) & self._holding(second)].sum())

    def without(self, effect: str) -> "Posterior":
        """The posterior with an effect ruled out."""
        keep = ~self._holding(effect)
        remaining = tuple(h for h, keeps in zip(self.hypotheses, keep, strict=True) if keeps)
        return Posterior(remaining, self.log_weights[keep], self.unexplained[keep], self.apart, self.expanded)

    def all_unexplained(self) -> "Posterior":
        """The posterior with something unexplained in every hypothesis."""
        return replace(self, unexplained=np.ones_like(self.unexplained))

    @property
    def height(self) -> float:
        """Logarithm of the highest weight, up to the constant."""
        return float(self.log_weights.max(initial=-np.inf))

    def legs(self, effect: str) -> dict[OnLegs, float]:
        """Probability by legs ("each", "same", 1, 2, 3, (1, 3)) of an effect, given that it acts."""
        result: dict[OnLegs, float] = {}
        for hypothesis, weight in zip(self.hypotheses, self.weights, strict=True):
            for term in hypothesis.terms:
                if term.effect == effect:
                    result[term.legs] = result.get(term.legs, 0.0) + float(weight.sum())
        total = sum(result.values())
        return {legs: p / total for legs, p in result.items()} if total > 0.0 else {}

    def best_of(self, effects: frozenset[str], unexplained: bool | None = None) -> Answer | None:
        """The hypothesis of highest weight with exactly these effects, and its level; None where there is none.

        Unless `unexplained` is asked for, one without discrepancy functions.
        """
        hidden = set() if unexplained is None else set(UNKNOWN)
        rows = [k for k, h in enumerate(self.hypotheses) if h.effects - hidden == effects]
        if not rows:
            return None
        weights = self.log_weights[rows]
        if unexplained is not None:
            weights = np.where(self.unexplained[rows] == unexplained, weights, -np.inf)
        return self._best(rows, weights)

    def best_where(self, condition: Callable[[frozenset[str]], bool]) -> Answer | None:
        """The hypothesis of highest weight without discrepancy functions whose effects meet a condition, and its level.

        condition: from a frozenset of names to a bool. None where there is none.
        """
        rows = [
            k
            for k, h in enumerate(self.hypotheses)
            if h.effects.isdisjoint(UNKNOWN) and condition(frozenset(h.effects))
        ]
        return self._best(rows, self.log_weights[rows]) if rows else None

    def _best(self, rows: Sequence[int], weights: FloatArray) -> Answer:
        """The hypothesis among some rows (k) of highest weight (k, levels), and its level (an index)."""
        row, level = np.unravel_index(weights.argmax(), weights.shape)
        return self.hypotheses[rows[int(row)]], int(level)

    def _holding(self, effect: str) -> BoolArray:
        """Which hypotheses (h,) contain an effect."""
        return np.array([effect in h.effects for h in self.hypotheses])


class TermPriors(NamedTuple):
    """Of terms (c,): whether each is an effect, not a discrepancy function, and log priors of its shape and legs."""

    known: BoolArray
    shape: FloatArray
    legs: FloatArray


class Weigher:
    """From the evidence of hypotheses to the logarithms of their weights, by the Prior.

    evidence: the ModelEvidence that hypotheses are of.
    """

    def __init__(self, evidence: ModelEvidence, prior: Prior) -> None:
        library = evidence.library
        self._evidence, self._levels = evidence, discrepancy_scales(evidence.noise)
        self._prior = prior
        self._effects: dict[str, FloatArray] = {}
        self._of_terms: dict[EffectTerm, tuple[float, float]] = {}
        # by effect the probabilities that it acts on some legs, and that it acts on each, on all alike, or on one
        self._kinds: dict[str, tuple[float, float]] = {}
        self._legs = {name: len(np.unique(effect.coordinates.legs)) for name, effect in library.items()}
        # log priors of the moments of jumps, 0 of smooth functions
        self._moments = {name: library[name].coordinates.log_prior for name in UNKNOWN if name in library}
        self._functions = len(self._moments)
        known = len(library) - self._functions
        self._sets = [prior.log_set(count, known) for count in range(known + 1)]
        self._function = float(np.log(prior.unexplained / max(self._functions, 1)))
        for name in library.keys() - UNKNOWN.keys():
            kinds = {term.legs if isinstance(term.legs, str) else "one" for term in variants(library[name])}
            coordinates, some = library[name].coordinates, may_be_on_some(library[name]) * OPTIONS.prior_some_legs
            self._kinds[name] = some, (1.0 - some) / len(kinds)
            self._effects[name] = np.log(shape_probabilities(coordinates)) + coordinates.log_prior

    def weighed(self, hypothesis: Hypothesis, least: float = -np.inf) -> Weighed:
        """The Weighed hypothesis; least: log weight below which it counts as unexplained without a test."""
        evidence, log_weights = self._evidence, hypothesis.evidence + self.terms(hypothesis.terms)
        if not log_weights.max() > least:
            unexplained = np.ones(len(log_weights), dtype=bool)
        else:
            tolerated = self._prior.tolerance * evidence.explained(hypothesis, evidence.library.keys() - UNKNOWN)
            unexplained = tolerated < np.maximum(self._levels, evidence.explained(hypothesis, set(UNKNOWN)))
        return Weighed(hypothesis, log_weights + self._of_levels(unexplained), unexplained)

    def terms(self, terms: Sequence[EffectTerm]) -> float:
        """Logarithm of the prior probability of a set of terms, whatever the discrepancy."""
        known = [term for term in terms if term.effect not in UNKNOWN]
        total = self._of_count(len(known), len(terms) - len(known))
        for term in terms:
            of_shape, of_legs = self._of_term(term)
            total += of_shape
            total += of_legs
        return total

    def with_each(self, terms: Sequence[EffectTerm], further: TermPriors) -> FloatArray:
        """`terms` of a set with each (c,) of some further terms, that one last."""
        known = [term for term in terms if term.effect not in UNKNOWN]
        functions = len(terms) - len(known)
        more, same = self._of_count(len(known) + 1, functions), self._of_count(len(known), functions + 1)
        total = np.where(further.known, more, same)
        for term in terms:
            of_shape, of_legs = self._of_term(term)
            total += of_shape
            total += of_legs
        total += further.shape
        total += further.legs
        return total

    def priors_of(self, terms: Sequence[EffectTerm]) -> TermPriors:
        """The TermPriors of some terms."""
        known = np.array([term.effect not in UNKNOWN for term in terms], dtype=bool)
        shape, legs = np.reshape([self._of_term(term) for term in terms], (-1, 2)).T
        return TermPriors(known, shape, legs)

    def _of_count(self, known: int, functions: int) -> float:
        """Log prior of so many effects and discrepancy functions; -inf for more effects than the library has."""
        return self._sets[known] + functions * self._function if known < len(self._sets) else -np.inf

    def _of_term(self, term: EffectTerm) -> tuple[float, float]:
        """Log prior of the shape and of the legs of one term; of a discrepancy function that of its moment."""
        if term not in self._of_terms:
            if term.effect in UNKNOWN:
                self._of_terms[term] = self._moments.get(term.effect, 0.0), 0.0
            else:
                of_shape = float(self._effects[term.effect][term.shape])
                self._of_terms[term] = of_shape, float(np.log(self._of_legs(term)))
        return self._of_terms[term]

    def _of_legs(self, term: EffectTerm) -> float:
        """Prior probability of a term's legs: numbers of them are equally probable, and choices of one number, too."""
        count, (some, other) = self._legs[term.effect], self._kinds[term.effect]
        if isinstance(term.legs, tuple):
            return some / ((count - 2) * comb(count, len(term.legs)))
        return other / count if isinstance(term.legs, int) else other

    def _of_levels(self, unexplained: BoolArray) -> FloatArray:
        """Log prior (levels,) of the discrepancy's levels: half of the part that is not unexplained has none at all."""
        if unexplained.all():
            # the prior of its discrepancy function has been counted
            return np.log(np.where(np.arange(len(unexplained)) == 0, 0.5, 0.5 / (len(unexplained) - 1)))
        explained, spare = 1.0 - self._prior.unexplained, np.count_nonzero(~unexplained) - 1
        result = np.full(len(unexplained), explained * (0.5 / spare if spare else 1.0))
        if spare:
            result[0] = explained * 0.5
        if unexplained.any():
            result[unexplained] = self._prior.unexplained / unexplained.sum()
        return np.asarray(np.log(result))
