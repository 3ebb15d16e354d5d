"""The space of all sets of terms, and which of them carry the posterior probability.

From a starting set on, the neighbours of the most probable set whose neighbours are not known yet are evaluated, again
and again: sets with a term more, with one less, and with one term in place of another, be it the same effect on other
legs, on one leg more or less, or in another shape, then also with one term less. It ends when no such set has a
relevant share of the posterior: a set that is left out then is several worse steps away from all relevant ones. This is
the neighbourhood search of C. Hans, A. Dobra and M. West, "Shotgun stochastic search for large p regression", JASA 102
(2007), which visits sets in the order of their weight in place of a random one; the sets retained are those of Occam's
window (D. Madigan and A. Raftery, JASA 89, 1994).

A neighbour is evaluated where it may matter by what its term adds at the prior scales of the others, which stay.
Once the coefficients of a set have been averaged over, the Gram matrix and the moments of all other columns are

    G' = G - W^T W,  g' = g - G_x a,  W = L^-1 S G_x,  L L^T = I + S G_xx S

with the set's columns x, its prior deviations S and its most probable coefficients a. Each term then is a small block
of them. Errors of payload and tilt count in the set and not in the term, and signs of the set's coefficients are those
of a: it is for choosing sets, not for weighing them.

Two searches start from opposite ends, from nothing and from as many effects as the data bear. How far the probabilities
of causes differ between what each of them has visited says whether the answer depends on where one starts. As long as
the linearisation moves with the answer, a search only climbs: it ends at a set that is more probable than all of its
neighbours, and is completed once its answer has come back.
"""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import solve_triangular

from rrru.arrays import BoolArray, FloatArray, IntArray
from rrru.cache import read_only
from rrru.diagnosis.discrepancy_basis import UNKNOWN
from rrru.diagnosis.evidence import ModelEvidence, averaged
from rrru.diagnosis.evidence_kernels import log_evidence_of_blocks, log_sum_exp
from rrru.diagnosis.hypothesis import Hypothesis
from rrru.diagnosis.marginal_problem import PRIOR_SCALES, posterior_mean
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.posterior import Posterior, TermPriors, Weighed, Weigher
from rrru.diagnosis.settings import Prior
from rrru.diagnosis.terms import EACH, EffectTerm, on_neighbouring_legs, variants
from rrru.diagnosis.whitened import DISCREPANCY_SCALES


def explore(
    evidence: ModelEvidence, prior: Prior, without: Collection[str] = (), most: int = OPTIONS.max_effects
) -> Posterior:
    """The Posterior over sets of up to `most` terms.

    evidence: ModelEvidence on the readings at which all sets compare; prior: a Prior; without: names of effects that
    are ruled out.
    """
    space = ModelSpace(evidence, prior, without, most)
    return space.confirmed(space.climb(()))


@dataclass
class _Search:
    """Sets that a search has reached and those whose neighbours it has evaluated, by their terms as a set, in order."""

    reached: dict[frozenset[EffectTerm], None] = field(default_factory=dict)
    expanded: dict[frozenset[EffectTerm], None] = field(default_factory=dict)

    def reach(self, terms: Iterable[EffectTerm]) -> None:
        """Note that a set has been reached."""
        self.reached[frozenset(terms)] = None


