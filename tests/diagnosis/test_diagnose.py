"""The whole diagnosis on virtual campaigns whose cause is known."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pandas as pd
import pytest

from rrru.diagnosis import diagnose as diagnose_module
from rrru.diagnosis.settings import GapSettings
from rrru.effects.library import find
from rrru.effects.protocol import ActiveEffect
from rrru.errors import ConfigError, FitError
from rrru.kinematics.legs import WORLD
from rrru.parameters import Parameter, ParameterSet
from tests.diagnosis import campaigns
from tests.diagnosis.campaigns import (
    EFFECTS,
    NOISE_MM,
    NOISE_RMS_MM,
    ROBOT,
    active,
    diagnosed,
    drawn,
    measure,
    plan_of,
    strong,
)
from tests.schemas import TABLES, check

MEASURED = [f"measured_{axis}_mm" for axis in "xyz"]
DETAILS = {
    "gap_locate",
    "gap_identifiability",
    "gap_budget",
    "gap_attribute",
    "gap_remainder",
    "gap_sets",
    "gap_shrink",
    "gap_parameters",
    "gap_drive_functions",
    "gap_left_out",
    "gap_next_runs",
    "gap_next_poses",
    "gap_points",
}


def _checked(found):
    """The diagnosis with its verdict and every table accepted by the schemas."""
    assert ["campaign", *found.verdict] == TABLES["gap_verdicts"].names
    check("gap_verdicts", pd.DataFrame([found.verdict]).assign(campaign="made up"))
    assert set(found.tables) == DETAILS
    for name, frame in found.tables.items():
        check(name, frame if name == "gap_points" else frame.assign(campaign="made up"))
    return found


def _identifiable(name, effect):
    """The effect without what the calibration's own tied lengths are: the part of an asymmetry that all legs share."""
    if name != "leg_asymmetry":
        return effect
    values = np.reshape(effect.effect.parameters.vector(effect.values), (3, 3))
    return active(name, (values - values.mean(axis=0)).ravel())


@cache
def _of_one(name):
    """Verdict and tables of the diagnosis of one effect, at a gap of four times the noise."""
    found = diagnosed(measure((_identifiable(name, strong(name, 4.0)),)), details=True)
    return _checked(found).verdict, found.tables


@pytest.mark.parametrize("name", list(EFFECTS))
def test_each_effect_is_named_and_its_numbers_are_recovered(name):
    """At a gap of four times the noise, all numbers within four standard errors."""
    effect = _identifiable(name, strong(name, 4.0))
    verdict, tables = _of_one(name)
    assert verdict["effects"] == name and verdict["leg"] == 0 and verdict["noise_from"] == "fitted"
    assert verdict["share_closed"] > 0.85 and verdict["gap_after_rms_mm"] < 0.5 * NOISE_RMS_MM < verdict["gap_rms_mm"]
    fitted = tables["gap_parameters"].query("effect == @name").set_index("parameter")
    truth = pd.Series(effect.effect.parameters.mapping(effect.effect.parameters.vector(effect.values)))
    known = fitted["standard_error"].notna()
    assert known.sum() >= len(effect.effect.coordinates)
    off = (fitted["value"] - truth)[known]
    off = off.where(~fitted["unit"][known].eq("rad") | (off.abs() < np.pi), off - 2.0 * np.pi * np.sign(off))
    assert (off.abs() < 4.0 * fitted["standard_error"][known]).all()
    attributed = tables["gap_attribute"].set_index("effect")
    assert attributed["probability"].idxmax() == name and set(attributed.index) == {*EFFECTS, "none", "unexplained"}
    low, gain, high = attributed.loc[name, ["heldout_gain_low", "heldout_gain", "heldout_gain_high"]]
    assert 0.0 < gain == pytest.approx(0.5 * (low + high)) and low < high


_FIRST_SITE = dict.fromkeys(("backlash", "servo_lag"), "drive") | {
    "leg_asymmetry": "elbow",
    "axis_tilt": "foot",
    "joint_clearance": "wrist",
}


@pytest.mark.parametrize(
    ("name", "leg"), [("backlash", 2), ("servo_lag", 3), ("leg_asymmetry", 1), ("axis_tilt", 2), ("joint_clearance", 3)]
)
def test_a_fault_on_one_leg_is_laid_to_that_leg(name, leg):
    verdict = diagnosed(measure((strong(name, 4.0, 1, leg),))).verdict
    assert (verdict["effects"], verdict["leg"]) == (name, leg)
    assert verdict["where"].split(" to ")[0] == f"leg {leg} {_FIRST_SITE[name]}"
    assert all(site.startswith(f"leg {leg} ") for site in verdict["where"].split(" to "))


