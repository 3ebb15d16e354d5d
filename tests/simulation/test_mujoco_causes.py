"""Causes in MuJoCo: each does what elementary mechanics says of its size, and what does not fit is refused."""

import mujoco
import numpy as np
import pytest

from rrru.errors import ConfigError
from rrru.robots.rrru3 import Rrru3
from rrru.simulation import mujoco_robot
from tests.refusals import refusals
from tests.simulation.simulated import G, file_of, mechanism, near_home, on_line, simulated, standing

_SPOTS = ((0.0, 0.0, 0.0), (60.0, 0.0, 20.0), (-40.0, 0.0, -30.0))
_BACK_AND_FORTH = ((-60.0, 0.0, 0.0), (-20.0, 0.0, 0.0), (20.0, 0.0, 0.0), (60.0, 0.0, 0.0), (20.0, 0.0, 0.0))


def _moment(drives, joint, gravity=(0.0, 0.0, -G)):
    """Moment in N mm of all weight behind a joint of the arm about its axis at drive values (6,): the lever rule."""
    model = mujoco.MjModel.from_xml_path(str(file_of("arm6")))
    data = mujoco.MjData(model)
    data.qpos[:] = drives
    mujoco.mj_kinematics(model, data)
    at, axis = data.joint(joint).xanchor, data.joint(joint).xaxis
    first = model.joint(joint).bodyid[0]
    lever = data.xipos[first:] - at
    return 1e3 * axis @ np.cross(lever, model.body_mass[first:, None] * np.array(gravity)).sum(axis=0)


def _turned(motion, position, joint):
    """Angle (n,) about a joint of the arm by which positions are off the commanded ones."""
    number = ["axis1", "axis2", "axis3", "axis4", "axis5", "axis6"].index(joint)
    column = mechanism("arm6").map_at(motion.drive, motion.position_mm).drive_response[:, :, number]
    return ((position - motion.position_mm) * column).sum(axis=1) / (column**2).sum(axis=1)


def test_a_soft_servo_sags_by_torque_over_stiffness():
    motion, position = standing(simulated("arm6", actuator_stiffness={"axis2": 2e8}), near_home("arm6", *_SPOTS))
    expected = [_moment(drives, "axis2") / 2e8 for drives in motion.drive]
    np.testing.assert_allclose(_turned(motion, position, "axis2"), expected, rtol=0.01)
    assert min(expected) > 1e-5


def test_a_flexible_forearm_bends_as_its_stiffness_says():
    """About the forearm's own y, at its joint: all that is behind it hangs on that spring."""
    motion, position = standing(simulated("arm6", link_stiffness={"forearm.ry": 1e7}), near_home("arm6", *_SPOTS))
    # at home its y is the world's: the moment about axis 5, moved to the forearm's joint 20 mm behind it
    stiff = standing(simulated("arm6"), near_home("arm6", *_SPOTS))[1]
    model = mujoco.MjModel.from_xml_path(str(file_of("arm6")))
    data = mujoco.MjData(model)
    for drives, off in zip(motion.drive, position - stiff, strict=True):
        data.qpos[:] = drives
        mujoco.mj_kinematics(model, data)
        at, turn = data.body("forearm").xpos, data.body("forearm").xmat.reshape(3, 3)
        behind = slice(model.body("forearm").id, None)
        weight = model.body_mass[behind, None] * [0.0, 0.0, -G]
        bent = turn[:, 1] @ np.cross(data.xipos[behind] - at, weight).sum(axis=0) * 1e3 / 1e7
        np.testing.assert_allclose(off, np.cross(bent * turn[:, 1], 1e3 * (data.body("tool0").xpos - at)), atol=2e-4)
        assert abs(bent) > 1e-5


