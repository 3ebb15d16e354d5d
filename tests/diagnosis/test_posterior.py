"""Terms, priors and probabilities on made-up evidence; the verdict on made-up posteriors."""

from itertools import combinations
from math import comb
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats
from scipy.special import logsumexp

from rrru.diagnosis.discrepancy_basis import UNKNOWN
from rrru.diagnosis.hypothesis import Hypothesis
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.posterior import Posterior, Weigher
from rrru.diagnosis.settings import GapSettings, Prior
from rrru.diagnosis.terms import EACH, SAME, EffectTerm, per_leg, spread, variants
from rrru.diagnosis.verdict import decide, label
from rrru.diagnosis.whitened import DISCREPANCY_SCALES
from rrru.estimation.noise_model import NoiseModel
from rrru.robots.catalogue import make_mechanism
from rrru.robots.rrru3 import Rrru3
from tests.diagnosis.campaigns import EFFECTS, NOISE_MM
from tests.diagnosis.every_term import every_term
from tests.places import ROOT

_OF_ALL = {"frame_misregistration", "thermal_growth", "joint_axis_error", "base_drift", "pedestal_compliance"}
WITH_LEGS = EFFECTS.keys() - _OF_ALL


def _stub(explained=0.0, library=EFFECTS):
    """Evidence with the part that a hypothesis explains, in units of the noise."""
    return SimpleNamespace(
        library=library,
        explained=lambda h, effects: explained if h.effects & set(effects) else 0.0,
        noise=NoiseModel.white(NOISE_MM),
    )


def posterior(evidence, hypotheses, prior):
    """Posterior of hypotheses."""
    weigher = Weigher(evidence, prior)
    return Posterior.of([weigher.weighed(one) for one in hypotheses])


def _arm():
    """The library of an arm of six axes."""
    return GapSettings().library(make_mechanism("arm", {"urdf": str(ROOT / "data/models/arm6.urdf")}))


def _three_of_an_arm():
    """Three effects, each on 63 choices of legs."""
    library = _arm()
    return {name: library[name] for name in ("backlash", "drive_compliance", "encoder_eccentricity")}


def _hypothesis(*terms, evidence=0.0):
    value = np.broadcast_to(np.asarray(evidence, dtype=float), len(DISCREPANCY_SCALES)).copy()
    return Hypothesis(tuple(terms), value, np.ones((len(DISCREPANCY_SCALES), len(terms))))


def _all(size, library=EFFECTS):
    """Every hypothesis of no, one or two effects."""
    single = [term for effect in library.values() for term in every_term(effect)]
    if size < 2:
        return [()] if size == 0 else [(term,) for term in single]
    return [(a, b) for k, a in enumerate(single) for b in single[k + 1 :] if a.effect != b.effect]


def test_effects_with_legs_are_tried_on_each_and_positive_ones_on_all_alike():
    for name, effect in EFFECTS.items():
        assert per_leg(effect) is (name in WITH_LEGS)
        kinds = {term.legs for term in variants(effect)}
        expected = {EACH, 1, 2, 3} if name in WITH_LEGS else {EACH}
        assert kinds == expected | ({SAME} if per_leg(effect) and effect.coordinates.positive.all() else set())
        assert len(variants(effect)) == len(kinds) * len(effect.coordinates.shapes)


def test_the_joints_of_an_arm_are_not_of_one_design():
    kinds = {term.legs for effect in _arm().values() for term in variants(effect)}
    assert kinds == {EACH, 1, 2, 3, 4, 5, 6}
    assert SAME in {term.legs for effect in GapSettings().library(Rrru3()).values() for term in variants(effect)}


