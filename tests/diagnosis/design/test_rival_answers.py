"""Between which answers a run should decide: all that are probable, beside something unexplained those of groups."""

import numpy as np

from rrru.diagnosis.design.rival_answers import rival_answers
from rrru.diagnosis.hypothesis import Hypothesis
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.posterior import Posterior
from rrru.diagnosis.terms import EffectTerm
from rrru.diagnosis.verdict import Group, Verdict


def _answers(sets, **verdict):
    """Words and probabilities of the rival answers of a posterior of sets of effects."""
    hypotheses = tuple(
        Hypothesis(tuple(map(EffectTerm, names)), np.zeros(1), np.ones((1, len(names)))) for names in sets
    )
    weights = np.log([[p] for p in sets.values()])
    posterior = Posterior(hypotheses, weights, np.zeros(weights.shape, dtype=bool))
    defaults = {"effects": (), "unexplained": False, "probability": 0.5, "leg": 0, "possible": (), "rivals": ()}
    found = rival_answers(posterior, Verdict(**(defaults | verdict)))
    assert all(one.answer[0].effects == frozenset(one.words.split("+")) - {"none"} for one in found)
    return {one.words: round(one.probability, 6) for one in found}


def test_all_probable_sets_are_rivals_the_most_probable_first():
    sets = {("a",): 0.3, ("a", "b"): 0.5, (): 0.15, ("c",): 0.045, ("d",): 0.005}
    assert list(_answers(sets, effects=("a", "b")).items()) == [("a+b", 0.5), ("a", 0.3), ("none", 0.15), ("c", 0.045)]
    many = {(name,): 0.1 for name in "abcdefghij"}
    assert len(_answers(many, effects=("a",))) == OPTIONS.max_rival_answers


def test_of_many_improbable_sets_the_first_are_rivals():
    sets = {(): 0.82} | {(f"e{k}",): 0.018 for k in range(10)}
    found = _answers(sets)
    assert len(found) == OPTIONS.max_rival_answers and next(iter(found)) == "none"


def test_with_something_unexplained_the_members_of_groups_alone_are_rivals():
    sets = {("a", "b"): 0.5, ("a", "c"): 0.4, ("a",): 0.1}
    group = Group(("b", "c"), 0.9)
    assert _answers(sets, effects=("a", "b"), unexplained=True, groups=(group,)) == {"a+b": 0.5, "a+c": 0.4}
    assert _answers(sets, effects=("a",), unexplained=True, possible=("b",)) == {}


def test_nothing_is_asked_where_all_is_certain():
    sets = {("a",): 0.97, (): 0.03}
    assert _answers(sets, effects=("a",), sure=0.99) == {}
    assert _answers(sets, effects=("a",), sure=0.85) == {"a": 0.97, "none": 0.03}
    # an uncertain cause that is possible only
    assert len(_answers({("a",): 0.9, ("a", "b"): 0.1}, effects=("a",), sure=0.99, possible=("b",))) == 2