class ModelSpace:
    """Sets of terms that have been evaluated; see `explore`."""

    def __init__(
        self, evidence: ModelEvidence, prior: Prior, without: Collection[str] = (), most: int = OPTIONS.max_effects
    ) -> None:
        self._evidence, self._weigher = evidence, Weigher(evidence, prior)
        self.library = {name: effect for name, effect in evidence.library.items() if name not in without}
        self._terms = [term for effect in self.library.values() for term in variants(effect)]
        self._most = min(most, len(self.library))
        self._known: dict[frozenset[EffectTerm], Weighed] = {}
        # those whose best level has been looked for
        self._climbed: set[frozenset[EffectTerm]] = set()
        self._highest = -np.inf
        # searches from different starts expand the same sets
        self._gained: dict[tuple[Any, ...], tuple[FloatArray, FloatArray]] = {}
        for terms in ((), *((term,) for term in self._terms)):
            self._single(terms)

    @cached_property
    def _candidates(self) -> "Candidates":
        return Candidates(self._evidence, self._terms)

    @cached_property
    def _priors(self) -> TermPriors:
        """Of the candidates."""
        return self._weigher.priors_of(self._candidates.terms)

    @cached_property
    def _rows(self) -> dict[EffectTerm, int]:
        """Number of each candidate."""
        return {term: row for row, term in enumerate(self._candidates.terms)}

    def confirmed(self, first: _Search) -> Posterior:
        """The Posterior after a search, completed, and one from the other end.

        Where these differ, one begins from both answers as well.
        """
        searches = [self.completed(first), self.search(self.fullest())]
        found = self.posterior(searches)
        if found.apart > OPTIONS.max_searches_apart:
            best = [max(one.reached, key=lambda key: self._known[key].height) for one in searches]
            both = {term.effect: term for key in best for term in self._known[key].hypothesis.terms}
            searches.append(self.search(tuple(both.values())[: self._most]))
            found = self.posterior(searches)
        return found

    def posterior(self, searches: Sequence[_Search]) -> Posterior:
        """The Posterior over all sets that have been evaluated, with the difference of the two best searches."""
        found = list(self._known.values())
        result = Posterior.of(found)
        causes = self.library.keys() - UNKNOWN.keys()
        of_searches = [Posterior.of([self._known[key] for key in search.reached]) for search in searches]
        best = sorted(of_searches, key=lambda posterior: -posterior.total)[:2]
        marginals = np.array([[posterior.marginal(name) for name in sorted(causes)] for posterior in best])
        apart = float(np.ptp(marginals, axis=0).max(initial=0.0))
        expanded = {key: None for one in searches for key in one.expanded}
        share = sum(np.exp(self._known[key].height - result.total) for key in expanded)
        return Posterior.of(found, apart, float(share))

    def search(self, start: Sequence[EffectTerm]) -> _Search:
        """A search from a set of terms on, until no set is left whose neighbours matter or the time is up."""
        return self.completed(self.climb(start))

    def climb(self, start: Sequence[EffectTerm]) -> _Search:
        """A search from a set of terms on, until the neighbours of the most probable set have been evaluated."""
        known = {term for term in start if self._is_known(term)}
        found, first = _Search(), frozenset(known)
        self._evaluate(tuple(term for term in start if term in known), None, None, climb=True)
        for terms in ((), *((term,) for term in self._terms), first):
            found.reach(terms)
        upcoming = first
        while upcoming not in found.expanded and len(found.expanded) < OPTIONS.max_expanded_sets:
            self._expand(upcoming, found)
            upcoming = max(found.reached, key=lambda key: self._known[key].height)
        return found

    def completed(self, found: _Search) -> _Search:
        """The search continued until no set is left whose neighbours matter or the time is up."""
        while len(found.expanded) < OPTIONS.max_expanded_sets and (upcoming := self._next(found)) is not None:
            self._expand(upcoming, found)
        return found

    def _next(self, found: _Search) -> frozenset[EffectTerm] | None:
        """The most probable set whose neighbours have not been evaluated, None where it does not matter."""
        heights = {key: self._known[key].height for key in found.reached}
        open_sets = [key for key in heights if key not in found.expanded]
        best = max(open_sets, key=lambda key: heights[key], default=None)
        total = log_sum_exp(np.array(list(heights.values())))
        matters = best is not None and heights[best] > total + np.log(OPTIONS.min_expanded_probability)
        return best if matters else None

    def fullest(self) -> tuple[EffectTerm, ...]:
        """The set that grows by the term that adds most, however improbable many terms are, as long as one adds."""
        terms: tuple[EffectTerm, ...] = ()
        prior_scales: list[float] = []
        level = int(self._evidence.none.argmax())
        while len(terms) < self._most:
            total, best = self._gains(terms, prior_scales, level)
            row = int(total.argmax())
            if total[row] <= 0.0:
                break
            terms, prior_scales = (*terms, self._candidates.terms[row]), [*prior_scales, best[row]]
            at = [self._at(terms, prior_scales, one) for one in self._evidence.levels]
            level = int(self._evidence.levels[int(np.argmax(at))])
        return terms

    def _at(self, terms: Sequence[EffectTerm], prior_scales: Sequence[float] | FloatArray, level: int) -> float:
        """Log evidence of a set of terms at its prior scales and a level."""
        return float(self._evidence.over_strengths(terms, [[one] for one in prior_scales], [level])[0][0, 0])

    def _gains(
        self, terms: Sequence[EffectTerm], prior_scales: Sequence[float] | FloatArray, level: int
    ) -> tuple[FloatArray, FloatArray]:
        """Log evidence (c,) that each candidate adds to a set, averaged over its prior scale, and the best scale."""
        asked = *terms, *prior_scales, level
        if asked not in self._gained:
            gains = self._candidates.gains(terms, prior_scales, level)
            total = np.full(len(gains), -np.inf)
            may_act = gains[:, 0] > -np.inf
            total[may_act] = averaged(gains[may_act], self._candidates.log_scales[may_act])
            self._gained[asked] = read_only((total, PRIOR_SCALES[gains.argmax(axis=1)]))
        return self._gained[asked]

    def _expand(self, key: frozenset[EffectTerm], found: _Search) -> None:
        """Evaluate those of a set's neighbours that may matter."""
        found.expanded[key] = None
        centre = self._known[key]
        terms, level = centre.hypothesis.terms, centre.hypothesis.level
        prior_scales, present = centre.hypothesis.prior_scales[level], centre.hypothesis.evidence.max()
        chosen = []
        for out in (None, *range(len(terms))):
            base, start = centre.hypothesis, present
            if out is not None:
                remaining = [k for k in range(len(terms)) if k != out]
                smaller = tuple(terms[k] for k in remaining)
                self._evaluate(smaller, level, prior_scales[remaining], climb=True)
                found.reach(smaller)
                base = self._known[frozenset(smaller)].hypothesis
            if len(base.terms) == self._most:
                continue
            scales = base.prior_scales[base.level]
            gains, best = self._gains(base.terms, scales, base.level)
            if out is not None:
                # a replacement of a term adds more or less than that did
                start = self._without(centre.hypothesis, out, gains, base)
            heights = start + gains + self._weigher.with_each(base.terms, self._priors)
            may_act = gains > -np.inf
            may_act[[self._rows[term] for term in terms if term in self._rows]] = False
            rows = np.flatnonzero(may_act)
            for rank, row in enumerate(rows[np.argsort(-heights[rows], kind="stable")].tolist()):
                if rank >= OPTIONS.min_neighbours and heights[row] < self._highest - OPTIONS.window_nats:
                    break
                chosen.append((heights[row], (*base.terms, self._candidates.terms[row]), np.append(scales, best[row])))
        chosen.sort(key=lambda one: -one[0])
        nearest = [one[1:] for one in chosen[: OPTIONS.max_neighbours]]
        for neighbour, scales in (*nearest, *self._on_neighbouring_legs(centre.hypothesis)):
            self._evaluate(neighbour, level, scales)
            found.reach(neighbour)
            if {term.effect for term in neighbour} == centre.hypothesis.effects:
                # an effect on other legs or in another shape may make another one unnecessary
                for out in range(len(neighbour) - 1):
                    remaining = [k for k in range(len(neighbour)) if k != out]
                    smaller = tuple(neighbour[k] for k in remaining)
                    if self._may_matter(smaller, level, scales[remaining]):
                        self._evaluate(smaller, level, scales[remaining])
                        found.reach(smaller)

    def _may_matter(self, terms: Sequence[EffectTerm], level: int, scales: FloatArray) -> bool:
        """Whether a set is not hopeless at its prior scales, by more than other ones may gain."""
        if frozenset(terms) in self._known:
            return True
        height = self._at(terms, scales, level) + self._weigher.terms(terms)
        return height > self._highest - OPTIONS.hopeless_nats - OPTIONS.window_nats

    def _on_neighbouring_legs(self, centre: Hypothesis) -> Iterator[tuple[tuple[EffectTerm, ...], FloatArray]]:
        """Sets that may matter with one term on a leg more or less, that term last, and their prior scales."""
        terms, level = centre.terms, centre.level
        scales = centre.prior_scales[level]
        # at the same prior scales, which need not be averaged over to see that a leg is necessary or adds nothing
        rest = centre.evidence.max() - self._at(terms, scales, level) if terms else 0.0
        for out, term in enumerate(terms):
            order = [*(k for k in range(len(terms)) if k != out), out]
            for changed in on_neighbouring_legs(self.library[term.effect], term):
                neighbour = (*(terms[k] for k in order[:-1]), changed)
                height = rest + self._at(neighbour, scales[order], level) + self._weigher.terms(neighbour)
                if height > self._highest - OPTIONS.window_nats:
                    yield neighbour, scales[order]

    def _without(self, hypothesis: Hypothesis, out: int, gains: FloatArray, smaller: Hypothesis) -> float:
        """Log evidence of a hypothesis without the term `out`, where possible by the gains (c,) of the candidates."""
        term = hypothesis.terms[out]
        if term in self._rows:
            return float(hypothesis.evidence.max() - gains[self._rows[term]])
        return float(smaller.evidence.max())

    def _is_known(self, term: EffectTerm) -> bool:
        """Whether a term, on whichever legs, is of this space."""
        return term._replace(legs=EACH) in self._terms

    def _evaluate(
        self, terms: Sequence[EffectTerm], level: int | None, prior_scales: FloatArray | None, climb: bool = False
    ) -> None:
        """Evaluate a set of terms unless it is known: at a level, and at those next to it as long as they matter.

        climb: whether the best level is looked for even where the set is hopeless.
        """
        key = frozenset(terms)
        if key in self._known and (key in self._climbed or not climb):
            return
        evidence, best = np.full(len(DISCREPANCY_SCALES), -np.inf), np.ones((len(DISCREPANCY_SCALES), len(terms)))
        allowed, prior = set(self._evidence.levels.tolist()), self._weigher.terms(terms)
        waiting = [int(self._evidence.none.argmax()) if level is None else level]
        while waiting:
            level = waiting.pop(0)
            evidence[level], best[level] = self._evidence.over_all_strengths(terms, level, prior_scales)
            prior_scales = best[int(evidence.argmax())]
            hopeless = evidence.max() + prior < self._highest - OPTIONS.hopeless_nats
            if hopeless and not climb:
                break
            if evidence[level] >= evidence.max() - (0.0 if hopeless else OPTIONS.window_nats):
                nearest = (one for one in (level - 1, level + 1) if one in allowed and evidence[one] == -np.inf)
                waiting += [one for one in nearest if one not in waiting]
        self._know(Hypothesis(tuple(terms), evidence, best))
        if climb or not hopeless:
            self._climbed.add(key)

    def _single(self, terms: Sequence[EffectTerm]) -> None:
        """Evaluate no term or one at all levels."""
        evidence, best = self._evidence.none.copy(), np.ones((len(DISCREPANCY_SCALES), len(terms)))
        if terms:
            value, grid = self._evidence.over_strengths(terms)
            levels, log_scales = self._evidence.levels, self._evidence.log_scales(terms)
            evidence[levels], best[levels] = averaged(value, log_scales), grid[value.argmax(axis=1)]
        self._know(Hypothesis(tuple(terms), evidence, best))
        self._climbed.add(frozenset(terms))

    def _know(self, hypothesis: Hypothesis) -> None:
        """Keep a hypothesis that has been evaluated."""
        weighed = self._weigher.weighed(hypothesis, self._highest - OPTIONS.negligible_nats)
        self._known[frozenset(hypothesis.terms)] = weighed
        self._highest = max(self._highest, float(hypothesis.evidence.max()) + self._weigher.terms(hypothesis.terms))