@pytest.mark.parametrize("name", sorted(WITH_LEGS))
def test_a_terms_numbers_spread_over_its_legs(name):
    coordinates = EFFECTS[name].coordinates
    for leg in (1, 2, 3):
        values = spread(coordinates, leg) @ np.ones(np.count_nonzero(coordinates.legs == leg))
        assert (values == (coordinates.legs == leg)).all()
    np.testing.assert_array_equal(spread(coordinates, EACH), np.eye(len(coordinates)))
    same = spread(coordinates, SAME)
    np.testing.assert_array_equal(same @ np.ones(same.shape[1]), np.ones(len(coordinates)))
    one = same @ np.eye(same.shape[1])[0]
    assert one.sum() == 3 and sorted(coordinates.legs[one > 0]) == [1, 2, 3]


@pytest.mark.parametrize(("few", "share"), [(1.0, 0.0), (0.5, 0.5), (0.0, 1.0)])
def test_the_prior_of_a_set_is_a_mixture_of_few_effects_and_of_each_by_itself(few, share):
    """Summed over all sets of a library of twelve effects it is one, and each part is what it says."""
    prior = Prior((0.3, 0.55, 0.13, 0.02), each=0.1, share=share)
    size = 12
    by_count = np.array([comb(size, count) * np.exp(prior.log_set(count, size)) for count in range(size + 1)])
    counts = np.array([0.3, 0.55, 0.13, *(0.02 * (2 / 13) ** k for k in range(size - 2))])
    binomial = stats.binom.pmf(np.arange(size + 1), size, 0.1)
    np.testing.assert_allclose(by_count, few * counts + share * binomial, rtol=1e-9)


@pytest.mark.parametrize("arm", [False, True])
def test_without_data_the_probabilities_are_the_prior(arm):
    """All hypotheses of up to two effects alike: counts and the unexplained share come back, alike for all effects and
    pairs, however many legs there are.
    """
    prior, library = Prior((0.3, 0.5, 0.2, 0.0001), 0.1, 0.1, share=0.0), _three_of_an_arm() if arm else EFFECTS
    every = [_hypothesis(*terms) for size in range(3) for terms in _all(size, library)]
    found = posterior(_stub(1.5, library), every, prior)
    assert found.weights.sum() == pytest.approx(1.0)
    sets = found.sets
    effects = len(library)
    pairs = effects * (effects - 1) // 2
    for size, count, kinds in ((0, 0.3, 1), (1, 0.5, effects), (2, 0.2, pairs)):
        of_size = {key: p for key, p in sets.items() if len(key[0]) == size and not key[1]}
        assert len(of_size) == kinds
        np.testing.assert_allclose(list(of_size.values()), 0.9 * count / kinds, rtol=1e-9)
    assert sum(p for (_, flag), p in sets.items() if flag) == pytest.approx(0.1)
    assert list(sets.values()) == sorted(sets.values(), reverse=True)
    assert found.marginal("backlash") == pytest.approx(0.5 / effects + 0.2 * (effects - 1) / pairs)
    assert found.marginal("nothing of the kind") == 0.0


def test_the_prior_of_a_set_with_each_further_term_is_that_of_the_larger_set():
    """To the last digit; with a term too many there is no such set."""
    library = _three_of_an_arm()
    weigher, terms = Weigher(_stub(library=library), Prior()), [EffectTerm("backlash"), EffectTerm("drive_compliance")]
    unknown = [EffectTerm(name) for name in UNKNOWN]
    further = [term for effect in library.values() for term in variants(effect)] + unknown
    of_further = weigher.priors_of(further)
    for present in ((), terms[:1], (*terms, *unknown[:1])):
        found = weigher.with_each(present, of_further)
        assert found.tolist() == [weigher.terms((*present, term)) for term in further]
    every = [EffectTerm(name) for name in library]
    assert np.array_equal(np.isfinite(weigher.with_each(every, of_further)), [term in unknown for term in further])


def test_legs_have_the_prior_of_their_kinds():
    found = posterior(_stub(), [_hypothesis(*terms) for size in range(2) for terms in _all(size)], Prior())
    some = OPTIONS.prior_some_legs
    for name, kinds in (("backlash", 3), ("axis_tilt", 2)):
        legs, alike = found.legs(name), (1.0 - some) / kinds
        np.testing.assert_allclose([legs[k] for k in (EACH, SAME)[: kinds - 1]], alike)
        np.testing.assert_allclose([legs[k] for k in (1, 2, 3)], alike / 3)
        np.testing.assert_allclose([legs[k] for k in ((1, 2), (1, 3), (2, 3))], some / 3)
    assert found.legs("unknown") == {}
    assert sum(found.legs("axis_tilt").values()) == pytest.approx(1.0)