@pytest.mark.parametrize(
    ("name", "drive", "width"), [("arm6", "axis1", 1e-3), ("rrru3", "drive1", 1e-3), ("hexapod", "leg3", 0.1)]
)
def test_play_is_lost_where_a_drive_turns_back_and_nowhere_else(name, drive, width):
    """Once the backlash is crossed the arm trails by half of it, on the other side after the drive has turned back."""
    robot, still = simulated(name, play={drive: width}), simulated(name)
    points = near_home(name, *(np.roll(spot, 1) if name == "arm6" else spot for spot in _BACK_AND_FORTH))
    motion, position = standing(robot, points)
    number = robot.mechanism.parts.columns.index(f"{drive}_{robot.mechanism.parts.units[0]}")
    column = robot.mechanism.map_at(motion.drive, points).drive_response[:, :, number]
    off = ((position - standing(still, points)[1]) * column).sum(axis=1) / (column**2).sum(axis=1)
    sense = np.sign(np.diff(motion.drive[:, number]))
    # how the first point was reached is another matter
    np.testing.assert_allclose(off[1:], -0.5 * width * sense, atol=0.02 * width)
    assert sense[-1] == -sense[-2] and (sense[:-1] == sense[0]).all()


def test_dry_friction_holds_a_soft_servo_back_on_both_sides():
    """It stops short by friction over stiffness, whichever way it came."""
    soft = {"actuator_stiffness": {"axis1": 2e8}}
    points = near_home("arm6", *(np.roll(spot, 1) for spot in _BACK_AND_FORTH))
    motion, position = standing(simulated("arm6", joint_friction={"axis1": 2e4}, **soft), points)
    sense = np.sign(np.diff(motion.drive[:, 0]))
    np.testing.assert_allclose(_turned(motion, position, "axis1")[1:], -1e-4 * sense, rtol=0.03)


def test_a_base_that_is_not_level_turns_the_load():
    """About its y by 0.1 rad: the weight then has a part along x."""
    causes = {"base_tilt": {"y": 0.1}, "actuator_stiffness": {"axis2": 2e8}}
    motion, position = standing(simulated("arm6", **causes), near_home("arm6", *_SPOTS))
    gravity = G * np.array([np.sin(0.1), 0.0, -np.cos(0.1)])
    expected = [_moment(drives, "axis2", gravity) / 2e8 for drives in motion.drive]
    np.testing.assert_allclose(_turned(motion, position, "axis2"), expected, rtol=0.01)
    assert abs(expected[0] - _moment(motion.drive[0], "axis2") / 2e8) > 0.05 * expected[0]


def test_a_hidden_mass_loads_a_soft_servo():
    causes = {"actuator_stiffness": {"axis2": 2e8}}
    points = near_home("arm6", *_SPOTS)
    motion, light = standing(simulated("arm6", **causes), points)
    heavy = standing(simulated("arm6", payload={"tool0": 3.0}, **causes), points)[1]
    hidden = simulated("arm6", **causes)
    position = hidden.positions(standing(hidden, points, payload_kg=3.0)[0])[0]
    np.testing.assert_allclose(heavy, position, atol=1e-5)
    # axis 2 is 60 mm from the robot's own axis
    more = 3.0 * G * (points[:, 0] - 60.0) / 2e8
    np.testing.assert_allclose(_turned(motion, heavy, "axis2") - _turned(motion, light, "axis2"), more, rtol=0.01)


@pytest.mark.parametrize("name", ["arm6", "hexapod"])
def test_a_base_on_springs_gives_by_weight_over_stiffness(name):
    robot = simulated(name, base_stiffness={"z": 500.0})
    points = near_home(name, (0.0, 0.0, 0.0), (30.0, 20.0, 10.0))
    light, heavy = (standing(robot, points, payload)[1] for payload in (0.0, 5.0))
    np.testing.assert_allclose(heavy - light, np.tile([0.0, 0.0, -5.0 * G / 500.0], (2, 1)), atol=2e-3)


@pytest.mark.parametrize(
    ("name", "site"),
    [("arm6", "axis2"), ("rrru3", "elbow1"), ("delta", "elbow2a"), ("delta", "ball1a"), ("hexapod", "ball1")],
)
def test_in_a_clearance_the_robot_hangs_lower_by_no_more_than_it(name, site):
    points = near_home(name, (0.0, 0.0, 0.0), (30.0, 20.0, 10.0))
    loose, tight = (standing(simulated(name, **causes), points)[1] for causes in ({"clearance": {site: 0.1}}, {}))
    up = np.asarray(mechanism(name).up)
    drop = (tight - loose) @ up
    assert (drop > 0.01).all()
    if name == "arm6":
        np.testing.assert_allclose(loose - tight, np.tile(-0.1 * up, (2, 1)), atol=1e-4)


