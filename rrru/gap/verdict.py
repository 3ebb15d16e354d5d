"""The answer in one line: which effects, how sure, which leg, and what could be mistaken for it."""

from dataclasses import dataclass

from rrru.gap.options import OPTIONS
from rrru.gap.terms import per_leg

_NONE = (frozenset(), False)


@dataclass(frozen=True)
class Verdict:
    """effects: names in order of share, () for none; unexplained: something is left that no effect explains;
    probability of both together; leg: 1 to 3 where one leg alone is at fault, else 0; rivals: other answers that the
    data leave open, each (names, unexplained, probability); no_answer: why the fit allows none, else empty.
    """

    effects: tuple
    unexplained: bool
    probability: float
    leg: int
    rivals: tuple
    no_answer: str = ""

    @property
    def label(self):
        """The answer as the table gives it."""
        return label(self.effects, self.unexplained)

    @property
    def confusable_with(self):
        """Effects, "unexplained" and "none" in a rival but not in the verdict, most probable first."""
        names = []
        for effects, unexplained, _ in self.rivals:
            others = [name for name in sorted(effects) if name not in self.effects]
            if unexplained and not self.unexplained:
                others.append("unexplained")
            if not effects and not unexplained:
                others.append("none")
            names.extend(name for name in others if name not in names)
        return tuple(names)


def without_answer(why):
    """The Verdict on a fit that describes its readings too badly for any answer, see `rrru.gap.validity`."""
    return Verdict((), True, 1.0, 0, (), why)


def label(effects, unexplained):
    """Names joined by +, with "unexplained" last; "none" for nothing."""
    return "+".join((*effects, *(("unexplained",) if unexplained else ()))) or "none"


def decide(attribution, shares):
    """Verdict of an attribution; shares: effect to the share of the gap that it explains, for the order.

    Nothing is named as long as "none" has a probability of 0.2: a false alarm costs more than a gap too small to
    matter. Beside something unexplained effects are named only where they act with a probability of 0.9 each and
    explain half of the gap together, a law of many coefficients by itself; else they are what could be mistaken for a
    part of it.
    """
    beliefs = attribution.posterior
    unknown, sets = beliefs.probability_unexplained, beliefs.sets()
    known = {key: p for key, p in sets.items() if not key[1]}
    best = max(known, key=known.get, default=_NONE)
    if known.get(_NONE, 0.0) > OPTIONS.max_none_probability:
        best = _NONE
    unexplained = known.get(_NONE, 0.0) <= OPTIONS.max_none_probability and unknown > known.get(best, 0.0)
    if unexplained:
        library = attribution.case.library
        broad = {name for name in shares if name in library and library[name].coordinates.broad}
        effects, probability, rivals = _beside_unexplained(sets, unknown, shares, broad)
    else:
        effects, probability = best[0], known[best]
        rivals = {key: p for key, p in known.items() if key != best} | {(frozenset(), True): unknown}
    ordered = sorted(rivals.items(), key=lambda rival: (-rival[1], sorted(rival[0][0])))
    return Verdict(
        tuple(sorted(effects, key=lambda name: (-shares.get(name, 0.0), name))),
        unexplained,
        float(min(probability, 1.0)),
        _leg(beliefs, effects, attribution.case.library),
        tuple((*key, p) for key, p in ordered if p > OPTIONS.min_rival_probability_ratio * probability),
    )


def _beside_unexplained(sets, unknown, shares, broad):
    """Effects to name beside something unexplained, the probability of that, rivals' by (names, unexplained).

    broad: names of laws of many coefficients.
    """
    within = {effects: p for (effects, flag), p in sets.items() if flag}
    # a law of many coefficients takes a part of whatever acts: it has to explain that much by itself
    named = frozenset(
        name
        for name in _certain(within, unknown)
        if name not in broad or shares.get(name, 0.0) >= OPTIONS.min_share_with_unexplained
    )
    if sum(shares.get(name, 0.0) for name in named) < OPTIONS.min_share_with_unexplained:
        named = frozenset()
    # what imitates a part of the unknown, and what would do without it
    rivals = {(effects, True): p for effects, p in within.items() if effects != named}
    rivals |= {key: p for key, p in sets.items() if not key[1]}
    return named, sum(p for effects, p in within.items() if named <= effects), rivals


def certain_beside_unexplained(beliefs):
    """Effects, as a set, that act with a probability of 0.9 each if something acts that no effect explains."""
    within = {effects: p for (effects, flag), p in beliefs.sets().items() if flag}
    return _certain(within, beliefs.probability_unexplained)


def _certain(within, unknown):
    """Effects that make up 0.9 of the probability of something unexplained, from that of sets with it."""
    acting = {name: sum(p for effects, p in within.items() if name in effects) for name in frozenset().union(*within)}
    return frozenset(name for name, p in acting.items() if p > OPTIONS.min_probability_given_unexplained * unknown)


def _leg(beliefs, effects, library):
    """The one leg that all effects with legs of their own name, 0 where there is none."""
    likely = [beliefs.legs(name) for name in effects if per_leg(library[name])]
    best = {max(legs, key=legs.get) for legs in likely}
    leg = best.pop() if len(best) == 1 else 0
    return leg if isinstance(leg, int) else 0