def test_a_fault_on_all_legs_is_at_the_first_to_the_last_and_none_nowhere():
    assert _of_one("backlash")[0]["where"] == "leg 1 drive to leg 3 drive"
    assert _of_one("frame_misregistration")[0]["where"] == "world"
    assert diagnosed(measure()).verdict["where"] == ""


@pytest.mark.parametrize("seed", [11, 12, 13])
def test_noise_alone_is_no_gap(seed):
    found = diagnosed(measure(seed=seed), details=seed == 11)
    verdict = _checked(found).verdict if seed == 11 else found.verdict
    assert verdict["effects"] == "none" and verdict["probability"] > 0.5 and verdict["gap_rms_mm"] < NOISE_RMS_MM
    assert verdict["share_closed"] == 0.0 and verdict["leg"] == 0 and not found.state.effects


@pytest.mark.parametrize(
    ("first", "second"), [("backlash", "thermal_growth"), ("drive_compliance", "frame_misregistration")]
)
def test_two_effects_are_both_named(first, second):
    found = diagnosed(measure((strong(first, 4.0), strong(second, 4.0))))
    assert set(found.verdict["effects"].split("+")) == {first, second}
    assert {name for name, _ in found.state.effects} == {first, second}


@pytest.mark.parametrize("name", ["backlash", "transmission_error", "thermal_growth", "joint_clearance"])
def test_an_effect_that_the_library_lacks_is_unexplained(name):
    settings = GapSettings(draws=20).without(name)
    verdict = diagnosed(measure((strong(name, 6.0),)), settings=settings).verdict
    assert "unexplained" in verdict["effects"].split("+") and name not in verdict["effects"]


_SWAY = ParameterSet((Parameter("ripple", "mm", 0.0, -2.0, 2.0, "made up"),))


@dataclass(frozen=True)
class Ripple:
    """A user's effect: the platform's height ripples along x, three waves to the metre and a half."""

    name: str = "ripple"
    parameters: ParameterSet = _SWAY

    def contribute(self, motion, values):
        """Shift of what is measured."""
        upwards = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
        return motion.at({WORLD: upwards * values[0] * np.sin(motion.position_mm[:, :1] / 80.0)})


def test_a_users_own_effect_takes_part():
    label = f"{__name__}:Ripple"
    robot = (ActiveEffect(find(label, ROBOT), {"ripple": 0.15}),)
    settings = GapSettings(effects=(*EFFECTS, label), draws=20)
    found = _checked(diagnosed(measure(robot), details=True, settings=settings))
    assert found.verdict["effects"] == "ripple"
    fitted = found.tables["gap_parameters"].query("effect != 'calibration'").iloc[0]
    assert (
        fitted["value"] == pytest.approx(0.15, abs=4.0 * fitted["standard_error"]) and fitted["standard_error"] < 0.01
    )
    without = diagnosed(measure(robot)).verdict
    assert without["effects"] == "unexplained"


# where the answer is compared with itself the library need not be whole
FEW = ("servo_lag", "backlash", "drive_compliance", "leg_asymmetry", "thermal_growth")


@pytest.fixture(scope="module")
def lagging():
    return measure((strong("servo_lag", 4.0),))


@pytest.mark.parametrize("column", ["speed_mm_s", "payload_kg"])
def test_columns_that_the_cause_does_not_need_may_be_missing(lagging, column):
    assert _checked(diagnosed(lagging.assign(**{column: np.nan}), details=True)).verdict["effects"] == "servo_lag"


def test_without_times_a_lag_cannot_be_named_and_the_notes_say_so(lagging):
    found = _checked(diagnosed(lagging.assign(time_s=np.nan), details=True))
    verdict = found.verdict
    assert "servo_lag" not in verdict["effects"]
    assert "unexplained" in verdict["effects"] + verdict["confounded_with"]
    assert "servo_lag not tested" in verdict["notes"] and "thermal_growth not tested" in verdict["notes"]
    causes = found.tables["gap_attribute"].set_index("effect")
    untested = causes.loc[["servo_lag", "thermal_growth"]]
    assert untested["probability"].isna().all() and set(untested["decision"]) == {"not tested"}
    assert untested["note"].str.startswith("not tested: needs ").all()
    tested = causes.drop(index=[name for name in causes.index if f"{name} not tested: " in verdict["notes"]])
    assert tested["probability"].between(0.0, 1.0 + 1e-9).all() and "not tested" not in set(tested["decision"])


