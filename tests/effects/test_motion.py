"""The motion that the effects see: exact where it is planned, careful where it is not known."""

import numpy as np
import pytest

from rrru.effects.motion import Course, make_motion, standing
from rrru.kinematics.dynamics import Masses
from rrru.robots.catalogue import make_mechanism
from rrru.robots.delta import Delta
from rrru.robots.ptt3 import Ptt3
from rrru.simulation.virtual_robot import VirtualRobot
from tests.effects.robots import EFFECTS, FORWARD, LINE, LOADED, ROBOT, SPIRAL, plan_of
from tests.formats.mjcf import ARM, HEXAPOD

_PLAN = plan_of(FORWARD, LOADED, trajectories=(LINE, SPIRAL))


def _given(**changes):
    """The motion of the nominal robot along the plan's points, with changes."""
    target = _PLAN.targets()
    n = len(target)
    arguments = {
        "position_mm": target,
        "drive": ROBOT.inverse(target),
        "path_drive": ROBOT.inverse(target),
        "path_index": np.arange(n),
        "time_s": np.arange(n, dtype=float),
        "velocity_mm_s": np.zeros((n, 3)),
        "acceleration_mm_s2": np.zeros((n, 3)),
        "payload_kg": np.zeros(n),
    }
    return make_motion(ROBOT, Masses(), Course(**(arguments | changes)))


def test_the_virtual_robots_motion_is_the_plans():
    motion = VirtualRobot(ROBOT).motion(_PLAN, ROBOT.inverse)
    commands = _PLAN.commands(ROBOT)
    np.testing.assert_array_equal(motion.time_s, commands["time_s"])
    np.testing.assert_array_equal(motion.payload_kg, commands["payload_kg"])
    np.testing.assert_array_equal(motion.position_mm, commands[[f"command_{a}_mm" for a in "xyz"]])
    np.testing.assert_array_equal(motion.drive, commands[[f"theta{k}_rad" for k in (1, 2, 3)]])
    np.testing.assert_allclose(motion.path_drive[motion.path_index], motion.drive, atol=1e-12)
    assert motion.robot is ROBOT and len(motion) == len(commands)


def test_rates_are_the_slopes_of_the_angles_in_time():
    """Between two sampled points of a run the rates' mean is the angles' step, up to the trapezoidal rule's error."""
    motion = VirtualRobot(ROBOT).motion(_PLAN, ROBOT.inverse)
    run = _PLAN.commands(ROBOT)["run"].to_numpy()
    inside = run[1:] == run[:-1]
    step = np.diff(motion.time_s)[:, None]
    mean = 0.5 * (motion.drive_rate[1:] + motion.drive_rate[:-1])
    bend = step**2 / 12.0 * np.diff(motion.drive_acceleration, axis=0)
    away = (mean * step - bend - np.diff(motion.drive, axis=0))[inside]
    assert np.median(np.abs(away)) < 1e-5 and np.abs(motion.drive_rate).max() > 0.1


def test_an_unknown_speed_leaves_static_loads_and_no_rates():
    unknown = np.full((len(_PLAN.targets()), 3), np.nan)
    still, blind = _given(), _given(velocity_mm_s=unknown, acceleration_mm_s2=unknown)
    assert np.isnan(blind.drive_rate).all() and np.isnan(blind.drive_acceleration).all()
    for key in ("force_n", "held_force_n", "drive_load"):
        np.testing.assert_array_equal(getattr(blind, key), getattr(still, key))
    assert not EFFECTS["servo_lag"].contribute(blind, np.full(3, 0.01)).twists.any()


def test_an_unknown_payload_counts_as_none():
    blind = _given(payload_kg=np.full(len(_PLAN.targets()), np.nan))
    assert np.isnan(blind.payload_kg).all()
    np.testing.assert_array_equal(blind.drive_load, _given().drive_load)


def test_an_unknown_time_leaves_the_robot_cold():
    blind = _given(time_s=np.full(len(_PLAN.targets()), np.nan))
    assert not EFFECTS["thermal_growth"].contribute(blind, np.array([1e-3, 100.0])).twists.any()


