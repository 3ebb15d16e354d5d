"""A hypothesis: a set of terms, and its evidence."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

from rrru.arrays import FloatArray
from rrru.diagnosis.terms import EffectTerm


@dataclass(frozen=True)
class Hypothesis:
    """A set of terms with its log evidence (levels,) and the best prior_scales (levels, terms).

    Levels at which it has not been computed have -inf.
    """

    terms: tuple[EffectTerm, ...]
    evidence: FloatArray
    prior_scales: FloatArray

    @cached_property
    def effects(self) -> frozenset[str]:
        """Names of the effects, as a set."""
        return frozenset(term.effect for term in self.terms)

    @cached_property
    def level(self) -> int:
        """The level of the highest evidence, an index."""
        return int(self.evidence.argmax())

    def strengths_of(self, terms: Sequence[EffectTerm], level: int) -> list[float]:
        """Prior scales of some of its terms at a level (an index)."""
        return [float(self.prior_scales[level][self.terms.index(term)]) for term in terms]


# a hypothesis and its discrepancy level (an index)
Answer: TypeAlias = tuple[Hypothesis, int]