def test_points_that_are_not_used_are_reported_where_they_are_many(lagging):
    whole, _ = _of_one("servo_lag")
    spoilt = np.arange(len(lagging)) % 4 == 1
    verdict = diagnosed(lagging.assign(status=np.where(spoilt, "outlier", lagging["status"]))).verdict
    assert verdict["points"] <= len(lagging) - spoilt.sum() < whole["points"]
    assert f"{verdict['points']} of {len(lagging)} points used" in verdict["notes"]
    assert "points used" not in whole["notes"]


@pytest.fixture(scope="module")
def of_few(lagging):
    """Settings of few effects and the diagnosis with them."""
    settings = GapSettings(FEW, draws=30, seed=5)
    return settings, diagnosed(lagging, details=True, settings=settings)


def test_angles_recomputed_from_the_commands_give_the_same_answer(lagging, of_few):
    """A file without drive angles gets those of the nominal inverse kinematics, which is what the controller sent."""
    theta = campaigns.ROBOT.inverse(lagging[[f"command_{axis}_mm" for axis in "xyz"]].to_numpy())
    settings, found = of_few
    again = diagnosed(lagging.assign(**{f"theta{k + 1}_rad": theta[:, k] for k in range(3)}), settings=settings)
    verdict = found.verdict
    numbers = [key for key, value in verdict.items() if isinstance(value, float)]
    assert {key: again.verdict[key] for key in numbers} == pytest.approx(
        {key: verdict[key] for key in numbers}, rel=1e-6, nan_ok=True
    )
    assert {key: again.verdict[key] for key in verdict if key not in numbers} == {
        key: verdict[key] for key in verdict if key not in numbers
    }


def test_missing_points_and_runs_of_unequal_length_change_nothing(lagging):
    frame = lagging.copy()
    frame.loc[::7, MEASURED] = np.nan
    frame.loc[3::11, "status"] = "outlier"
    # one run stopped short of its end, where the robot no longer moved fast, and one was not recorded at all
    frame = frame[(frame["run"] != 6) & ((frame["run"] != 4) | (frame["point"] <= 29))]
    found = _checked(diagnosed(frame.reset_index(drop=True), details=True))
    assert found.verdict["effects"] == "servo_lag" and found.verdict["dropped_points"] == 0
    assert found.verdict["points"] == found.tables["gap_points"]["used"].sum() < 0.8 * len(lagging)


def test_recordings_that_stop_in_the_middle_of_a_run_change_nothing(lagging):
    length = lagging.groupby("run")["point"].transform("max")
    frame = lagging[(lagging["run"] % 2 == 0) | (lagging["point"] <= 0.67 * length)]
    assert diagnosed(frame.reset_index(drop=True)).verdict["effects"] == "servo_lag"


@pytest.mark.parametrize("noise_mm", [NOISE_MM, None])
def test_outliers_are_dropped_and_change_nothing(lagging, noise_mm):
    frame = lagging.copy()
    at = [20, 70, 150, 222, 300]
    frame.loc[at, "measured_x_mm"] += [1.0, -1.0, 1.0, 1.0, -1.0]
    found = diagnosed(frame, noise_mm, details=True)
    assert found.verdict["effects"] == "servo_lag" and found.verdict["dropped_points"] >= len(at)
    points = found.tables["gap_points"]
    assert not points.loc[at, "used"].any() and points["used"].sum() == found.verdict["points"]
    assert found.verdict["dropped_points"] <= 2 * len(at)


@pytest.mark.parametrize("name", [None, "servo_lag", "backlash"])
def test_an_unknown_noise_is_estimated_and_the_verdict_stays(name):
    found = diagnosed(measure((strong(name, 4.0),) if name else ()), None)
    assert found.verdict["effects"] == (name or "none") and found.verdict["noise_from"] == "fitted"
    assert found.verdict["noise_rms_mm"] == pytest.approx(NOISE_RMS_MM, rel=0.1)


