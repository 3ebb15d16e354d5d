"""Scoring made-up verdicts of robots whose truth is known."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from rrru.calibration.calibrate import calibrate
from rrru.calibration.campaign_fit import select
from rrru.campaign import measurements as rows
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.state import ModelState
from rrru.effects.library import library
from rrru.errors import ConfigError
from rrru.studies.blind_validation.causes import EFFECTS
from rrru.studies.blind_validation.robots import noise_free
from rrru.studies.blind_validation.score import Known, _rivals, limits, score_chunk, with_truth
from rrru.studies.blind_validation.stated import state_of, state_row
from rrru.studies.blind_validation.summary import (
    calibration_error,
    confusion,
    field_verdicts,
    read_field_answers,
    score_field,
    summary,
    wilson,
)
from rrru.studies.blind_validation.verdicts import is_right
from tests.schemas import TABLES, check
from tests.studies.blind_validation.conditions import CONDITIONS, acting, bare

_LIBRARY = library(CONDITIONS.mechanism)
_PART = {"part": "backlash", "kind": "effect", "rms_mm": 0.07, "probability": 0.99}
_PART |= {"share": 0.8, "share_low": 0.7, "share_high": 0.9}
_STATED = {"effect": "backlash", "probability": 0.99, "decision": "named", "group": ""}


@pytest.fixture(scope="module")
def robots():
    """A robot with backlash on leg 2 of twice the noise, and one with nothing: robot, measurements, calibration."""
    robot = bare(7)
    backlash = replace(acting(robot, "backlash", seed=3), leg=2, coordinates=(0.0, 6e-4, 0.0))
    result = {}
    for made in (replace(robot, name="sound"), replace(robot, name="faulty", acting=(backlash,))):
        measurements, _ = made.campaign(CONDITIONS).run()
        fit = calibrate(select(measurements, CONDITIONS.mechanism, ["*"]))
        result[made.name] = (made, measurements, fit.deviations)
    return result


def _problem(measurements, library):
    return make_diagnosis_problem(measurements, CONDITIONS.mechanism, CONDITIONS.masses, CONDITIONS.noise_mm, library)


def _scored(robots, verdicts, states):
    """Scores by robot and limits of a chunk, as the tables of these names."""
    answers = pd.DataFrame([robot.answer(CONDITIONS) for robot, _, _ in robots.values()])
    measurements = pd.concat([frame.assign(robot=name) for name, (_, frame, _) in robots.items()])
    base = {"check": "label", "probability": 0.9, "share_closed": 0.5}
    joined = pd.DataFrame([base | {"robot": name} | verdict for name, verdict in verdicts.items()])
    joined = answers[["robot", "kind"]].merge(joined, on="robot")
    corrected = pd.DataFrame([state_row(name, *state, _LIBRARY) for name, state in states.items()])
    budget = pd.DataFrame([{"robot": name} | _PART for name in robots])
    stated = pd.DataFrame([{"robot": name} | _STATED for name in robots])
    scored = score_chunk(answers, measurements, joined, stated, corrected, budget, {"": Known(CONDITIONS)})
    for name, frame in scored._asdict().items():
        check(f"withheld_{name}", frame)
    assert scored.causes.set_index("robot")["acts"].equals(pd.Series({name: name == "faulty" for name in robots}))
    return scored.scores.set_index("robot")


def test_a_perfect_diagnosis_gets_everything(robots):
    faulty, _, calibrated = robots["faulty"]
    perfect = ModelState(np.array(faulty.deviations), {("backlash", 0): np.array(faulty.acting[0].coordinates)})
    sound = ModelState(robots["sound"][2], {})
    verdicts = {"sound": {"effects": "none", "leg": 0}, "faulty": {"effects": "backlash", "leg": 2}}
    scores = _scored(robots, verdicts, {"sound": (robots["sound"][2], sound), "faulty": (calibrated, perfect)})
    assert scores["right"].all() and scores["leg_right"].equals(pd.Series({"sound": np.nan, "faulty": 1.0}))
    # the diagnosis' motion is not quite the robot's, so that a little is left of the hysteresis
    assert scores.loc["faulty", "share_closed_true"] > 0.8 and np.isnan(scores.loc["sound", "share_closed_true"])
    assert scores.loc["faulty", "oracle_detects"] and not scores.loc["sound", "oracle_detects"]
    assert np.isnan(scores.loc["sound", "share_closed"]) and scores.loc["faulty", "share_closed"] == 0.5


def test_a_wrong_diagnosis_gets_nothing(robots):
    states = {name: (calibrated, ModelState(calibrated, {})) for name, (_, _, calibrated) in robots.items()}
    verdicts = {"sound": {"effects": "servo_lag", "leg": 0}, "faulty": {"effects": "backlash+unexplained", "leg": 1}}
    scores = _scored(robots, verdicts, states)
    assert not scores["right"].any() and scores.loc["faulty", "leg_right"] == 0.0
    assert scores.loc["faulty", "share_closed_true"] == 0.0


@pytest.mark.parametrize(("effects", "right"), [("backlash", True), ("backlash+servo_lag", False), ("none", False)])
def test_many_causes_are_scored_by_their_parts_and_have_no_limits(robots, effects, right):
    own = {"faulty": robots["faulty"]}
    verdict = {"check": "many", "effects": effects, "leg": 0}
    calibrated = robots["faulty"][2]
    scores = _scored(own, {"faulty": verdict}, {"faulty": (calibrated, ModelState(calibrated, {}))})
    assert scores.loc["faulty", "right"] == right and not scores.loc["faulty", "oracle_detects"]


def test_what_holds_an_effect_goes_with_it():
    library = {name: _LIBRARY[name] for name in ("leg_asymmetry", "joint_axis_error", "backlash")}
    assert _rivals(library, "leg_asymmetry") == ["backlash"]
    many = {"drive_error_function", "transmission_orders"}
    assert set(_rivals(_LIBRARY, "")) == set(_LIBRARY) - many


@pytest.mark.parametrize(
    ("truth", "verdict", "check", "right"),
    [
        ("none", "none", "label", True),
        ("none", "unexplained", "label", False),
        ("backlash", "backlash", "label", True),
        ("backlash", "backlash+unexplained", "label", False),
        ("backlash+servo_lag", "servo_lag+backlash", "label", True),
        ("backlash+servo_lag", "servo_lag", "label", False),
        ("outside:rehoming", "unexplained", "label", True),
        ("outside:rehoming", "servo_lag+unexplained", "label", True),
        ("outside:rehoming", "servo_lag", "label", False),
        ("outside", "unexplained", "field", True),
        ("backlash", "unexplained", "effect", True),
        ("backlash", "servo_lag+unexplained", "effect", True),
        ("backlash", "servo_lag", "effect", False),
        ("backlash", "backlash", "noise", True),
        ("none", "unexplained", "noise", False),
        ("none", "none", "background", True),
        ("none", "joint_axis_error", "background", True),
        ("none", "axis_tilt", "background", False),
        ("none", "joint_axis_error+unexplained", "background", False),
        ("backlash", "backlash", "background", True),
        ("backlash", "joint_axis_error+backlash", "background", True),
        ("backlash", "joint_axis_error", "background", False),
        ("backlash", "joint_axis_error+backlash", "label", False),
    ],
)
def test_right_is_what_names_exactly_the_truth(truth, verdict, check, right):
    assert is_right(truth, verdict, check) is right


def test_states_survive_as_text():
    state = ModelState(
        np.array([1e-3, -2.5]),
        {
            ("thermal_growth", 2): np.array([1.25e-4]),
            ("backlash", 0): np.array([0.0, 1 / 3, 2.0]),
            ("transmission_orders", 0): np.array([1e-4, -2e-4]),
            ("drive_error_function", 0): 1e-5 * np.arange(3 * 2 * 128),
        },
        {"thermal_growth": {"time_constant": 1 / 7}},
    )
    fitted = _LIBRARY | {"transmission_orders": _LIBRARY["transmission_orders"].with_waves(((2, 7.25),))}
    calibrated, again, effects = state_of(state_row("a", [0.5, 0.25], state, fitted), _LIBRARY)
    np.testing.assert_array_equal(calibrated, [0.5, 0.25])
    np.testing.assert_array_equal(again.deviations, state.deviations)
    assert set(again.effects) == set(state.effects) and again.shape_values == state.shape_values
    assert all((again.effects[key] == value).all() for key, value in state.effects.items())
    assert effects["transmission_orders"].waves == ((2, 7.25),)
    assert effects["transmission_orders"].parameters.names == ("sine_3_7.25", "cosine_3_7.25")
    assert all(effects[name] is _LIBRARY[name] for name in ("drive_error_function", "backlash"))


def test_a_function_of_the_measured_range_survives_as_its_coefficients(robots):
    """Mixtures that a campaign has chosen come back as the library's coefficients, with the same curves."""
    problem, name = _problem(robots["sound"][1], _LIBRARY), "drive_error_function"
    mixed = problem.library[name]
    chosen = replace(mixed, coordinates=replace(mixed.coordinates, sized=True))
    values = 1e-5 * np.random.default_rng(4).standard_normal(len(mixed.coordinates))
    state = ModelState(np.zeros(2), {(name, 0): values})
    _, again, effects = state_of(state_row("a", [0.0], state, {name: chosen}), _LIBRARY)
    assert effects[name] is _LIBRARY[name] and len(again.effects[name, 0]) > len(values)
    found = _LIBRARY[name].along_drives(problem.motion), np.split(again.effects[name, 0], 3)
    for drive, (own, every, coefficients) in enumerate(zip(mixed.along_drives(problem.motion), *found, strict=True), 1):
        curve = own @ values[mixed.coordinates.legs == drive]
        np.testing.assert_allclose(every @ coefficients, curve, rtol=0.0, atol=1e-12 * np.abs(curve).max())


