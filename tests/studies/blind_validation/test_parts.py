"""True and found parts of a gap, and what is counted of them."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from rrru.campaign import measurements as rows
from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.settings import GapSettings
from rrru.studies.blind_validation.causes import Acting
from rrru.studies.blind_validation.noise import NOISES, NoiseModel
from rrru.studies.blind_validation.parts import is_enough, parts
from rrru.studies.blind_validation.robots import noise_free
from rrru.studies.blind_validation.summary import summary
from tests.schemas import TABLES, check
from tests.studies.blind_validation.conditions import CONDITIONS, bare

_NOISE_RMS_MM = CONDITIONS.noise_rms_mm


def _acting(name, strength):
    return Acting(name, {}, (), 0, strength)


def _robot(*acting, background=(), **noise):
    """A robot of which only what acts and its noise are asked for."""
    drawn = {"acting": tuple(_acting(*one) for one in acting), "noise": noise}
    return replace(bare(1), **drawn, background=tuple(_acting(*one) for one in background))


def _budget(*found):
    """Rows of a budget from (part, kind, rms over noise, probability), of a gap of 5 times the noise.

    The intervals are those of rms from half of what is found to twice as much.
    """
    frame = pd.DataFrame(found, columns=["part", "kind", "rms_mm", "probability"])
    share = frame["rms_mm"].astype(float).abs() * frame["rms_mm"] / 5.0**2
    ends = {"share": share, "share_low": share / 4.0, "share_high": share * 4.0}
    return frame.assign(rms_mm=frame["rms_mm"] * _NOISE_RMS_MM, **ends)


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
    for end, factor in (("found_low_mm", 0.5), ("found_high_mm", 2.0)):
        np.testing.assert_allclose(table[end], factor * table["found_rms_mm"], atol=1e-12)
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


@pytest.mark.parametrize("noise", [*NOISES.values(), NoiseModel(size=0.5, scatter=3.0)])
def test_what_lies_beyond_the_stated_noise_is_what_is_drawn(noise):
    """Without offsets of runs: the excess of the drawn variances over the stated ones."""
    measurements = pd.DataFrame({"run": np.repeat(np.arange(400), 100)})
    noise = replace(noise, runs=0.0, freedom=np.inf)
    drawn = noise.draw(measurements, 2.0, np.random.default_rng(4))
    excess = np.maximum((drawn**2).mean(axis=0) - 4.0, 0.0)
    np.testing.assert_allclose(2.0 * noise.beyond, np.sqrt(excess.mean()), rtol=0.05, atol=0.4)


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


@pytest.mark.parametrize(
    ("entries", "right"),
    [
        # the group's first member is in the verdict, the other acts
        ([("a", "effect", 4.0, False), ("b", "effect", 0.0, True)], True),
        ([("a", "background", 1.0, False), ("b", "effect", 0.0, True)], True),
        ([("c", "effect", 4.0, True), ("b", "effect", 0.0, True)], False),
        ([("a", "effect", 4.0, False), ("b", "effect", 0.0, True), ("c", "effect", 0.0, True)], False),
    ],
)
def test_a_group_is_right_where_one_of_its_members_acts(entries, right):
    assert is_enough(_listed(*entries), 5.0, [("b", "a")]) is right


def _score(check, robot, truth, verdict, right, strength):
    """A row of `withheld_scores`."""
    base = {"kind": "full", "truth_leg": 0, "leg_right": np.nan, "probability": 0.9, "oracle_detects": False}
    own = {"check": check, "robot": robot, "truth": truth, "verdict": verdict, "right": right, "strength": strength}
    return base | own | {"share_closed": np.nan, "share_closed_true": 0.5}


def _part(robot, part, kind, strength, found, named):
    """A row of `withheld_parts`, of a noise of 1 mm."""
    own = {"robot": robot, "part": part, "kind": kind, "strength": strength, "named": named, "probability": 1.0}
    ends = {"found_low_mm": 0.5 * found, "found_high_mm": 1.5 * found}
    return {"check": "many", "true_rms_mm": strength, "found_rms_mm": found} | ends | own


def _cause(robot, effect, probability, decision, strength, group=""):
    """A row of `withheld_causes`."""
    own = {"robot": robot, "effect": effect, "probability": probability, "decision": decision, "group": group}
    return {"check": "many", "acts": strength > 0.0, "strength": strength} | own


def _figures(scores, listed=(), causes=()):
    """Robots and value by group and figure."""
    limits = pd.DataFrame(columns=TABLES["withheld_limits"].names)
    more = (("parts", listed), ("causes", causes))
    frames = (pd.DataFrame(rows, columns=TABLES[f"withheld_{name}"].names) for name, rows in more)
    table = summary(pd.DataFrame(scores), limits, *frames)
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
        ("one effect and axis errors", "named exactly, with or without joint_axis_error"): (1, 0.0, 0.92),
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
            _part("many_0000", "axis_tilt", "effect", 3.1, 2.2, False),
            _part("many_0000", "servo_lag", "effect", 0.0, 0.5, True),
            _part("many_0000", "joint_axis_error", "background", 9.0, 9.0, True),
            _part("many_0000", "unexplained", "unexplained", 0.0, 0.0, True),
            _part("many_0001", "cable_pull", "outside", 9.0, np.nan, False),
            _part("many_0001", "unexplained", "unexplained", 9.0, 8.0, False),
            _part("many_0001", "backlash", "effect", 2.5, 2.6, True),
            _part("many_0001", "scatter", "scatter", 2.2, 1.0, True),
        ],
        [
            _cause("many_0000", "backlash", 0.99, "named", 8.0),
            _cause("many_0000", "axis_tilt", 0.4, "group", 3.1, "leg_asymmetry | axis_tilt"),
            _cause("many_0000", "leg_asymmetry", 0.45, "group", 0.0, "leg_asymmetry | axis_tilt"),
            _cause("many_0000", "servo_lag", 0.8, "named", 0.0),
            _cause("many_0000", "joint_axis_error", 0.9, "named", 9.0),
            _cause("many_0001", "backlash", 0.3, "group", 2.5, "backlash | servo_lag | link_flexure"),
            _cause("many_0001", "servo_lag", 0.3, "group", 0.0, "backlash | servo_lag | link_flexure"),
            _cause("many_0001", "link_flexure", 0.2, "group", 0.0, "backlash | servo_lag | link_flexure"),
            _cause("many_0001", "base_placement", 0.02, "excluded", 0.3),
        ],
    )
    within, covered = "found within 25 %", "found within 25 % or in its 95 % interval"
    majors = "causes in the library, 0.3 of the gap or more"
    expected = {
        (majors, "named"): (2, 0.5, 0.92),
        (majors, "named, or in a group of two"): (2, 1.0, 0.96),
        (majors, "named, or in a group"): (2, 1.0, np.nan),
        (majors, "named alone, no group"): (2, 0.5, np.nan),
        ("causes and groups named", "not there"): (5, 0.2, 0.02),
        ("groups named", "mean number of members"): (2, 2.5, np.nan),
        ("largest cause, where in the library", "named"): (1, 1.0, np.nan),
        ("largest cause, where in the library", "named, or in a group of two"): (1, 1.0, 0.97),
        ("parts >= 2 x noise", within): (6, 4 / 6, np.nan),
        ("parts >= 2 x noise", covered): (6, 5 / 6, 0.95),
        ("parts >= 2 x noise, nothing from outside", within): (3, 2 / 3, np.nan),
        ("parts >= 2 x noise, nothing from outside", covered): (3, 1.0, np.nan),
        ("parts >= 2 x noise, a cause from outside", within): (3, 2 / 3, np.nan),
        ("parts >= 2 x noise, a cause from outside", covered): (3, 2 / 3, np.nan),
        ("a cause from outside >= 2 x noise", "unexplained"): (1, 0.0, 0.92),
        ("nothing from outside", "unexplained"): (1, 1.0, 0.05),
    }
    for key, values in expected.items():
        found = table.loc[key, ["robots", "value", "asked"]].astype(float)
        np.testing.assert_allclose(found, values, err_msg=str(key))
    # a cause of less than half of the noise is neither right nor wrong
    statements = table.xs("causes of 0.5 x noise or more, or that do not act", level="group")
    assert (statements["robots"] == 8).all()
    assert statements.loc["expected calibration error", "asked"] == 0.03
    off = [0.01, 0.6, 0.45, 0.8, 0.1, 0.7, 0.3, 0.2]
    np.testing.assert_allclose(statements.loc["Brier score", "value"], np.mean(np.square(off)))
    np.testing.assert_allclose(statements.loc["log loss", "value"], -np.mean(np.log(1.0 - np.array(off))))
    # 0.99 and 0.9 of two that act, 0.4 and 0.45 of one, 0.3 and 0.3 of one, 0.2 and 0.8 of none
    sums = abs(1.89 - 2.0) + abs(0.85 - 1.0) + abs(0.6 - 1.0) + 0.2 + 0.8
    np.testing.assert_allclose(statements.loc["expected calibration error", "value"], sums / 8.0)


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
