"""The answer in one line: which effects, how sure, which leg, and what could be mistaken for it."""

from dataclasses import dataclass

from rrru.gap.terms import per_leg

# a rival that is this many times less probable than the verdict is no longer named
_RIVAL = 0.05
_SURE, _HALF = 0.9, 0.5
_NOTHING = 0.2


@dataclass(frozen=True)
class Verdict:
    """effects: names in order of share, () for none; unexplained: something is left that no effect explains;
    probability of both together; leg: 1 to 3 where one leg alone is at fault, else 0; rivals: other answers that the
    data leave open, each (names, probability).
    """

    effects: tuple
    unexplained: bool
    probability: float
    leg: int
    rivals: tuple

    @property
    def label(self):
        """The answer as the table gives it."""
        return label(self.effects, self.unexplained)

    @property
    def confusable_with(self):
        """Effects outside the verdict that appear in a rival, most probable first; "unexplained" and "none" count as
        such.
        """
        names = []
        for effects, unexplained, _ in self.rivals:
            others = [name for name in sorted(effects) if name not in self.effects]
            if unexplained and not self.unexplained:
                others.append("unexplained")
            if not effects and not unexplained:
                others.append("none")
            names.extend(name for name in others if name not in names)
        return tuple(names)


def label(effects, unexplained):
    """Names joined by +, with "unexplained" last; "none" for nothing."""
    return "+".join((*effects, *(("unexplained",) if unexplained else ()))) or "none"


def decide(attribution, shares):
    """Verdict of an attribution; shares: effect to the share of the gap that it explains, for the order.

    Nothing is named as long as "none" has a probability of 0.2: a false alarm costs more than a gap too small to
    matter.

    Beside something unexplained effects are named only where they act with a probability of 0.9 each and explain half
    of the gap together; else they are what could be mistaken for a part of it.
    """
    beliefs = attribution.posterior
    sets = beliefs.sets()
    unknown = sum(p for (_, flag), p in sets.items() if flag)
    known = {key: p for key, p in sets.items() if not key[1]}
    best = max(known, key=known.get) if known else (frozenset(), False)
    nothing = known.get((frozenset(), False), 0.0)
    if nothing > _NOTHING:
        best, unknown = (frozenset(), False), 0.0
    if unknown > known.get(best, 0.0):
        within = {key: p for key, p in sets.items() if key[1]}
        everywhere = {name for effects, _ in within for name in effects}
        sure = frozenset(
            n for n in everywhere if sum(p for (effects, _), p in within.items() if n in effects) > _SURE * unknown
        )
        named = sure if sum(shares.get(name, 0.0) for name in sure) >= _HALF else frozenset()
        effects, probability = named, sum(p for (names, _), p in within.items() if named <= names)
        # what imitates a part of the unknown, and what would do without it
        rivals = {(names, True): p for (names, _), p in within.items() if names != named} | known
    else:
        effects, probability = best[0], known[best]
        rivals = {key: p for key, p in known.items() if key != best}
        rivals[frozenset(), True] = sum(p for (_, flag), p in sets.items() if flag)
    named = tuple(sorted(effects, key=lambda name: (-shares.get(name, 0.0), name)))
    rivals = tuple(
        (names, flag, p)
        for (names, flag), p in sorted(rivals.items(), key=lambda r: (-r[1], sorted(r[0][0])))
        if p > _RIVAL * probability
    )
    return Verdict(
        named,
        unknown > known.get(best, 0.0),
        float(min(probability, 1.0)),
        _leg(beliefs, effects, attribution.case.library),
        rivals,
    )


def _leg(beliefs, effects, library):
    """The one leg that all effects with legs of their own name, 0 where there is none."""
    found = set()
    for name in effects:
        if per_leg(library[name]):
            legs = beliefs.legs(name)
            best = max(legs, key=legs.get)
            found.add(best if isinstance(best, int) else 0)
    return found.pop() if len(found) == 1 else 0
