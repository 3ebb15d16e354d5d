"""A wrong millimetre of the instrument: what it does, and which robots can show it."""

from dataclasses import replace

import numpy as np
import pytest

from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.settings import GapSettings
from rrru.effects.library import find
from rrru.effects.protocol import ActiveEffect
from rrru.kinematics.legs import WORLD
from tests.diagnosis.campaigns import MASSES, NOISE_MM, ROBOT, measure, problem_of

EFFECT, SCALE = find("tracker_scale", ROBOT), 4e-4
_LIBRARY = ("tracker_scale", "frame_misregistration", "backlash", "drive_compliance", "servo_lag", "axis_tilt")


def test_all_distances_grow_by_one_factor():
    motion = problem_of(measure()).motion
    moved = EFFECT.contribute(motion, [SCALE]).twists[:, ROBOT.legs.site_numbers[WORLD]]
    assert not moved[:, 3:].any()
    reported = motion.position_mm + moved[:, :3]
    between = [np.linalg.norm(points[1:] - points[0], axis=1) for points in (motion.position_mm, reported)]
    np.testing.assert_allclose(between[1], (1.0 + SCALE) * between[0], rtol=1e-12)


def _told(parameter_set, errors):
    frame = measure([ActiveEffect(EFFECT, {"scale": SCALE})], deviations=errors)
    robot = MeasuredRobot(replace(ROBOT, parameter_set=parameter_set), MASSES, NOISE_MM)
    return diagnose(frame, robot, GapSettings(_LIBRARY))


def test_a_robot_whose_lengths_are_known_shows_it():
    found = _told("zero", {"dtheta1": 2e-3, "dtheta2": -1e-3, "dtheta3": 1.5e-3})
    assert found.verdict["effects"] == "tracker_scale"
    (fitted,) = found.state.effects.values()
    assert fitted[0] == pytest.approx(SCALE, rel=0.05)


def test_a_robot_whose_lengths_are_calibrated_hides_it():
    """It then is no answer and no rival: the table says that it cannot be seen."""
    found = _told("identifiable", None)
    assert found.verdict["effects"] == "none" and "tracker_scale" not in found.verdict["confounded_with"]
    row = found.tables["gap_identifiability"].set_index("effect").loc["tracker_scale"]
    assert not row["testable"] and "cannot be separated from the geometric parameters" in row["note"]
    cause = found.tables["gap_attribute"].set_index("effect").loc["tracker_scale"]
    assert np.isnan(cause["probability"]) and cause["decision"] == "not tested"
    assert "cannot be separated" in cause["note"]