def test_loads_are_those_of_the_commanded_pose_whatever_the_controller_adds():
    shifted = _given(drive=ROBOT.inverse(_PLAN.targets()) + 0.002)
    np.testing.assert_array_equal(shifted.drive_load, _given().drive_load)
    assert shifted.drive[0, 0] == pytest.approx(_given().drive[0, 0] + 0.002)


@pytest.mark.parametrize("robot", [ROBOT, Ptt3(), Delta()], ids=lambda robot: robot.name)
def test_changes_at_the_drives_are_read_back(robot):
    """A change of an actuator value is a twist at its drive's site, which other sites' twists do not spoil."""
    place = {"rrru3": (-400.0, 20.0, 600.0), "ptt3": (5.0, 10.0, -250.0), "delta": (30.0, 20.0, 10.0)}[robot.name]
    target = np.add(place, np.random.default_rng(2).normal(size=(7, 3)))
    motion = make_motion(robot, Masses(), _course(robot, target))
    changes = np.random.default_rng(1).normal(size=(7, 3))
    twists = motion.at_drives(changes).twists
    assert {robot.legs.sites[k] for k in np.flatnonzero(twists.any(axis=(0, 2)))} == {
        f"leg {leg} drive" for leg in (1, 2, 3)
    }
    other = motion.at({"world": np.ones((1, 6)), robot.parts.feet[0]: np.ones((1, 6))}).twists
    np.testing.assert_allclose(robot.drive_errors(twists + other), changes, atol=1e-15)


def _course(robot, target):
    """A Course along positions (n, 3) of which nothing else is known."""
    still, drive, n = np.zeros_like(target), robot.inverse(target), len(target)
    return Course(target, drive, drive, np.arange(n), np.zeros(n), still, still, np.zeros(n))


def test_shifts_along_a_group_act_at_each_of_its_sites():
    robot = Delta()
    motion = make_motion(robot, Masses(), _course(robot, np.array([[10.0, 5.0, 0.0], [20.0, 5.0, 3.0]])))
    shifts = np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]])
    twists = motion.along(robot.parts.members, shifts).twists
    for k, group in enumerate(robot.parts.members):
        assert len(group) == 2
        for site in group:
            np.testing.assert_array_equal(twists[:, robot.legs.site_numbers[site], 0], shifts[:, k])
    assert not twists[:, :, 1:].any() and np.count_nonzero(twists.any(axis=(0, 2))) == 6


@pytest.mark.parametrize("turned", [False, True])
def test_drive_values_bring_the_nominal_robot_to_where_it_stands(turned):
    """A hexapod with known errors of its drives: these and the resulting pose are found."""
    robot = make_mechanism("hexapod", {"mjcf": str(HEXAPOD), "platform": "plate"}, parameter_set="zero")
    place = robot.legs.home_mm + np.random.default_rng(2).uniform(-30.0, 30.0, (20, 3))
    drive, off = robot.inverse(place), np.array([0.5, -0.3, 0.2, 0.0, -0.6, 0.4])
    poses = robot.solve(drive + off, place)
    found, at = standing(robot, (drive, place), (poses, robot.twists()), turned)
    # one linear step: a hundredth of the way is left
    np.testing.assert_allclose(at.poses.position_mm, poses.position_mm, atol=5e-3)
    if turned:
        np.testing.assert_allclose(found, drive + off, atol=5e-3)
        np.testing.assert_allclose(at.poses.turn, poses.turn, atol=1e-5)


def test_what_is_off_in_an_arms_drives_moves_its_loads_and_its_geometry_does_not():
    arm = make_mechanism("arm", {"urdf": str(ARM)}, parameter_set="full")
    drive, off = np.random.default_rng(3).uniform(-1.0, 1.0, (4, 6)), np.array([3.0, -2.0, 1.0, 0.5, -4.0, 2.0]) * 1e-3
    zeros = [f"d{column.removesuffix('_rad')}" for column in arm.parts.columns]
    for more in ({}, {"axis3_x": 2.0}):
        twists = arm.twists_of(dict(zip(zeros, off, strict=True)) | more)
        place = arm.forward(drive)
        found, at = standing(arm, (drive, place), (arm.solve(drive, place, twists), twists))
        np.testing.assert_allclose(found, drive + off, atol=1e-12)
        np.testing.assert_allclose(at.point_mm, arm.forward(drive + off), atol=1e-9)
