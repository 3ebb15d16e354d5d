"""Answers that a further run should tell apart, each with its probability."""

from collections.abc import Iterator
from dataclasses import dataclass

from rrru.diagnosis.hypothesis import Answer
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.posterior import Posterior
from rrru.diagnosis.verdict import Verdict, label


@dataclass(frozen=True)
class RivalAnswer:
    """A set of effects in words "a+b", the answer of `Posterior.best_of`, and the set's probability."""

    words: str
    answer: Answer
    probability: float


def rival_answers(posterior: Posterior, verdict: Verdict) -> list[RivalAnswer]:
    """Up to `OPTIONS.max_rival_answers` of different sets, the most probable first; none where the verdict is sure.

    A verdict with something unexplained has those that differ by members of a group alone: an effect outside of the
    library cannot be simulated.
    """
    if not (verdict.groups or _is_open(posterior, verdict)):
        return []
    found: dict[str, RivalAnswer] = {}
    for names, probability in _sets(posterior, verdict):
        if answer := posterior.best_of(names):
            words = label(sorted(names), False)
            found.setdefault(words, RivalAnswer(words, answer, probability))
    ordered = sorted(found.values(), key=lambda one: (-one.probability, one.words))[: OPTIONS.max_rival_answers]
    return ordered if len(ordered) > 1 else []


def _sets(posterior: Posterior, verdict: Verdict) -> Iterator[tuple[frozenset[str], float]]:
    """Sets of effects that may be the answer, with their probabilities."""
    if not verdict.unexplained:
        known = [(names, probability) for (names, flag), probability in posterior.sets.items() if not flag]
        probable = [one for one in known if one[1] >= OPTIONS.min_rival_answer_probability]
        # where many improbable ones make the doubt, the first of them
        yield from probable if len(probable) > 1 else known
        return
    effects = frozenset(verdict.effects)
    for group in verdict.groups:
        for name in group.names:
            yield effects - {group.names[0]} | {name}, posterior.marginal(name)


def _is_open(posterior: Posterior, verdict: Verdict) -> bool:
    """Whether a single cause, named or possible, may act or not, where nothing is unexplained."""
    if verdict.unexplained:
        return False
    causes = {*verdict.effects, *verdict.possible} - {"none", "unexplained"}
    low = OPTIONS.min_possible_probability
    uncertain = any(low < posterior.marginal(name) < 1.0 - low for name in causes)
    return uncertain or verdict.sure < OPTIONS.min_sure_probability


def apart(separates: str) -> tuple[set[str], set[str]]:
    """The effects, as two sets, that one of two answers "a+b / a+c" has and the other has not."""
    first, second = (set(side.split("+")) - {"none"} for side in separates.split(" / "))
    return first - second, second - first