def test_evidence_multiplies_the_prior():
    generator = np.random.default_rng(0)
    hypotheses = [
        _hypothesis(*terms, evidence=generator.normal(0.0, 3.0, len(DISCREPANCY_SCALES)))
        for size in range(2)
        for terms in _all(size)
    ]
    flat = posterior(_stub(20.0), [_hypothesis(*h.terms) for h in hypotheses], Prior())
    found = posterior(_stub(20.0), hypotheses, Prior())
    log_weight = np.log(flat.weights) + np.array([h.evidence for h in hypotheses])
    np.testing.assert_allclose(found.weights, np.exp(log_weight - logsumexp(log_weight)), rtol=1e-9)
    row, level = np.unravel_index(found.weights.argmax(), found.weights.shape)
    assert found.best() == (hypotheses[row], level)


def test_a_discrepancy_counts_as_unexplained_beyond_the_tolerated_share():
    hypotheses = [_hypothesis(), _hypothesis(EffectTerm("servo_lag"))]
    found = posterior(_stub(35.0), hypotheses, Prior(tolerance=0.1))
    np.testing.assert_array_equal(found.unexplained[0], DISCREPANCY_SCALES > 0.0)
    np.testing.assert_array_equal(found.unexplained[1], DISCREPANCY_SCALES > 3.5)


def test_the_best_of_a_set_is_its_heaviest_hypothesis():
    hypotheses = [
        _hypothesis(),
        _hypothesis(EffectTerm("axis_tilt")),
        _hypothesis(EffectTerm("axis_tilt", 0, 2), evidence=5.0),
    ]
    found = posterior(_stub(1.5), hypotheses, Prior())
    assert found.best_of(frozenset({"axis_tilt"})) == (hypotheses[2], 0)
    assert found.best_of(frozenset({"axis_tilt"}), True)[1] > 0
    assert found.best_of(frozenset({"axis_tilt"}), False) == (hypotheses[2], 0)
    assert found.best_of(frozenset({"backlash"})) is None


def test_improbable_pairs_are_forgotten_and_single_effects_stay():
    far = -100.0
    hypotheses = [
        _hypothesis(),
        _hypothesis(EffectTerm("axis_tilt"), evidence=far),
        _hypothesis(EffectTerm("axis_tilt"), EffectTerm("backlash"), evidence=far),
    ]
    found = posterior(_stub(), hypotheses, Prior())
    assert [len(h.terms) for h in found.hypotheses] == [0, 1] and found.weights.sum() == pytest.approx(1.0)


def _decided(*entries):
    """Verdict of (terms, probability, unexplained) entries, each a hypothesis of its own."""
    hypotheses = tuple(_hypothesis(*terms) for terms, _, _ in entries)
    weights, unexplained = np.zeros((len(entries), 2)), np.tile([False, True], (len(entries), 1))
    for row, (_, probability, flag) in enumerate(entries):
        weights[row, int(flag)] = probability
    return decide(Posterior(hypotheses, np.log(np.maximum(weights, 1e-300)), unexplained), EFFECTS)


LAG, BACKLASH, TILT, HEAT = (EffectTerm(name) for name in ("servo_lag", "backlash", "axis_tilt", "thermal_growth"))


def test_nothing_is_decided_where_nothing_is_most_probable():
    verdict = _decided(((), 0.78, False), ((LAG,), 0.15, False), ((), 0.07, True))
    assert (verdict.label, verdict.effects, verdict.leg, verdict.unexplained) == ("none", (), 0, False)
    assert verdict.probability == pytest.approx(0.78)
    assert verdict.confounded_with == ("servo_lag", "unexplained")
    decisions = {name: verdict.decision(name) for name in ("none", "servo_lag", "unexplained", "backlash")}
    assert decisions == {"none": "named", "servo_lag": "possible", "unexplained": "possible", "backlash": "excluded"}