def test_the_oracle_alarms_falsely_once_in_a_hundred(robots):
    """On a robot without any effect, tested for one that is not there."""
    sound, faulty = robots["sound"][0], robots["faulty"][0]
    exact = noise_free(sound, CONDITIONS)
    problem = _problem(exact, with_truth({}, faulty.acting))
    generator, alarms = np.random.default_rng(1), 0
    for _ in range(300):
        noisy = rows.measured(exact) + CONDITIONS.noise_mm * generator.standard_normal((len(exact), 3))
        named = {f"measured_{axis}_mm": noisy[:, k] for k, axis in enumerate("xyz")}
        measured = replace(problem, measurements=exact.assign(**named))
        alarms += limits(measured, np.array(sound.deviations), faulty.acting, []).oracle_detects
    # three expected; none, or ten and more, would come once in 20 and once in 900 such tests
    assert 1 <= alarms <= 9


def test_the_best_rival_of_backlash_is_lag(robots):
    robot, measurements, calibrated = robots["faulty"]
    problem = _problem(measurements, with_truth(EFFECTS, robot.acting))
    limit = limits(problem, calibrated, robot.acting, list(EFFECTS))
    assert limit.oracle_detects and limit.oracle_freedom == 1
    assert limit.rival == "servo_lag" and limit.rival_chi2 > 30.0