def test_a_lag_is_read_in_motion_and_is_late_by_its_time():
    start, end = near_home("arm6", (0.0, -80.0, 0.0), (0.0, 80.0, 0.0))
    motion, position = on_line(simulated("arm6", servo_lag={"axis1": 0.01}), start, end, 9)
    rate = motion.drive_rate[:, 0]
    fast = np.abs(rate) > 0.9 * np.abs(rate).max()
    assert fast.sum() > 4
    np.testing.assert_allclose(_turned(motion, position, "axis1")[fast], -0.01 * rate[fast], rtol=0.01)
    at_rest = np.flatnonzero(rate == 0.0)
    assert len(at_rest) == 2 and np.abs(_turned(motion, position, "axis1")[at_rest]).max() < 1e-5


def test_friction_of_speed_grows_with_its_square():
    off = []
    for speed in (60.0, 120.0):
        start, end = near_home("arm6", (0.0, -80.0, 0.0), (0.0, 80.0, 0.0))
        motion, position = on_line(simulated("arm6", speed_friction={"axis1": 5e9}), start, end, 9, speed)
        off.append(_turned(motion, position, "axis1")[4] / np.abs(motion.drive_rate[4, 0] * motion.drive_rate[4, 0]))
    # the servo of 1e8 N m/rad has 1e11 N mm/rad
    np.testing.assert_allclose(np.abs(off), 5e9 / 1e11, rtol=0.02)


def test_lengths_and_seats_are_off_by_what_is_said():
    """Of the 3-RRRU's arm, as our closure has it; of the arm, a longer upper arm that stands upright at home."""
    points = near_home("rrru3", *_SPOTS)
    longer = standing(simulated("rrru3", placement={"crank1.x": 0.4}), points)[1]
    robot = Rrru3()
    expected = robot.solve(robot.inverse(points), points, robot.twists_of({"dL11": 0.4}))
    np.testing.assert_allclose(longer, expected.position_mm, atol=2e-3)
    home = near_home("arm6", (0.0, 0.0, 0.0), (0.0, 10.0, 0.0))
    raised = standing(simulated("arm6", placement={"elbow.z": 0.3}, zero_offset={"axis1": 1e-3}), home)[1]
    np.testing.assert_allclose(raised[0] - home[0], [0.0, 0.59, 0.3], atol=2e-3)


def test_warming_links_grow_with_time_towards_their_length():
    home = np.tile(near_home("arm6", (0.0, 0.0, 0.0), (0.0, 5.0, 0.0)), (4, 1))
    robot = simulated("arm6", warming={"elbow.z": 0.3, "time_s": 6.0})
    motion, position = standing(robot, home)
    still = standing(simulated("arm6"), home)[1]
    grown = 0.3 * (1.0 - np.exp(-motion.time_s / 6.0))
    upper = np.linalg.norm(position - still, axis=1)
    np.testing.assert_allclose(upper[1:], grown[1:], atol=2e-3)


@refusals("causes", "text")
def test_what_does_not_fit_the_file_is_refused(causes, text):
    with pytest.raises(ConfigError, match=text.replace("(", r"\(")):
        simulated("arm6", **causes).machine()


@pytest.mark.parametrize(
    ("section", "dimensions", "text"),
    [
        ({"effects": {"backlash": {"width1": 1e-3}}}, {"mjcf": "x.xml"}, "mujoco and effects in one entry"),
        ({"axis_errors": {"position_mm": 0.1}}, {"mjcf": "x.xml"}, "mujoco and axis_errors in one entry"),
        ({}, {"urdf": "x.urdf"}, "which has no mjcf; allowed"),
    ],
)
def test_a_section_that_is_not_mujocos_alone_is_refused(section, dimensions, text):
    with pytest.raises(ConfigError, match=text):
        mujoco_robot.from_config(mechanism("arm6"), dimensions, {"mujoco": {}} | section)