def test_what_probably_acts_is_named_and_the_probability_is_that_of_exactly_this():
    verdict = _decided(
        ((LAG, BACKLASH), 0.73, False), ((BACKLASH,), 0.24, False), ((), 0.01, False), ((BACKLASH, HEAT), 0.02, False)
    )
    assert verdict.label == "backlash+servo_lag" and verdict.confounded_with == ()
    assert verdict.probability == pytest.approx(0.73)
    assert [names for names, _, _ in verdict.rivals] == [frozenset({"backlash"})]
    assert verdict.decision("thermal_growth") == "excluded" and verdict.decision("servo_lag") == "named"


def test_a_name_needs_all_sets_together_and_not_one_that_is_probable():
    """No set of it is the most probable one, and it acts in most of them."""
    more = {(): 0.2, (LAG,): 0.2, (TILT,): 0.2, (LAG, TILT): 0.16}
    verdict = _decided(*(((BACKLASH, *others), p, False) for others, p in more.items()), ((HEAT,), 0.24, False))
    assert verdict.effects == ("backlash",) and verdict.probability == pytest.approx(0.2)


def test_hypotheses_of_one_set_add_up():
    legs = [EffectTerm("servo_lag", 0, leg) for leg in (1, 2, 3)]
    verdict = _decided(*(((leg,), 0.25, False) for leg in legs), ((BACKLASH,), 0.25, False))
    assert verdict.label == "servo_lag" and verdict.probability == pytest.approx(0.75)
    assert verdict.confounded_with == ("backlash",) and verdict.groups == ()


def test_what_is_unexplained_adds_up_over_sets():
    verdict = _decided(((), 0.35, True), ((LAG,), 0.25, True), ((BACKLASH,), 0.15, False), ((TILT,), 0.25, False))
    assert verdict.label == "unexplained" and verdict.probability == pytest.approx(0.6)
    assert verdict.confounded_with == ("axis_tilt", "servo_lag", "backlash")


@pytest.mark.parametrize(("probability", "expected"), [(0.75, "servo_lag+unexplained"), (0.6, "unexplained")])
def test_with_something_unexplained_the_same_rule_holds(probability, expected):
    verdict = _decided(((LAG,), probability, True), ((), 1.0 - probability, True))
    assert verdict.label == expected
    assert ("servo_lag" in verdict.confounded_with) is (expected == "unexplained")


def test_causes_that_exclude_each_other_are_a_group():
    verdict = _decided(((LAG, TILT), 0.55, False), ((LAG, BACKLASH), 0.43, False), ((LAG,), 0.02, False))
    (group,) = verdict.groups
    assert group.names == ("axis_tilt", "backlash") and group.probability == pytest.approx(0.98)
    # the most probable one represents it in the model
    assert set(verdict.effects) == {"servo_lag", "axis_tilt"} and verdict.probability == pytest.approx(0.55)
    decisions = [verdict.decision(name) for name in ("servo_lag", "axis_tilt", "backlash", "thermal_growth")]
    assert decisions == ["named", "group", "group", "excluded"]
    assert verdict.confounded_with == ("backlash",)


def test_where_no_cause_is_probable_enough_the_most_probable_answer_stands_and_is_called_possible():
    single = [((BACKLASH,), 0.2, False), ((LAG,), 0.2, False), ((TILT,), 0.1, False)]
    verdict = _decided(((LAG, BACKLASH), 0.36, False), *single, ((), 0.14, True))
    assert set(verdict.effects) == {"servo_lag", "backlash"} and verdict.groups == ()
    assert {verdict.decision(name) for name in verdict.effects} == {"possible"} and verdict.sure < 0.7
    assert not set(verdict.confounded_with) & set(verdict.effects)


