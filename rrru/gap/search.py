"""The search over sets of effects: which hypotheses carry the posterior probability.

Sets of up to three effects are averaged over all combinations of their strengths. Larger ones grow from the best by one
term at a time, and then each of their terms is taken out and another one tried in its place; their average is that of
strengths that are independent of each other.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, product

import numpy as np

from rrru.gap.evidence import STRENGTHS, averaged
from rrru.gap.options import OPTIONS
from rrru.gap.terms import variants
from rrru.gap.unknown import UNKNOWN
from rrru.gap.whitened import LEVELS


@dataclass(frozen=True)
class Hypothesis:
    """A set of terms with its log evidence (levels,) and the best strengths (terms,) at each level (levels, terms)."""

    terms: tuple
    evidence: np.ndarray
    strengths: np.ndarray

    @cached_property
    def effects(self):
        """Names of the effects, as a set."""
        return frozenset(term.effect for term in self.terms)

    def strengths_of(self, terms, level):
        """Strengths of some of its terms at a level (an index)."""
        return [float(self.strengths[level][self.terms.index(term)]) for term in terms]


def search(evidence, most=OPTIONS.max_effects, without=()):
    """Hypotheses worth knowing: none, every single term, and sets of up to `most` effects around the best ones.

    without: names of effects that are ruled out.
    """
    library = {name: effect for name, effect in evidence.library.items() if name not in without}
    choices = {name: variants(effect) for name, effect in library.items()}
    tried = _Tried(evidence)
    for terms in ((), *((term,) for name in library for term in choices[name])):
        tried.add(terms)
    layer = tried.best_of_size(1)
    for size in range(2, min(OPTIONS.max_jointly_averaged_effects, most, len(library)) + 1):
        near = tried.near_levels()
        if size == 2:
            for first, second in combinations([name for name in library if name not in UNKNOWN], 2):
                tried.add((choices[first][0], choices[second][0]), levels=near)
        for start in layer:
            grids = _narrow(start, near)
            for name in library:
                if name not in start.effects:
                    for term in choices[name]:
                        tried.add((*start.terms, term), grids, near)
        if size == 2:
            for hypothesis in tried.best_of_size(size):
                others = [[t for t in choices[term.effect] if t.shape == term.shape] for term in hypothesis.terms]
                for terms in product(*others):
                    tried.add(terms, levels=near)
        layer = tried.best_of_size(size)
        smaller = max(h.evidence.max() for h in tried.hypotheses.values() if len(h.terms) < size)
        if not layer or layer[0].evidence.max() < smaller - OPTIONS.max_loss_of_larger_sets_nats:
            break
    else:
        _grow(tried, choices, layer, min(most, len(library)))
    return list(tried.hypotheses.values())


def _grow(tried, choices, layer, most):
    """Try sets of more effects as long as they gain, and the best one with each of its effects out or replaced."""
    for size in range(OPTIONS.max_jointly_averaged_effects + 1, most + 1):
        best = tried.best
        layer = tried.grown(layer, choices, size)
        if not layer or layer[0].evidence.max() < best.evidence.max():
            break
    for _ in range(OPTIONS.max_replacement_rounds):
        start = tried.best
        if len(start.terms) < OPTIONS.max_jointly_averaged_effects:
            break
        fewer = [tried.polished(tuple(t for t in start.terms if t != term)) for term in start.terms]
        tried.grown(fewer, choices, len(start.terms))
        if tried.best is start:
            break


class _Tried:
    """Hypotheses tried so far, by their terms as a set."""

    def __init__(self, evidence):
        self.evidence, self.hypotheses = evidence, {}
        self._leader = 0, -np.inf

    def add(self, terms, strengths=None, levels=None):
        """Try a set of terms with strength grids at some levels (indices), by default all, unless it has been tried."""
        key = frozenset(terms)
        if key not in self.hypotheses:
            self.hypotheses[key] = hypothesis = self._hypothesis(tuple(terms), strengths, levels)
            if hypothesis.evidence.max() > self._leader[1]:
                self._leader = int(hypothesis.evidence.argmax()), hypothesis.evidence.max()

    def _hypothesis(self, terms, strengths, levels):
        """The hypothesis of a set of terms at the chosen levels, -inf at the others.

        A larger set is tried at the best hypothesis' level first; where it is hopeless there, the others are left out.
        """
        full, best = np.full(len(LEVELS), -np.inf), np.ones((len(LEVELS), len(terms)))
        if not terms:
            return Hypothesis((), self.evidence.none.copy(), best)
        if len(terms) > 1:
            level, highest = self._leader
            grids = strengths or (STRENGTHS,) * len(terms)
            coarse = tuple(grid[1::2] if len(grid) == len(STRENGTHS) else grid for grid in grids)
            value, grid = self.evidence.over_strengths(terms, coarse, [level])
            full[level] = averaged(value, len(terms))[0]
            best[level] = grid[value[0].argmax()]
            if full[level] < highest - OPTIONS.max_loss_at_best_level_nats:
                return Hypothesis(terms, full, best)
        levels = self.evidence.levels if levels is None else levels
        value, grid = self.evidence.over_strengths(terms, strengths, levels)
        full[levels] = averaged(value, len(terms))
        best[levels] = grid[value.argmax(axis=1)]
        return Hypothesis(terms, full, best)

    def grown(self, layer, choices, size):
        """The best hypotheses of a size after those of a layer have been tried with every term more."""
        near, gains = self.near_levels(), []
        for start in layer:
            others = [term for name, terms in choices.items() if name not in start.effects for term in terms]
            gains += self._gains(start, others)
        gains.sort(key=lambda pair: -pair[0])
        for _, terms in gains[: OPTIONS.max_evaluated_sets_per_size]:
            self.polished(terms, near)
        return self.best_of_size(size)

    def _gains(self, start, others):
        """Log evidence of a hypothesis with each of other terms at its best level and strengths, and their sets."""
        level = int(start.evidence.argmax())
        grids = [[strength] for strength in start.strengths[level]]
        own, _ = self.evidence.over_strengths(start.terms, grids, [level])
        gains = []
        for term in others:
            value, _ = self.evidence.over_strengths((*start.terms, term), (*grids, STRENGTHS), [level])
            gains.append((float(start.evidence[level] - own[0, 0] + averaged(value, 1)[0]), (*start.terms, term)))
        return gains

    def polished(self, terms, levels=None):
        """The hypothesis of a set of terms, tried if it has not been, by strengths that are independent."""
        key = frozenset(terms)
        if key not in self.hypotheses:
            full, best = np.full(len(LEVELS), -np.inf), np.ones((len(LEVELS), len(terms)))
            levels = self.near_levels() if levels is None else levels
            full[levels], best[levels] = self.evidence.independent(terms, levels)
            self.hypotheses[key] = Hypothesis(tuple(terms), full, best)
        return self.hypotheses[key]

    @property
    def best(self):
        """The hypothesis of the highest evidence."""
        return max(self.hypotheses.values(), key=lambda h: h.evidence.max())

    def near_levels(self):
        """Indices of the discrepancy levels next to the best hypothesis' own, and none at all."""
        best = self.best.evidence.argmax()
        return np.intersect1d([0, 1, best - 1, best, best + 1], self.evidence.levels)

    def best_of_size(self, size):
        """The best hypotheses of a size, one per set of effects, best first."""
        per_effects = {}
        for hypothesis in self.hypotheses.values():
            if len(hypothesis.terms) == size:
                other = per_effects.get(hypothesis.effects)
                if other is None or hypothesis.evidence.max() > other.evidence.max():
                    per_effects[hypothesis.effects] = hypothesis
        return sorted(per_effects.values(), key=lambda h: -h.evidence.max())[: OPTIONS.max_sets_per_size]


def _narrow(start, levels):
    """Strength grids for a set that grows from another: around that one's best, and all for the newcomer."""
    level = levels[np.argmax(start.evidence[levels])]
    near = [STRENGTHS[np.abs(np.log(STRENGTHS / s)) < OPTIONS.max_log_scale_distance] for s in start.strengths[level]]
    return (*near, STRENGTHS)
