"""Between which answers a run should decide: groups, the uncertain cause that matters most, then rivals."""

import numpy as np
import pytest

from rrru.diagnosis.design.expected_information import answer_pairs
from rrru.diagnosis.hypothesis import Hypothesis
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.posterior import Posterior
from rrru.diagnosis.terms import EffectTerm
from rrru.diagnosis.verdict import Group, Verdict


class _Attribution:
    """What pairs are found from: a posterior of sets of effects with probabilities."""

    def __init__(self, sets):
        hypotheses = tuple(
            Hypothesis(tuple(map(EffectTerm, names)), np.zeros(1), np.ones((1, len(names)))) for names in sets
        )
        weights = np.log([[p] for p in sets.values()])
        self.posterior = Posterior(hypotheses, weights, np.zeros(weights.shape, dtype=bool))


def _pairs_of(sets, sizes=None, **verdict):
    defaults = {"effects": (), "unexplained": False, "probability": 0.5, "leg": 0, "possible": (), "rivals": ()}
    return answer_pairs(_Attribution(sets), Verdict(**(defaults | verdict)), sizes or {})


def _names(pair):
    return [{term.effect for term in answer[0].terms} for answer in (pair.truth, pair.rival)]


def test_members_of_a_group_come_first_each_in_the_place_of_the_most_probable():
    sets = {("a", "b"): 0.4, ("a", "c"): 0.3, ("a", "d"): 0.2, ("b",): 0.1}
    found = _pairs_of(
        sets,
        effects=("a", "b"),
        groups=(Group(("b", "c", "d"), 0.99),),
        rivals=((frozenset("ac"), False, 0.3), (frozenset("b"), False, 0.1)),
    )
    assert [one.separates for one in found] == ["a+b / a+c", "a+b / a+d", "a+b / b"]
    assert len(found) == OPTIONS.max_advised_rivals


def test_a_member_whose_exact_set_was_never_weighed_stands_with_the_best_set_that_holds_it():
    sets = {("a", "b"): 0.5, ("c", "e"): 0.3, ("a",): 0.2}
    (first, *_) = _pairs_of(sets, effects=("a", "b"), groups=(Group(("b", "c"), 0.9),))
    assert first.separates == "a+b / c+e"
    assert _pairs_of({("b", "c"): 0.5, ("c", "e"): 0.5}, effects=("b",), groups=(Group(("b", "f"), 0.9),)) == []


@pytest.mark.parametrize(
    ("sizes", "first"), [({"b": 0.3, "d": 0.1}, "a+b / a+e"), ({"b": 0.1, "d": 0.3}, "a+b / a+b+d")]
)
def test_the_uncertain_cause_that_makes_most_of_the_gap_comes_before_nearer_rivals(sizes, first):
    """Without a cause that is named its rival is what is then the most probable."""
    sets = {("a", "b"): 0.5, ("a", "b", "d"): 0.15, ("a",): 0.1, ("a", "e"): 0.25}
    rivals = ((frozenset("ae"), False, 0.25), (frozenset("a"), False, 0.1))
    found = _pairs_of(sets, sizes, effects=("a", "b"), possible=("e", "d", "none"), rivals=rivals)
    assert [one.separates for one in found] == list(dict.fromkeys([first, "a+b / a+e", "a+b / a"]))


def test_the_answer_with_more_effects_makes_the_data():
    (pair,) = _pairs_of({("a",): 0.5, ("a", "b"): 0.5}, effects=("a",), possible=("b",))
    assert pair.separates == "a / a+b" and _names(pair) == [{"a", "b"}, {"a"}]


def test_with_something_unexplained_a_group_alone_is_contested():
    sets = {("a", "b"): 0.5, ("a", "c"): 0.4, ("a",): 0.1}
    found = _pairs_of(sets, effects=("a", "b"), unexplained=True, groups=(Group(("b", "c"), 0.9),), possible=("none",))
    assert [one.separates for one in found] == ["a+b / a+c"]
    assert _pairs_of(sets, effects=("a",), unexplained=True, possible=("b",)) == []


def test_nothing_is_contested_where_all_is_certain():
    assert _pairs_of({("a",): 0.99, (): 0.01}, effects=("a",), sure=0.99) == []