def test_wilson_interval():
    # R. G. Newcombe, Statistics in Medicine 17 (1998), Table I: 81 of 263, 15 of 148, 0 of 20, 1 of 29
    for hits, count, low, high in (
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ):
        np.testing.assert_allclose(wilson(hits, count), (low, high), atol=5e-5)
    assert np.isnan(wilson(0, 0)).all()


def test_calibration_error():
    assert calibration_error([1.0] * 20, [True] * 20) == 0.0
    np.testing.assert_allclose(calibration_error([0.9] * 20, [True] * 10 + [False] * 10), 0.4, atol=1e-12)
    # too sure by 0.4 in one bin, too unsure by 0.4 in the other
    stated, right = [0.9] * 20 + [0.1] * 20, [True, False] * 20
    np.testing.assert_allclose(calibration_error(stated, right), 0.4, atol=1e-12)
    generator = np.random.default_rng(1)
    stated = generator.uniform(size=20000)
    assert calibration_error(stated, generator.uniform(size=20000) < stated) < 0.02


def _scores(*entries):
    """Score rows from (truth, verdict, strength, leg)."""
    base = {
        "check": "label",
        "kind": "full",
        "probability": 0.9,
        "oracle_detects": True,
        "share_closed": 0.8,
        "share_closed_true": 0.82,
        "file": "",
        "cause": "",
        "numbers": 0,
        "held": 0,
    }
    return pd.DataFrame(
        [
            base
            | {"robot": f"r{k}", "truth": truth, "verdict": verdict, "strength": strength, "truth_leg": leg}
            | {"right": is_right(truth, verdict, "label"), "leg_right": 1.0 if leg else np.nan}
            for k, (truth, verdict, strength, leg) in enumerate(entries)
        ]
    )


