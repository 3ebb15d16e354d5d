"""A base that creeps against the instrument, and effects of a campaign's circumstances, which have to be named."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rrru.diagnosis.settings import GapSettings
from rrru.effects import library as effects
from rrru.kinematics.legs import WORLD
from rrru.kinematics.readings import Readings
from rrru.robots.delta import Delta
from rrru.robots.rrru3 import Rrru3
from tests.diagnosis import arms

_SPEED, _RATE = np.array([4e-6, -2e-6, 5e-6]), np.array([1e-8, 2e-8, -1.5e-8])
_VALUES = np.concatenate([_SPEED, _RATE])
_START_S = 250.0
_TIMES = _START_S + np.array([0.0, 60.0, 600.0, 1800.0, 3600.0, 36000.0])
EFFECT = effects.find("base_drift", arms.ARM)


def _motion(times=_TIMES):
    frame = arms.measure(count=len(times)).assign(time_s=times)
    return arms.problem_of(frame).motion


def test_it_is_nothing_at_the_start_and_grows_in_proportion_to_the_time():
    motion = _motion()
    twists = EFFECT.contribute(motion, _VALUES).twists
    world = twists[:, arms.ARM.legs.site_numbers[WORLD]]
    np.testing.assert_allclose(world, np.outer(_TIMES - _START_S, _VALUES), rtol=1e-12)
    assert not world[0].any() and np.count_nonzero(twists.any(axis=(0, 2))) == 1
    np.testing.assert_array_equal(EFFECT.contribute(motion, -2.0 * _VALUES).twists, -2.0 * twists)


def test_the_first_point_in_time_is_the_start_whatever_its_row():
    order = np.array([3, 0, 5, 1, 4, 2])
    motion = _motion()
    shuffled = replace(motion, time_s=_TIMES[order])
    expected = EFFECT.contribute(motion, _VALUES).twists[order]
    np.testing.assert_array_equal(EFFECT.contribute(shuffled, _VALUES).twists, expected)


def test_reflectors_beside_the_robot_and_on_it_move_alike():
    """By one rigid motion of the instrument's world, which the Jacobian's columns predict."""
    places = {"on_tool": (60.0, 20.0, 110.0), "on_table": (500.0, -300.0, 0.0)}
    names, motion = list(places), _motion()
    count, sites = len(motion), [f"reflector {name}" for name in places]
    robot = arms.ARM.with_measurement_config(arms.reads_of(sites))
    twists = EFFECT.contribute(replace(motion, robot=robot), _VALUES).twists
    poses = robot.solve(motion.drive, motion.position_mm)
    for name, site in zip(names, sites, strict=True):
        on_world = np.full(count, name == "on_table")
        readings = Readings(
            motion.position_mm, np.full(count, site), np.tile(places[name], (count, 1)), None, 1.0, on_world
        )
        before = robot.measured(poses, np.zeros_like(twists), readings)
        moved = robot.measured(poses, twists, readings)
        passed = (_TIMES - _START_S)[:, None]
        expected = Rotation.from_rotvec(passed * _RATE).apply(before) + passed * _SPEED
        np.testing.assert_allclose(moved, expected, rtol=0.0, atol=1e-9)
        assert np.abs(moved - before)[-1].max() > 0.1
        at = robot.map(motion.drive, poses, readings=readings)
        np.testing.assert_allclose(at.move(twists), moved - before, rtol=0.0, atol=1e-3)
    still = robot.measured(poses, np.zeros_like(twists), readings)
    np.testing.assert_allclose(still, np.tile(places["on_table"], (count, 1)), atol=1e-12)


def test_a_campaign_without_times_cannot_test_it():
    problem = arms.problem_of(arms.measure(count=60), "base_drift", "drive_compliance")
    assert set(problem.effects) == {"drive_compliance"} and "time_s" in problem.untestable["base_drift"]


@pytest.mark.parametrize("robot", [Rrru3(), Delta(), arms.ARM], ids=["rrru3", "delta", "arm"])
def test_every_diagnosis_tests_the_laws_of_all_kinds_of_campaigns(robot):
    usual = {"base_drift", "drive_error_function", "transmission_orders", "friction_windup", "encoder_ovality"}
    usual |= {"read_before_rest", "thermal_expansion", "pedestal_compliance", "tracker_scale"}
    assert usual <= {*effects.library(robot)} <= {*GapSettings().effects}
    assert all(effects.find(name, robot).name == name for name in usual)
    assert set(GapSettings(tuple(sorted(usual))).library(robot)) == usual
