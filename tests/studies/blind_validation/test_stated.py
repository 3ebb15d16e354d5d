"""Statements on single causes compared with the truth: stated, counted, and calibration of probabilities."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.settings import GapSettings
from rrru.diagnosis.verdict import Group, Verdict
from rrru.studies.blind_validation.causes import Acting
from rrru.studies.blind_validation.parts import causes_of, group_size, groups_of, named_lines
from rrru.studies.blind_validation.stated import fitted, held, stated
from rrru.studies.blind_validation.summary import brier_score, causes_calibration_error, counted, log_loss
from tests.schemas import check
from tests.studies.blind_validation.conditions import CONDITIONS, bare

_VERDICT = Verdict(
    ("backlash", "axis_tilt", "servo_lag"),
    True,
    0.5,
    0,
    ("link_flexure", "none"),
    (),
    (Group(("axis_tilt", "leg_asymmetry"), 0.9), Group(("servo_lag", "base_placement"), 0.8)),
)


@pytest.mark.parametrize(
    ("effect", "said", "group"),
    [
        ("backlash", "named", ""),
        ("axis_tilt", "group", "axis_tilt | leg_asymmetry"),
        ("leg_asymmetry", "group", "axis_tilt | leg_asymmetry"),
        ("base_placement", "group", "servo_lag | base_placement"),
        ("link_flexure", "possible", ""),
        # no part of another name
        ("flexure", "excluded", ""),
        ("thermal_growth", "excluded", ""),
    ],
)
def test_a_decision_is_that_of_the_verdict(effect, said, group):
    problem = SimpleNamespace(effects={effect: None})
    inference = SimpleNamespace(problem=problem, posterior=SimpleNamespace(marginal=lambda _: 0.5))
    row = stated("robot", SimpleNamespace(inference=inference, decided=_VERDICT)).iloc[0]
    assert (row["decision"], row["group"]) == (said, group)


def test_a_diagnosis_states_all_effects_that_it_tests_and_their_posterior_probability():
    robot = bare(4)
    known = MeasuredRobot(CONDITIONS.mechanism, CONDITIONS.masses, CONDITIONS.noise_mm, "robot")
    settings = GapSettings(("backlash", "servo_lag"), draws=50)
    result = diagnose(robot.measured(CONDITIONS), known, settings, details=False)
    table = check("withheld_stated", stated("robot", result))
    assert table["effect"].tolist() == list(result.inference.problem.effects)
    for row in table.itertuples():
        assert row.probability == pytest.approx(result.inference.posterior.marginal(row.effect))
        assert row.probability < 0.5 and row.decision in ("possible", "excluded")


def _stated(*entries):
    """Rows of `withheld_stated` of one robot from (effect, probability, decision, group)."""
    return pd.DataFrame(entries, columns=["effect", "probability", "decision", "group"]).assign(robot="one")


def test_causes_act_with_the_axis_errors_of_the_robot_and_not_what_is_from_outside():
    acting = [Acting(name, {}, (), 0, strength) for name, strength in (("backlash", 3.0), ("cable_pull", 2.0))]
    background = (Acting("joint_axis_error", {}, (), 0, 0.4),)
    robot = replace(bare(1), acting=tuple(acting), background=background)
    names = ("backlash", "joint_axis_error", "servo_lag")
    table = causes_of(_stated(*((name, 0.5, "possible", "") for name in names)), robot).assign(check="many")
    table = check("withheld_causes", table).set_index("effect")
    assert table["acts"].to_dict() == {"backlash": True, "joint_axis_error": True, "servo_lag": False}
    assert table["strength"].tolist() == [3.0, 0.4, 0.0]
    # axis errors of less than half of the noise are left out
    assert counted(table).index.tolist() == ["backlash", "servo_lag"]


def test_a_group_is_one_statement_and_there_where_one_of_its_members_acts():
    pair, other = "axis_tilt | leg_asymmetry", "servo_lag | base_placement | backlash"
    table = _stated(
        *(("axis_tilt", 0.5, "group", pair), ("leg_asymmetry", 0.4, "group", pair)),
        *((name, 0.3, "group", other) for name in other.split(" | ")),
        *(("link_flexure", 0.9, "named", ""), ("thermal_growth", 0.2, "possible", "")),
    )
    assert groups_of(table) == [tuple(group.split(" | ")) for group in (pair, other)]
    assert group_size(table["group"]).tolist() == [2, 2, 3, 3, 3, 0, 0]
    lines = named_lines(table.assign(acts=table["effect"] == "leg_asymmetry")).set_index("line")
    assert lines["size"].to_dict() == {pair: 2, other: 3, "link_flexure": 1}
    assert lines["invented"].to_dict() == {pair: False, other: True, "link_flexure": True}


def test_calibration_error_has_bins_of_equal_width_weighted_by_their_counts():
    generator = np.random.default_rng(5)
    probability = np.concatenate([generator.beta(0.3, 0.8, 700), [0.0, 0.1, 0.95, 1.0, 1.0]])
    acts = generator.random(len(probability)) < probability**1.5
    whole = 0.0
    for k in range(10):
        inside = (probability >= k / 10) & ((probability < (k + 1) / 10) | (k == 9))
        if inside.any():
            whole += inside.mean() * abs(probability[inside].mean() - acts[inside].mean())
    np.testing.assert_allclose(causes_calibration_error(probability, acts), whole, rtol=1e-12)
    assert whole > 0.03
    # half too sure by 0.1, and one of four that act where all were said to
    assert causes_calibration_error([0.9] * 4 + [1.0] * 4, [1, 1, 1, 1, 1, 0, 0, 0]) == pytest.approx(
        abs(4 * 0.9 + 4 * 1.0 - 5.0) / 8.0
    )
    assert np.isnan(causes_calibration_error([], []))


def test_probabilities_that_are_true_have_no_calibration_error():
    generator = np.random.default_rng(6)
    probability = generator.uniform(size=40_000)
    assert causes_calibration_error(probability, generator.uniform(size=40_000) < probability) < 0.01


def test_scores_of_probabilities():
    from sklearn.metrics import brier_score_loss
    from sklearn.metrics import log_loss as expected_log_loss

    generator = np.random.default_rng(7)
    probability = generator.uniform(0.01, 0.99, 200)
    acts = generator.uniform(size=200) < probability
    assert brier_score(probability, acts) == pytest.approx(brier_score_loss(acts, probability))
    assert log_loss(probability, acts) == pytest.approx(expected_log_loss(acts, probability))
    # a wrong certainty costs no more than one of 0.999
    assert log_loss([1.0], [False]) == pytest.approx(-np.log(0.001))
    assert np.isnan(brier_score([], [])) and np.isnan(log_loss([], []))


_TRUTH = {"backlash": {"width1": 1.0, "width2": 2.0}, "transmission_error": {"phase1": 0.0}}


def _estimates(*rows):
    columns = ["effect", "parameter", "value", "standard_error", "at_bound"]
    return fitted(pd.DataFrame(rows, columns=columns))


def test_numbers_of_what_truly_acts_are_counted():
    estimates = _estimates(
        ("calibration", "ddrive1", 1.0, np.nan, False),
        ("backlash", "width1", 1.19, 0.1, False),
        ("backlash", "width2", 2.2, 0.1, False),
        ("backlash", "width2", 0.0, 0.1, True),
        ("servo_lag", "lag1", 0.0, 0.1, False),
        ("transmission_error", "phase1", 6.28, 0.1, False),
    )
    assert held(estimates, _TRUTH) == (2, 1)
    assert held(_estimates(), _TRUTH) == (0, 0) and held(estimates, {}) == (0, 0)


def test_intervals_hold_as_often_as_they_say():
    generator = np.random.default_rng(2)
    rows = [("backlash", "width1", 1.0 + 0.3 * generator.standard_normal(), 0.3, False) for _ in range(4000)]
    count, hits = held(_estimates(*rows), _TRUTH)
    assert count == 4000
    # four standard deviations of a share of 0.95
    np.testing.assert_allclose(hits / count, 0.95, atol=0.014)