def test_the_summary_counts_whom_it_says():
    scores = _scores(
        ("backlash", "backlash", 2.0, 1),
        ("backlash", "servo_lag", 3.0, 0),
        ("backlash", "none", 0.5, 0),
        ("servo_lag", "servo_lag", 1.2, 0),
        ("none", "none", 0.0, 0),
        ("none", "backlash", 0.0, 0),
        ("backlash+servo_lag", "backlash", 3.0, 0),
        ("backlash+servo_lag", "servo_lag+backlash", 3.0, 0),
        ("outside:rehoming", "unexplained", 4.0, 0),
        ("outside:rehoming", "backlash", 1.0, 0),
    )
    weak = {"r6": 0.2, "r7": 1.5}
    limit = pd.DataFrame(
        [
            {"check": "label", "robot": r, "weakest": weak.get(r, np.nan), "confounded_share": 0.1}
            for r in scores["robot"]
        ]
    )
    nothing = (pd.DataFrame(columns=TABLES[f"withheld_{name}"].names) for name in ("parts", "causes"))
    table = check("withheld_summary", summary(scores, limit, *nothing)).set_index(["group", "figure"])
    expected = {
        ("one effect, gap >= 1.5 x noise", "named exactly"): (2, 0.5),
        ("nothing acts", "false alarms"): (2, 0.5),
        ("outside the library, gap >= 2 x noise", "unexplained"): (1, 1.0),
        ("two effects", "both named exactly"): (2, 0.5),
        ("two effects, each >= 1 x noise", "both named exactly"): (1, 1.0),
        ("two effects", "at least one named, nothing wrong"): (2, 1.0),
        ("one leg at fault, gap >= 1.5 x noise", "leg named"): (1, 1.0),
        ("one effect, gap 0.3 to 1 x noise", "named exactly"): (1, 0.0),
        ("one effect named, gap >= 1.5 x noise", "share closed predicted within 0.05"): (1, 1.0),
        ("backlash alone", "named exactly"): (3, 1.0 / 3.0),
    }
    for key, (robots, value) in expected.items():
        assert table.loc[key, "robots"] == robots and np.isclose(table.loc[key, "value"], value), key
    counts = check("withheld_confusion", confusion(scores)).set_index(["truth", "verdict"])["robots"]
    assert counts["backlash+servo_lag", "backlash+servo_lag"] == 1 and counts.sum() == len(scores)


def test_field_campaigns_are_scored_against_the_users_answers(tmp_path):
    path = tmp_path / "answers.csv"
    path.write_text("campaign,effects,leg\na,servo_lag+backlash,0\nb,backlash,2\nc,none,\nd,outside,0\n")
    verdict = {"probability": 0.7, "gap_rms_mm": 0.2, "noise_rms_mm": 0.04, "share_closed": 0.9}
    verdict |= {"confounded_with": "", "next_runs": ""}
    said = {
        "a": ("backlash+servo_lag", 0),
        "b": ("backlash", 1),
        "c": ("none", 0),
        "d": ("unexplained", 0),
        "e": ("none", 0),
    }
    campaigns = pd.DataFrame(
        [verdict | {"campaign": name, "effects": effects, "leg": leg} for name, (effects, leg) in said.items()]
    )
    verdicts = check("withheld_verdicts", field_verdicts(campaigns))
    scores = check("withheld_scores", score_field(verdicts, read_field_answers(path)))
    assert (
        scores["robot"].tolist() == ["a", "b", "c", "d"] and scores["right"].all() and scores["strength"].eq(5.0).all()
    )
    assert scores.set_index("robot").loc["b", "leg_right"] == 0.0
    assert len(verdicts) == 5


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("campaign,effects\na,none\n", "lacks the columns leg"),
        ("campaign,effects,leg\na,nosuch,0\n", "'nosuch'"),
        ("campaign,effects,leg\na,none,0\nb,backlash,two\n", "campaign b has the leg 'two'; allowed: 0 to 3"),
        ("campaign,effects,leg\na,none,\nb,backlash,4\n", "campaign b has the leg '4'"),
    ],
)
def test_answers_that_make_no_sense_are_refused(tmp_path, text, message):
    (tmp_path / "answers.csv").write_text(text)
    with pytest.raises(ConfigError, match=message):
        read_field_answers(tmp_path / "answers.csv")