class Candidates:
    """All terms that may be added to a set, and the log evidence that every single one adds.

    evidence: a ModelEvidence; terms: Terms whose effects are in its library.
    """

    def __init__(self, evidence: ModelEvidence, terms: Sequence[EffectTerm]) -> None:
        self._evidence = evidence
        broad = [evidence.library[term.effect].coordinates.broad for term in terms]
        self._broad = [term for term, many in zip(terms, broad, strict=True) if many]
        self.terms = [*(term for term, many in zip(terms, broad, strict=True) if not many), *self._broad]

    @cached_property
    def _blocks(self) -> tuple[IntArray, IntArray, FloatArray, BoolArray]:
        """Terms of few coefficients: columns' numbers (n,), ends (c + 1,), deviations (s, n), positive (n,)."""
        few = self.terms[: len(self.terms) - len(self._broad)]
        priors = [self._evidence.priors_of((term,)) for term in few]
        sizes = [sum(len(prior.columns) for prior in of_term) for of_term in priors]
        if not priors:
            return (
                np.zeros(0, dtype=int),
                np.zeros(1, dtype=int),
                np.zeros((len(PRIOR_SCALES), 0)),
                np.zeros(0, dtype=bool),
            )
        scale = [
            np.concatenate([of_term[0].at(prior_scale), *(prior.size for prior in of_term[1:])])
            for of_term in priors
            for prior_scale in PRIOR_SCALES
        ]
        rows = [np.concatenate(scale[k :: len(PRIOR_SCALES)]) for k in range(len(PRIOR_SCALES))]
        numbers, positive = (
            np.concatenate([getattr(prior, name) for of_term in priors for prior in of_term])
            for name in ("columns", "positive")
        )
        return numbers, np.cumsum([0, *sizes]), np.array(rows), positive

    @cached_property
    def log_scales(self) -> FloatArray:
        """Log priors (c, s) of PRIOR_SCALES of each term."""
        return np.array([self._evidence.log_scales((term,)) for term in self.terms]).reshape(-1, len(PRIOR_SCALES))

    def gains(self, terms: Sequence[EffectTerm], prior_scales: Sequence[float] | FloatArray, level: int) -> FloatArray:
        """Log evidence (c, s) that each of `self.terms` adds at PRIOR_SCALES to a set at its prior scales and a level.

        -inf for terms of effects that the set has.
        """
        evidence = self._evidence
        taken = {term.effect for term in terms}
        result = np.full((len(self.terms), len(PRIOR_SCALES)), -np.inf)
        numbers, ends, scale, positive = self._blocks
        gram, moment, across = self._left(terms, prior_scales, level)
        few = log_evidence_of_blocks(gram, moment, across, numbers, ends, scale, positive)
        result[: len(few)] = few
        present = None
        for row, term in enumerate(self.terms):
            # columns of an effect that the set has are gone
            if term.effect in taken:
                result[row] = -np.inf
            elif row >= len(few):
                grids = [[prior_scale] for prior_scale in prior_scales]
                if present is None:
                    present = evidence.over_strengths(terms, grids, [level])[0][0, 0] if terms else evidence.none[level]
                result[row] = evidence.over_strengths((*terms, term), (*grids, PRIOR_SCALES), [level])[0][0] - present
        return result

    def _left(
        self, terms: Sequence[EffectTerm], prior_scales: Sequence[float] | FloatArray, level: int
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Gram matrix (K, K), moments (K,) and across (K, x): what a set leaves is the first less across across^T."""
        gram, across, moment, problem, scale = self._evidence.remaining_columns(terms, prior_scales, level)
        if problem is None or scale is None:
            return gram, moment, across
        shared = problem.of_coefficients(gram[problem.index] - across[problem.index] @ across.T)
        factor = np.linalg.cholesky(scale[:, None] * problem.gram[0] * scale + np.eye(len(scale)))
        half = solve_triangular(factor, scale[:, None] * shared, lower=True, check_finite=False)
        moment = moment - posterior_mean(problem, scale) @ shared
        return gram, moment, np.ascontiguousarray(np.concatenate([across, half.T], axis=1))