def test_the_same_seed_gives_identical_tables_and_another_other_intervals(lagging, of_few):
    settings, first = of_few
    second, other = (diagnosed(lagging, details=True, settings=replace(settings, seed=seed)) for seed in (5, 6))
    assert first.verdict == second.verdict and first.verdict["effects"] == other.verdict["effects"]
    for name in DETAILS:
        pd.testing.assert_frame_equal(first.tables[name], second.tables[name])
    assert not first.tables["gap_shrink"].equals(other.tables["gap_shrink"])


def test_tables_agree_with_the_verdict():
    effects = (strong("thermal_growth", 3.0), strong("encoder_eccentricity", 6.0))
    found = diagnosed(measure(effects), details=True)
    verdict, shrink = found.verdict, found.tables["gap_shrink"]
    assert verdict["effects"] == "encoder_eccentricity+thermal_growth"
    whole = shrink[(shrink["trajectory"] == "*") & (shrink["kind"] == "held_out")].set_index("step")
    assert whole["effects"].tolist() == ["none", "encoder_eccentricity", "encoder_eccentricity+thermal_growth"]
    assert whole["gap_rms_mm"].is_monotonic_decreasing
    assert whole["gap_rms_mm"].iloc[[0, -1]].tolist() == [verdict["gap_rms_mm"], verdict["gap_after_rms_mm"]]
    assert whole["share_closed"].iloc[-1] == verdict["share_closed"]
    again = shrink[shrink["kind"] == "resimulated"].iloc[0]
    assert again["rms_mm"] == pytest.approx(NOISE_RMS_MM, rel=0.1)
    sets = found.tables["gap_sets"]
    assert set(sets["effects"].iloc[0].split("+")) == set(verdict["effects"].split("+"))
    assert (
        sets["probability"].iloc[0] == pytest.approx(verdict["probability"]) and sets["probability"].sum() <= 1.0 + 1e-9
    )


def test_too_few_points_are_refused():
    with pytest.raises(FitError, match="too few"):
        diagnosed(measure().head(4))


def test_a_library_that_makes_no_sense_is_refused(lagging):
    for settings, message in (
        (GapSettings(effects=("nosuch",)), "nosuch"),
        (GapSettings(effects=("backlash", "backlash")), "twice"),
        (GapSettings(known={"nosuch": {}}), "nosuch"),
        (GapSettings(known={"transmission_error": {"amplitude1": 1.0}}), "amplitude1"),
        (GapSettings(known={"transmission_error": {"ratio": -31.0}}), "ratio is -31; allowed: 1 to 1000"),
    ):
        with pytest.raises(ConfigError, match=message):
            diagnosed(lagging, settings=settings)


def test_what_is_known_of_a_gear_is_used():
    effect = EFFECTS["transmission_error"]
    values = effect.coordinates.to_values(3.0 * drawn("transmission_error", 1), {"ratio": 31.0})
    frame = measure((ActiveEffect(effect, effect.parameters.mapping(values)),))
    known, other = (GapSettings(known={"transmission_error": {"ratio": ratio}}, draws=20) for ratio in (31.0, 60.0))
    assert diagnosed(frame, settings=known).verdict["effects"] == "transmission_error"
    assert diagnosed(frame, settings=other).verdict["effects"] != "transmission_error"


def test_the_papers_campaign_each_trajectory_once_suffices_for_a_plain_effect():
    """No repeats: folds are stretches."""
    frame = measure((strong("encoder_eccentricity", 6.0),), plan=plan_of((campaigns.FORWARD,)))
    assert _checked(diagnosed(frame, details=True)).verdict["effects"] == "encoder_eccentricity"


@pytest.mark.parametrize("time_constant", [40.0, 700.0])
def test_a_time_constant_between_those_of_the_grid_is_fitted(time_constant):
    """A strong growth whose misfit at the nearest grid value would look like a drift besides."""
    effect = EFFECTS["thermal_growth"]
    grown = ActiveEffect(effect, {"strain": 8e-4, "time_constant": time_constant})
    found = diagnosed(measure((grown,)), details=True)
    assert found.verdict["effects"] == "thermal_growth"
    numbers = found.tables["gap_parameters"].query("effect != 'calibration'").set_index("parameter")["value"]
    assert numbers["time_constant"] == pytest.approx(time_constant, rel=0.1) and numbers["strain"] == pytest.approx(
        8e-4, rel=0.05
    )


def test_a_note_that_has_a_semicolon_stays_one_note():
    assert diagnose_module._joined(["9 of 10 points used; left out: 1 stale reading", "b"]).split("; ") == [
        "9 of 10 points used, left out: 1 stale reading",
        "b",
    ]
