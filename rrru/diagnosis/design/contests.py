"""Pairs of answers that a further run should separate, those first that matter most for verdict and prediction."""

from dataclasses import dataclass

from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.verdict import label


@dataclass(frozen=True)
class Contest:
    """Two answers, each (hypothesis, level) as `Posterior.best_of` gives it, and both in words: "a+b / a+c".

    The data are simulated with truth, which has no fewer effects than rival: the smaller set could not make the data
    of the larger one.
    """

    separates: str
    truth: tuple
    rival: tuple


def contests_of(inference, verdict, sizes):
    """Up to `OPTIONS.max_advised_rivals` Contests of a Verdict, in the order in which they matter.

    First come the members of each group: the set with its most probable one against the set with another one instead.
    Then comes the verdict against the most probable answer with, or without, the uncertain cause of the largest part of
    the gap. Last come the nearest rivals of a verdict that is not sure. A verdict with something unexplained has those
    of groups alone: an effect outside of the library cannot be simulated. sizes: by effect the rms in mm of its part of
    the gap.
    """
    found = {}
    for pair in _pairs(inference.posterior, verdict, sizes):
        contest = _contest(*pair) if None not in pair else None
        if contest:
            found.setdefault(frozenset(hypothesis.effects for hypothesis, _ in pair), contest)
        if len(found) == OPTIONS.max_advised_rivals:
            break
    return [*found.values()]


def _pairs(posterior, verdict, sizes):
    """Pairs of answers, the favoured one first; None for one of which there is no hypothesis."""
    effects = frozenset(verdict.effects)
    for group in verdict.groups:
        first, *others = group.names
        for other in others:
            yield (
                _answer(posterior, effects, (first,), (other,)),
                _answer(posterior, effects - {first} | {other}, (other,), (first,)),
            )
    if verdict.unexplained:
        return
    if uncertain := _uncertain_cause(posterior, verdict, sizes):
        acts = uncertain in effects
        # without a cause others may explain its part: its rival is the most probable answer without it
        yield (
            _answer(posterior, effects, *(((uncertain,), ()) if acts else ((), (uncertain,)))),
            posterior.best_where(lambda names: (uncertain in names) != acts),
        )
    if verdict.sure >= OPTIONS.min_sure_probability:
        return
    rivals = [frozenset(names) for names, flag, _ in verdict.rivals if not flag and frozenset(names) != effects]
    if not rivals:
        rivals = [names for names, flag in posterior.sets() if not flag and names != effects]
    for names in rivals:
        yield posterior.best_of(effects), posterior.best_of(names)


def _answer(posterior, effects, within, without):
    """The answer of exactly these effects, else the most probable one with all of `within` and none of `without`."""
    found = posterior.best_of(effects)
    return found or posterior.best_where(lambda names: names.issuperset(within) and names.isdisjoint(without))


def _uncertain_cause(posterior, verdict, sizes):
    """The cause outside of groups, named or possible, that may act or not and makes most of the gap; "" for none."""
    grouped = {name for group in verdict.groups for name in group.names}
    causes = (*verdict.effects, *(name for name in verdict.possible if name not in ("none", "unexplained")))
    low = OPTIONS.min_possible_probability
    uncertain = {name: posterior.marginal(name) for name in dict.fromkeys(causes) if name not in grouped}
    uncertain = {name: p for name, p in uncertain.items() if low < p < 1.0 - low}
    return max(uncertain, key=lambda name: (sizes.get(name, 0.0), uncertain[name], name), default="")


def _contest(favoured, other):
    """The Contest of two answers, None where they are of the same effects."""
    names = [label(sorted(hypothesis.effects), False) for hypothesis, _ in (favoured, other)]
    if names[0] == names[1]:
        return None
    # a rival may be possible only together with a small discrepancy
    larger = len(favoured[0].terms) >= len(other[0].terms)
    return Contest(" / ".join(names), *((favoured, other) if larger else (other, favoured)))
