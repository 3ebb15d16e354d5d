"""The search over sets of effects: which hypotheses carry the posterior probability."""

from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from rrru.gap.evidence import LEVELS, STRENGTHS, averaged
from rrru.gap.terms import variants
from rrru.gap.unknown import UNKNOWN

# hypotheses this far below the best in log evidence are not worth refining
_WORTH = 12.0
_HOPELESS = 30.0
_BEST_SETS = 4


@dataclass(frozen=True)
class Hypothesis:
    """A set of terms with its log evidence (levels,) and the best strengths (terms,) at each level (levels, terms)."""

    terms: tuple
    evidence: np.ndarray
    strengths: np.ndarray

    @property
    def effects(self):
        """Names of the effects, as a set."""
        return frozenset(term.effect for term in self.terms)


def search(evidence, most=3):
    """Hypotheses worth knowing: none, every single term, and sets of up to `most` effects around the best ones."""
    library = evidence.library
    found, best = {}, [(0, -np.inf)]

    def score(terms, strengths=None, levels=None):
        key = frozenset(terms)
        if key not in found:
            found[key] = _score(evidence, terms, strengths, levels, best[0])
            if found[key].evidence.max() > best[0][1]:
                best[0] = int(found[key].evidence.argmax()), found[key].evidence.max()
        return found[key]

    score(())
    choices = {name: variants(effect) for name, effect in library.items()}
    for name in library:
        for term in choices[name]:
            score((term,))
    layer = _best(found, 1)
    for size in range(2, min(most, len(library)) + 1):
        near = _levels(found)
        if size == 2:
            for first, second in combinations([name for name in library if name not in UNKNOWN], 2):
                score((choices[first][0], choices[second][0]), levels=near)
        for start in layer:
            for name in library:
                if name not in start.effects and not (name in UNKNOWN and start.effects & set(UNKNOWN)):
                    for term in choices[name]:
                        score((*start.terms, term), _narrow(start, near), near)
        if size == 2:
            for hypothesis in _best(found, size):
                others = [[t for t in choices[term.effect] if t.shape == term.shape] for term in hypothesis.terms]
                for terms in product(*others):
                    score(terms, levels=near)
        layer = _best(found, size)
        lower = max(h.evidence.max() for h in found.values() if len(h.terms) < size)
        if not layer or layer[0].evidence.max() < lower - _WORTH:
            break
    return list(found.values())


def _score(evidence, terms, strengths, levels, leader):
    """The hypothesis of a set of terms at the chosen levels, -inf at the others.

    leader: level and evidence of the best hypothesis so far. A larger set is tried at that level first; where it is
    hopeless there, the other levels are left out.
    """
    full = np.full(len(LEVELS), -np.inf)
    best = np.ones((len(LEVELS), len(terms)))
    if not terms:
        return Hypothesis((), evidence.none.copy(), best)
    if len(terms) > 1:
        probe = leader[0]
        coarse = tuple(
            grid[1::2] if len(grid) == len(STRENGTHS) else grid for grid in strengths or (STRENGTHS,) * len(terms)
        )
        value, grid = evidence.over_strengths(terms, coarse, [probe])
        full[probe] = averaged(value, len(terms))[0]
        best[probe] = grid[value[0].argmax()]
        if full[probe] < leader[1] - _HOPELESS:
            return Hypothesis(tuple(terms), full, best)
    levels = np.arange(len(LEVELS)) if levels is None else levels
    value, grid = evidence.over_strengths(terms, strengths, levels)
    full[levels] = averaged(value, len(terms))
    best[levels] = grid[value.argmax(axis=1)]
    return Hypothesis(tuple(terms), full, best)


def _levels(found):
    """Indices of the discrepancy levels next to the best hypothesis' own, and none at all."""
    best = max(found.values(), key=lambda h: h.evidence.max()).evidence.argmax()
    return np.unique([0, 1, *(np.clip([best - 1, best, best + 1], 0, len(LEVELS) - 1))])


def _narrow(start, levels):
    """Strength grids for a set that grows from another: around that one's best, and all for the newcomer."""
    level = levels[np.argmax(start.evidence[levels])]
    near = [STRENGTHS[np.abs(np.log(STRENGTHS / s)) < 1.3] for s in start.strengths[level]]
    return (*near, STRENGTHS)


def _best(found, size):
    """The best hypotheses of a size, one per set of effects, best first, within a distance of the best of them."""
    per_effects = {}
    for hypothesis in found.values():
        if len(hypothesis.terms) == size:
            other = per_effects.get(hypothesis.effects)
            if other is None or hypothesis.evidence.max() > other.evidence.max():
                per_effects[hypothesis.effects] = hypothesis
    return sorted(per_effects.values(), key=lambda h: -h.evidence.max())[:_BEST_SETS]
