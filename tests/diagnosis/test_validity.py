"""A fit that describes the readings too badly names no cause and says so first; large gaps of a right file stay."""

import numpy as np
import pandas as pd
import pytest

from rrru.campaign import measurements as rows
from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.settings import GapSettings
from rrru.diagnosis.verdict_facts import answer
from rrru.report.cards import card
from tests.diagnosis import arms, campaigns
from tests.schemas import check

_EFFECTS = GapSettings(("backlash", "drive_compliance", "encoder_eccentricity"), draws=10)


def _of_arm(frame):
    """Diagnosis of a table of the arm."""
    robot = arms.reading(frame)
    robot = robot.with_identifiable_parameters(
        rows.actuators(frame, robot), rows.command(frame), rows.readings(frame, arms.ARM.characteristic_length_mm)
    )
    return diagnose(frame, MeasuredRobot(robot, arms.MASSES, arms.NOISE_MM, "arm", arms.NOISE_RAD), _EFFECTS)


def _answered(found):
    """Facts and card of a diagnosis, accepted by the schemas."""
    for name, frame in ({"gap_verdicts": pd.DataFrame([found.verdict])} | found.tables).items():
        if name != "gap_points":
            check(name, frame.assign(campaign="made up"))
    facts = answer("made up", found.verdict, found.tables)
    return facts, card(facts)


@pytest.fixture(scope="module")
def turned():
    """An arm with backlash, one of whose joints is read with the other sign."""
    frame = arms.measure((arms.active("backlash", np.full(6, 1e-3)),), 80)
    return _of_arm(frame.assign(q3_rad=-frame["q3_rad"]))


def test_of_a_file_that_is_not_the_robot_s_no_cause_is_named(turned):
    verdict = turned.verdict
    assert verdict["effects"] == "unexplained" and not turned.state.effects
    assert "times the noise" in verdict["no_answer"] and "zero is off" not in verdict["notes"]
    facts, shown = _answered(turned)
    assert (
        shown.lead.startswith("No cause is named: ")
        and verdict["no_answer"] in shown.lead
        and shown.short == shown.lead
    )
    assert not facts["effects"] and facts["unexplained"] and "rrru check" in shown.next
    said = " ".join(facts["sentences"])
    assert "backlash" not in said and "eccentricity" not in said and not shown.parts


def test_numbers_that_bounds_hold_are_the_headline():
    """The zero of a leg is off by more than a calibration looks for."""
    found = campaigns.diagnosed(campaigns.measure(deviations=campaigns.ERRORS | {"dtheta1": 0.302}), details=True)
    assert "ends at bounds of calibration parameters (dtheta1 = 0.3 rad" in found.verdict["no_answer"]
    numbers = found.tables["gap_parameters"].query("effect == 'calibration'").set_index("parameter")
    assert numbers["at_bound"].to_dict()["dtheta1"] and not numbers["at_bound"].drop("dtheta1").any()
    assert _answered(found)[1].lead.startswith("No cause is named: ")


def test_a_large_gap_of_the_library_keeps_its_cause():
    """A robot with residuals of fifty times the noise, all of it backlash."""
    # a width of 0.0198 rad is next to its bound of 0.02 rad, where wind-up over a short travel replaces it
    effects = tuple(name for name in campaigns.EFFECTS if name != "friction_windup")
    frame = campaigns.measure((campaigns.strong("backlash", 150.0),))
    found = campaigns.diagnosed(frame, settings=GapSettings(effects, draws=50))
    assert found.verdict["effects"] == "backlash" and found.verdict["no_answer"] == ""
