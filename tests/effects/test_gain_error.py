"""Gains of turning joints: against positions written down by hand, which robots have any, and the diagnosis."""

from dataclasses import replace

import numpy as np
import pytest

from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.settings import GapSettings
from rrru.effects.library import find
from rrru.robots.delta import Delta
from rrru.robots.rrru3 import Rrru3
from tests.diagnosis import arms
from tests.diagnosis.gantry import GANTRY
from tests.effects.robots import TURN_AND_SLIDE


def test_arms_that_turn_have_it_and_slides_and_parallel_robots_do_not():
    assert all(find("gain_error", robot) is None for robot in (GANTRY, Rrru3(), Delta()))
    assert find("gain_error", TURN_AND_SLIDE).parameters.names == ("gain_error1",)


def test_a_joint_turns_a_constant_share_too_far():
    effect, generator = find("gain_error", arms.ARM), np.random.default_rng(0)
    drive = arms.drives(30, generator)
    motion = replace(arms.problem_of(arms.measure(count=30)).motion, drive=drive)
    values = effect.parameters.vector({"gain_error2": -3e-4, "gain_error5": 1e-3})
    twists = effect.contribute(motion, values).twists
    found = arms.ARM.solve(drive, arms.ARM.forward(drive), twists)
    expected = arms.ARM.forward(drive * (1.0 + np.array([0.0, -3e-4, 0.0, 0.0, 1e-3, 0.0])))
    np.testing.assert_allclose(found.point(arms.ARM.tool_mm), expected, atol=1e-6)


@pytest.mark.parametrize(
    ("cause", "size"),
    [("gain_error", (0.0, 6e-4, 0.0, 0.0, 0.0, 0.0)), ("encoder_eccentricity", (0.0,) * 2 + (3e-4,) * 2 + (0.0,) * 8)],
)
def test_the_gain_of_a_joint_is_no_eccentricity_and_the_other_way_round(cause, size):
    frame = arms.measure([arms.active(cause, size)], count=120)
    known = MeasuredRobot(arms.reading(frame), arms.MASSES, arms.NOISE_MM, noise_rad=arms.NOISE_RAD)
    found = diagnose(frame, known, GapSettings(draws=10), details=False)
    assert (found.verdict["effects"], found.verdict["leg"]) == (cause, 2)
    if cause == "gain_error":
        number = found.tables["gap_parameters"].set_index("parameter").loc["gain_error2"]
        assert number["low_95"] < 6e-4 < number["high_95"] < 7e-4
