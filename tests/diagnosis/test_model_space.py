"""The search over sets of effects against the sum over all sets there are."""

from itertools import combinations, product

import numpy as np
import pytest

from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.discrepancy_basis import UNKNOWN
from rrru.diagnosis.hypothesis import Hypothesis
from rrru.diagnosis.marginal_problem import PRIOR_SCALES
from rrru.diagnosis.model_space import Candidates, ModelSpace, explore
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.posterior import Posterior, Weigher
from rrru.diagnosis.settings import Prior
from rrru.diagnosis.terms import EffectTerm, on_neighbouring_legs, variants
from rrru.diagnosis.whitened import DISCREPANCY_SCALES
from rrru.effects.library import find
from rrru.robots.rrru3 import Rrru3
from tests.diagnosis.campaigns import EFFECTS, active, measure, problem_of, strong
from tests.diagnosis.every_term import every_term

# assembly errors that stand in for each other, and some that do not
FEW = ("axis_tilt", "base_placement", "joint_axis_error", "frame_misregistration", "servo_lag")


def _evidence(acting, names=FEW):
    problem = problem_of(measure(acting), {name: find(name, Rrru3()) for name in names})
    library = {name: effect for name, effect in problem.library.items() if name not in UNKNOWN}
    evidence = problem.evidence(problem.linearise(calibrate(problem)))
    return evidence, library


def _of_all_sets(evidence, library):
    """Posterior of every set of up to four terms, each evaluated at all levels."""
    weigher, found = Weigher(evidence, Prior()), []
    choices = {name: every_term(effect) for name, effect in library.items()}
    for size in range(5):
        for names in combinations(library, size):
            for terms in product(*(choices[name] for name in names)):
                values, best = evidence.none.copy(), np.ones((len(DISCREPANCY_SCALES), size))
                for level in evidence.levels if terms else ():
                    values[level], best[level] = evidence.over_all_strengths(terms, level)
                found.append(weigher.weighed(Hypothesis(terms, values, best)))
    return Posterior.of(found)


@pytest.mark.parametrize(
    "acting",
    [(), (strong("axis_tilt", 1.0),), (strong("base_placement", 0.7), strong("servo_lag", 0.7))],
    ids=["nothing", "one", "two"],
)
def test_probabilities_are_those_of_a_sum_over_all_sets(acting):
    evidence, library = _evidence(acting, FEW[:3] + FEW[4:])
    # the evidence has the unknown functions too, which the sum over everything leaves out
    found = explore(evidence, Prior(), without=tuple(UNKNOWN))
    expected = _of_all_sets(evidence, library)
    for name in library:
        assert found.marginal(name) == pytest.approx(expected.marginal(name), abs=0.02)
    assert found.sets.get((frozenset(), False), 0.0) == pytest.approx(
        expected.sets.get((frozenset(), False), 0.0), abs=0.02
    )
    assert found.apart < 0.02 and found.expanded > 0.8


def test_all_choices_of_legs_are_neighbours_and_their_priors_sum_to_one():
    evidence, library = _evidence((), ("backlash", "servo_lag", "base_placement"))
    weigher = Weigher(evidence, Prior())
    for effect in library.values():
        every = {*every_term(effect)}
        of_legs = np.exp([weigher.terms((term,)) for term in every]).sum()
        alone = np.exp(Prior().log_set(1, len(library)))
        assert of_legs == pytest.approx(alone)
        reached = {term for term in variants(effect) if term.legs == "each"}
        for _ in range(4):
            reached |= {near for term in reached for near in on_neighbouring_legs(effect, term)}
        assert reached == {term for term in every if term.legs != "same"}


@pytest.mark.parametrize("legs", [(2,), (1, 3)])
def test_an_effect_on_some_of_the_legs_is_found_there(legs):
    acting = active("backlash", [8e-4 * (leg in legs) for leg in (1, 2, 3)])
    evidence, _ = _evidence((acting,), ("backlash", "friction_windup", "encoder_eccentricity"))
    found = explore(evidence, Prior())
    assert found.marginal("backlash") > 0.95 > 0.05 > found.marginal("friction_windup")
    best = max(found.legs("backlash").items(), key=lambda one: one[1])[0]
    assert best == (legs if len(legs) > 1 else legs[0])


def test_the_answer_does_not_depend_on_where_the_search_begins():
    evidence, _ = _evidence(
        (strong("axis_tilt", 2.0), strong("servo_lag", 1.0), strong("backlash", 0.5)), tuple(EFFECTS)
    )
    each = [ModelSpace(evidence, Prior()) for _ in range(2)]
    starts = (), each[1].fullest()
    one, other = (space.posterior([space.search(start)]) for space, start in zip(each, starts, strict=True))
    assert len(starts[1]) >= 2
    for name in EFFECTS:
        assert one.marginal(name) == pytest.approx(other.marginal(name), abs=OPTIONS.max_searches_apart)


def test_a_search_that_is_cut_short_says_so(monkeypatch):
    evidence, _ = _evidence((strong("axis_tilt", 2.0), strong("servo_lag", 1.0)), tuple(EFFECTS))
    monkeypatch.setattr("rrru.diagnosis.model_space.OPTIONS", _Short())
    space = ModelSpace(evidence, Prior())
    found = space.posterior([space.search(()), space.search(space.fullest())])
    assert found.apart > OPTIONS.max_searches_apart or found.expanded < 0.5


class _Short:
    """The options, with one set whose neighbours may be looked at."""

    max_expanded_sets = 1

    def __getattr__(self, name):
        return getattr(OPTIONS, name)


@pytest.mark.parametrize("terms", [(), ("axis_tilt",), ("base_placement", "axis_tilt"), ("drive_error_function",)])
@pytest.mark.parametrize("level", [0, 3])
def test_what_a_candidate_adds_is_the_difference_of_two_evidences(terms, level):
    """At given prior scales of the set, where all coefficients may have any sign."""
    names = (*FEW, "drive_error_function")
    evidence, library = _evidence((strong("axis_tilt", 3.0),), names)
    terms, prior_scales = tuple(map(EffectTerm, terms)), [3.0, 1.0][: len(terms)]
    candidates = Candidates(evidence, [term for effect in library.values() for term in variants(effect)])
    gains = candidates.gains(terms, prior_scales, level)
    grids = [[one] for one in prior_scales]
    own = evidence.over_strengths(terms, grids, [level])[0][0, 0] if terms else evidence.none[level]
    for term, gain in zip(candidates.terms, gains, strict=True):
        if term.effect in {one.effect for one in terms}:
            assert (gain == -np.inf).all()
        elif not library[term.effect].coordinates.positive.any():
            value, _ = evidence.over_strengths((*terms, term), (*grids, PRIOR_SCALES), [level])
            np.testing.assert_allclose(gain, value[0] - own, rtol=1e-6, atol=1e-6)
