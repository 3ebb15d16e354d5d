"""A hypothesis: a set of terms, and its evidence."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class Hypothesis:
    """A set of terms with its log evidence (levels,) and the best prior_scales (levels, terms).

    Levels at which it has not been computed have -inf.
    """

    terms: tuple
    evidence: np.ndarray
    prior_scales: np.ndarray

    @cached_property
    def effects(self):
        """Names of the effects, as a set."""
        return frozenset(term.effect for term in self.terms)

    @cached_property
    def level(self):
        """The level of the highest evidence, an index."""
        return int(self.evidence.argmax())

    def strengths_of(self, terms, level):
        """Prior scales of some of its terms at a level (an index)."""
        return [float(self.prior_scales[level][self.terms.index(term)]) for term in terms]
