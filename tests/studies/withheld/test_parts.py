"""True and found parts of a gap, and what is counted of them."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from rrru.campaign import measurements as rows
from rrru.gap.diagnose import MeasuredRobot, diagnose
from rrru.gap.settings import GapSettings
from rrru.studies.withheld.noise import NOISES, NoiseLaw
from rrru.studies.withheld.parts import is_enough, parts
from rrru.studies.withheld.robots import Acting, noise_free
from rrru.studies.withheld.summary import summary
from tests.schemas import TABLES, check
from tests.studies.withheld.conditions import CONDITIONS, bare

_NOISE_RMS_MM = CONDITIONS.noise_rms_mm


def _acting(name, strength):
    return Acting(name, {}, (), 0, strength)


def _robot(*acting, background=(), **noise):
    """A robot of which only what acts and its noise are asked for."""
    drawn = {"acting": tuple(_acting(*one) for one in acting), "noise": noise}
    return replace(bare(1), **drawn, background=tuple(_acting(*one) for one in background))


def _budget(*found):
    """Rows of a budget from (part, kind, rms over noise, probability)."""
    frame = pd.DataFrame(found, columns=["part", "kind", "rms_mm", "probability"])
    return frame.assign(rms_mm=frame["rms_mm"] * _NOISE_RMS_MM)


def test_parts_stand_beside_their_true_sizes():
    robot = _robot(
        ("backlash", 3.0), ("axis_tilt", 1.0), ("cable_pull", 2.0), background=[("joint_axis_error", 1.5)], scatter=4.0
    )
    budget = _budget(
        ("backlash", "effect", 2.7, 1.0),
        ("servo_lag", "effect", 0.2, 0.1),
        ("scatter", "scatter", 4.1, 1.0),
        ("runs", "runs", 0.3, 0.2),
        ("unexplained", "unexplained", 1.9, 0.8),
        ("backlash and servo_lag", "covariance", -0.5, np.nan),
        ("sampling", "sampling", 0.1, np.nan),
    )
    table = parts(robot, "backlash+link_flexure+unexplained", budget, _NOISE_RMS_MM).set_index("part")
    over = table[["strength", "found_rms_mm", "probability"]] / [1.0, _NOISE_RMS_MM, 1.0]
    expected = {
        "backlash": (3.0, 2.7, 1.0, True),
        "axis_tilt": (1.0, 0.0, 0.0, False),
        "cable_pull": (2.0, np.nan, np.nan, True),
        "joint_axis_error": (1.5, 0.0, 0.0, False),
        "scatter": (4.0, 4.1, 1.0, True),
        "runs": (0.0, 0.3, 0.2, False),
        "unexplained": (2.0, 1.9, 0.8, True),
        "servo_lag": (0.0, 0.2, 0.1, False),
        "link_flexure": (0.0, 0.0, 0.0, True),
    }
    assert set(table.index) == set(expected)
    for part, (*numbers, named) in expected.items():
        np.testing.assert_allclose(over.loc[part].to_numpy(), numbers, atol=1e-12, err_msg=part)
        assert table.loc[part, "named"] == named, part
    np.testing.assert_allclose(table["true_rms_mm"], table["strength"] * _NOISE_RMS_MM)
    assert table["kind"].value_counts().to_dict() == {
        "effect": 4,
        "outside": 1,
        "background": 1,
        "scatter": 1,
        "runs": 1,
        "unexplained": 1,
    }


def test_an_effect_that_was_taken_out_counts_as_from_outside():
    table = parts(_robot(("backlash", 3.0)), "unexplained", _budget(), _NOISE_RMS_MM, "backlash").set_index("part")
    assert table.loc["backlash", "kind"] == "outside" and table.loc["backlash", "named"]
    assert table.loc["unexplained", "strength"] == 3.0


@pytest.mark.parametrize("law", [*NOISES.values(), NoiseLaw(size=0.5, scatter=3.0)])
def test_what_lies_beyond_the_stated_noise_is_what_is_drawn(law):
    """Without offsets of runs: the excess of the drawn variances over the stated ones."""
    measurements = pd.DataFrame({"run": np.repeat(np.arange(400), 100)})
    law = replace(law, runs=0.0, freedom=np.inf)
    drawn = law.draw(measurements, 2.0, np.random.default_rng(4))
    excess = np.maximum((drawn**2).mean(axis=0) - 4.0, 0.0)
    np.testing.assert_allclose(2.0 * law.beyond, np.sqrt(excess.mean()), rtol=0.05, atol=0.4)


def _listed(*entries):
    """Rows of `withheld_parts` from (part, kind, strength, named)."""
    return pd.DataFrame(entries, columns=["part", "kind", "strength", "named"])


@pytest.mark.parametrize(
    ("entries", "right"),
    [
        ([("a", "effect", 4.0, True), ("b", "effect", 2.9, False)], True),
        ([("a", "effect", 4.0, True), ("b", "effect", 3.1, False)], False),
        ([("a", "effect", 4.0, True), ("b", "effect", 0.0, True)], False),
        ([("a", "effect", 4.0, True), ("b", "background", 6.0, False)], True),
        ([("a", "effect", 4.0, True), ("b", "background", 0.1, True)], True),
        ([("a", "effect", 4.0, True), ("unexplained", "unexplained", 2.1, False)], False),
        ([("a", "effect", 4.0, True), ("unexplained", "unexplained", 1.9, False)], True),
        ([("a", "effect", 4.0, True), ("unexplained", "unexplained", 0.0, True)], True),
        ([("a", "effect", 4.0, True), ("scatter", "scatter", 0.0, True)], True),
    ],
)
def test_many_causes_need_those_that_matter_and_nothing_invented(entries, right):
    assert is_enough(_listed(*entries), 10.0) is right


def _score(check, robot, truth, verdict, right, strength):
    """A row of `withheld_scores`."""
    base = {"kind": "full", "truth_leg": 0, "leg_right": np.nan, "probability": 0.9, "oracle_detects": False}
    own = {"check": check, "robot": robot, "truth": truth, "verdict": verdict, "right": right, "strength": strength}
    return base | own | {"share_closed": np.nan, "share_closed_true": 0.5}


def _part(robot, part, kind, strength, found, named):
    """A row of `withheld_parts`, of a noise of 1 mm."""
    own = {"robot": robot, "part": part, "kind": kind, "strength": strength, "named": named, "probability": 1.0}
    return {"check": "many", "true_rms_mm": strength, "found_rms_mm": found} | own


def _figures(scores, listed=()):
    """Robots and value by group and figure."""
    limits = pd.DataFrame(columns=TABLES["withheld_limits"].names)
    table = summary(pd.DataFrame(scores), limits, pd.DataFrame(listed, columns=TABLES["withheld_parts"].names))
    return check("withheld_summary", table).set_index(["group", "figure"])


def test_noises_are_counted_one_by_one_and_together():
    table = _figures(
        [
            _score("noise", "noise_runs_0000", "none", "none", True, 0.0),
            _score("noise", "noise_runs_0002", "none", "backlash", False, 0.0),
            _score("noise", "noise_along_50_0000", "none", "none", True, 0.0),
            _score("noise", "noise_along_50_0001", "backlash", "backlash", True, 2.0),
            _score("background", "background_0000", "none", "joint_axis_error", True, 1.0),
            _score("background", "background_0001", "backlash", "none", False, 2.0),
        ]
    )
    alarm, named = "named or unexplained", "named exactly"
    expected = {
        ("nothing acts, any noise", alarm): (3, 1 / 3, 0.05),
        ("nothing acts, runs", alarm): (2, 0.5, 0.05),
        ("nothing acts, along_50", alarm): (1, 0.0, 0.05),
        ("one effect, along_50", named): (1, 1.0, 0.92),
        ("one effect, any noise", named): (1, 1.0, 0.92),
        ("nothing acts but axis errors", "answered none or joint_axis_error"): (1, 1.0, 0.95),
        ("one effect besides", "named exactly, with or without joint_axis_error"): (1, 0.0, 0.92),
    }
    for key, values in expected.items():
        np.testing.assert_allclose(table.loc[key, ["robots", "value", "asked"]].astype(float), values, err_msg=str(key))
    assert "nothing acts, tails" not in table.index.get_level_values("group")
    assert (table.xs("expected calibration error", level="figure")["asked"] == 0.05).all()


def test_parts_of_many_causes_are_counted():
    robots = [_score("many", name, "a+b", "a", True, 10.0) for name in ("many_0000", "many_0001")]
    table = _figures(
        robots,
        [
            _part("many_0000", "backlash", "effect", 8.0, 9.9, True),
            _part("many_0000", "axis_tilt", "effect", 3.1, 2.0, False),
            _part("many_0000", "servo_lag", "effect", 0.0, 0.5, True),
            _part("many_0000", "joint_axis_error", "background", 9.0, 9.0, True),
            _part("many_0000", "unexplained", "unexplained", 0.0, 0.0, True),
            _part("many_0001", "cable_pull", "outside", 9.0, np.nan, False),
            _part("many_0001", "unexplained", "unexplained", 9.0, 8.0, False),
            _part("many_0001", "backlash", "effect", 2.5, 2.6, True),
            _part("many_0001", "scatter", "scatter", 2.2, 1.0, True),
        ],
    )
    within = "found within 25 %"
    expected = {
        ("causes in the library, 0.3 of the gap or more", "named"): (2, 0.5),
        ("causes named", "not there"): (4, 0.25),
        ("largest cause, where in the library", "named"): (1, 1.0),
        ("parts >= 2 x noise", within): (6, 4 / 6),
        ("parts >= 2 x noise, nothing from outside", within): (3, 2 / 3),
        ("parts >= 2 x noise, a cause from outside", within): (3, 2 / 3),
        ("a cause from outside >= 2 x noise", "unexplained"): (1, 0.0),
        ("nothing from outside", "unexplained"): (1, 1.0),
    }
    for key, values in expected.items():
        np.testing.assert_allclose(table.loc[key, ["robots", "value"]].astype(float), values, err_msg=str(key))


def test_a_budget_comes_with_every_diagnosis_and_finds_what_scatters():
    robot = replace(bare(4), noise={"scatter": 3.0})
    library = GapSettings(("backlash",), draws=50)
    known = MeasuredRobot(CONDITIONS.mechanism, CONDITIONS.masses, CONDITIONS.noise_mm, "robot")
    budget = diagnose(robot.measured(CONDITIONS), known, library, details=False).tables["gap_budget"]
    table = parts(robot, "none", budget, _NOISE_RMS_MM).set_index("part")
    left = rows.measured(robot.measured(CONDITIONS)) - rows.measured(noise_free(robot, CONDITIONS))
    beyond = np.sqrt((left**2).sum(axis=1).mean() - _NOISE_RMS_MM**2)
    np.testing.assert_allclose(table.loc["scatter", "true_rms_mm"], beyond, rtol=0.1)
    np.testing.assert_allclose(table.loc["scatter", "found_rms_mm"], beyond, rtol=0.1)
    assert table.loc["scatter", "named"] and not table.loc["runs", "named"]