@pytest.mark.parametrize(("alone", "effects"), [(0.04, {"axis_tilt", "servo_lag"}), (0.06, {"axis_tilt"})])
def test_named_causes_that_cannot_be_all_that_acts_are_completed_by_the_most_probable_answer(alone, effects):
    """The answer "axis tilt" had a probability of 3e-52, since two further effects or something unexplained act."""
    verdict = _decided(
        ((TILT, LAG), 0.34, False),
        ((TILT, BACKLASH), 0.3, False),
        ((TILT, LAG, BACKLASH), 0.3 - alone, False),
        ((TILT,), 0.06, True),
        ((TILT,), alone, False),
    )
    assert set(verdict.effects) == effects and verdict.groups == () and not verdict.unexplained
    assert verdict.decision("axis_tilt") == "named" and verdict.decision("servo_lag") == "possible"
    assert verdict.probability == pytest.approx(0.34 if len(effects) > 1 else alone)


def test_named_causes_that_no_set_holds_together_stay():
    verdict = _decided(*((terms, 0.25, False) for terms in combinations((LAG, TILT, BACKLASH, HEAT), 3)))
    assert set(verdict.effects) == {"servo_lag", "axis_tilt", "backlash", "thermal_growth"}


def test_a_group_may_be_what_acts_next_to_the_named_causes():
    """No set of the first of the group alone has to be probable: one of the others does as well."""
    verdict = _decided(((LAG, TILT), 0.5, False), ((LAG, BACKLASH), 0.48, False), ((LAG,), 0.02, False))
    assert set(verdict.effects) == {"servo_lag", "axis_tilt"} and len(verdict.groups) == 1


def test_causes_that_have_nothing_to_do_with_each_other_are_no_group():
    """Two of 0.6 each, independent: neither is named with the other in one breath."""
    verdict = _decided(
        ((LAG, TILT, BACKLASH), 0.36, False),
        ((LAG, TILT), 0.24, False),
        ((LAG, BACKLASH), 0.24, False),
        ((LAG,), 0.16, False),
    )
    assert verdict.groups == () and verdict.effects == ("servo_lag",)
    assert set(verdict.confounded_with) == {"axis_tilt", "backlash"}


def test_a_group_has_as_few_causes_as_make_it_sure():
    entries = [((TILT,), 0.5, False), ((BACKLASH,), 0.42, False), ((HEAT,), 0.08, False)]
    assert _decided(*entries).groups[0].names == ("axis_tilt", "backlash")
    entries = [((TILT,), 0.36, False), ((BACKLASH,), 0.34, False), ((HEAT,), 0.3, False)]
    assert _decided(*entries).groups[0].names == ("axis_tilt", "backlash", "thermal_growth")


def test_there_may_be_two_groups():
    one, other = [(TILT,), (BACKLASH,)], [(HEAT,), (LAG,)]
    entries = [((*a, *b), 0.25, False) for a in one for b in other]
    assert {frozenset(group.names) for group in _decided(*entries).groups} == {
        frozenset({"axis_tilt", "backlash"}),
        frozenset({"thermal_growth", "servo_lag"}),
    }


@pytest.mark.parametrize(
    ("terms", "leg"),
    [
        ((EffectTerm("servo_lag", 0, 2),), 2),
        ((EffectTerm("servo_lag", 0, 2), EffectTerm("backlash", 0, 2)), 2),
        ((EffectTerm("servo_lag", 0, 2), EffectTerm("backlash", 0, 3)), 0),
        ((EffectTerm("servo_lag", 0, 2), HEAT), 2),
        ((HEAT,), 0),
        ((LAG,), 0),
        ((EffectTerm("servo_lag", 0, SAME),), 0),
    ],
)
def test_a_leg_is_named_where_all_effects_with_legs_agree_on_it(terms, leg):
    assert _decided((terms, 0.9, False), ((), 0.1, False)).leg == leg


def test_labels():
    assert [label((), False), label((), True), label(("b", "a"), False), label(("a",), True)] == [
        "none",
        "unexplained",
        "b+a",
        "a+unexplained",
    ]
