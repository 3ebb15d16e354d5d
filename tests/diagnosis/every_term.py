"""All terms that an effect has, by enumeration."""

from itertools import combinations

import numpy as np

from rrru.diagnosis.terms import EffectTerm, may_be_on_some, variants


def every_term(effect):
    """The variants of an effect, and its terms on several of the legs and not on all."""
    legs = np.unique(effect.coordinates.legs).tolist() if may_be_on_some(effect) else []
    shapes = range(len(effect.coordinates.shapes))
    some = [chosen for count in range(2, len(legs)) for chosen in combinations(legs, count)]
    return [*variants(effect), *(EffectTerm(effect.name, shape, chosen) for shape in shapes for chosen in some)]
