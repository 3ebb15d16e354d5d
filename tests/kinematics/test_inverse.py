"""Actuator values of arms of unusual kinds: on rails, of slides alone, stretched; against known truths."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rrru.errors import UnreachableError
from rrru.formats.robot_file import from_mjcf
from rrru.kinematics.inverse import inverse_kinematics
from rrru.robots.catalogue import make_mechanism
from tests.formats.mjcf import CRANKED, CRANKED_JOINTS, mjcf, servos

_SIX = [
    {"d_mm": 290, "alpha_deg": -90, "range_deg": [-165, 165]},
    {"theta_deg": -90, "a_mm": 270, "range_deg": [-110, 110]},
    {"a_mm": 70, "alpha_deg": -90, "range_deg": [-110, 70]},
    {"d_mm": 302, "alpha_deg": 90, "range_deg": [-160, 160]},
    {"alpha_deg": -90, "range_deg": [-120, 120], "home_deg": 30},
    {"d_mm": 72, "range_deg": [-180, 180]},
]
# a slide along x and back to the frame before it
_RAIL = [{"rpy_deg": [0, 90, 0]}, {"sliding": True, "name": "rail", "range_mm": [0, 3000]}, {"rpy_deg": [0, -90, 0]}]
_SCARA = [
    {"d_mm": 300, "a_mm": 300, "range_deg": [-120, 120]},
    {"a_mm": 250, "range_deg": [-140, 140]},
    {"alpha_deg": 180, "sliding": True, "range_mm": [-100, 100]},
]


def _arm(rows, **options):
    return make_mechanism("arm", {"dh": rows, **options})


def test_an_arm_on_a_rail_reaches_what_its_rail_alone_would():
    robot = _arm(_RAIL + _SIX)
    points = robot.legs.home_mm + np.linspace(-1400.0, 1400.0, 15)[:, None] * [1.0, 0.0, 0.0]
    found = robot.inverse(points)
    np.testing.assert_allclose(robot.forward(found), points, rtol=0.0, atol=1e-6)
    turned = robot.solve(found, points).turn.transpose(0, 2, 1) @ robot.legs.home_turn
    assert np.abs(Rotation.from_matrix(turned).as_rotvec()).max() < 1e-8


def test_drives_that_share_a_way_go_by_the_squares_of_their_ranges():
    """The smallest sum of squares of shares of the ranges, of two slides along one line."""
    turns = [{"range_deg": [-1, 1]}, {"a_mm": 100, "alpha_deg": 90, "range_deg": [-1, 1]}]
    robot = _arm([{"sliding": True, "range_mm": [-50, 50]}, {"sliding": True, "range_mm": [-150, 150]}, *turns])
    found = robot.inverse(robot.legs.home_mm + np.array([[0.0, 0.0, 60.0]]))
    np.testing.assert_allclose(found, [[6.0, 54.0, 0.0, 0.0]], rtol=0.0, atol=1e-9)


def test_a_stretched_arm_finds_its_elbow_where_the_law_of_cosines_has_it():
    robot = _arm(_SCARA)
    radius = np.array([200.0, 400.0, 549.0, 551.0])
    points = np.stack([radius, np.zeros(4), np.full(4, 300.0)], axis=1)
    found = robot.inverse(points)
    elbow = np.arccos((radius[:3] ** 2 - 300.0**2 - 250.0**2) / (2.0 * 300.0 * 250.0))
    np.testing.assert_allclose(np.abs(found[:3, 1]), elbow, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(robot.forward(found[:3]), points[:3], rtol=0.0, atol=1e-6)
    assert np.isnan(found[3]).all()


def test_a_stretched_arm_stays_where_it_is_told_to():
    robot = _arm(_SCARA)
    np.testing.assert_allclose(robot.inverse(robot.legs.home_mm[None]), [robot.legs.home_drives], atol=1e-12)
    # with errors no exact place is asked for, but none far from it is one either
    far = robot.legs.home_mm + np.array([[50.0, 0.0, 0.0], [-50.0, 0.0, 0.0]])
    found = robot.inverse(far, robot.parameters.nominal)
    assert np.isnan(found[0]).all()
    np.testing.assert_allclose(robot.forward(found[1:]), far[1:], rtol=0.0, atol=1e-6)


def test_a_straight_wrist_turns_as_it_is_told():
    """The end effector's turn about the one axis that a straight wrist lacks."""
    robot = _arm([*_SIX[:4], _SIX[4] | {"home_deg": 0}, _SIX[5]])
    turn = robot.legs.home_turn @ Rotation.from_rotvec([0.3, 0.0, 0.0]).as_matrix()
    found = robot.inverse(robot.legs.home_mm[None], turn=turn[None])
    np.testing.assert_allclose(robot.forward(found), robot.legs.home_mm[None], rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(robot.solve(found, robot.legs.home_mm[None]).turn[0], turn, rtol=0.0, atol=1e-8)


def test_a_drive_without_a_range_harms_nothing():
    robot = _arm(_RAIL + _SIX)
    points = robot.legs.home_mm + np.array([[0.0, 40.0, 30.0]])
    for own in ([1500.0, 1500.0], [-np.inf, np.inf]):
        ranges = np.concatenate([[own], robot.drive_range[1:]])
        # whose degrees_of_freedom are those of the whole robot
        same = replace(robot, drive_range=ranges)
        same.__dict__["degrees_of_freedom"] = robot.degrees_of_freedom
        np.testing.assert_allclose(same.forward(same.inverse(points)), points, rtol=0.0, atol=1e-6)


def test_a_place_that_is_no_number_has_no_drives():
    robot = _arm(_SCARA)
    found = robot.inverse(np.array([[np.nan, 0.0, 300.0], [400.0, 50.0, 320.0]]))
    assert np.isnan(found[0]).all() and np.isfinite(found[1]).all()


def test_the_start_of_a_search_is_not_changed():
    robot = _arm(_SIX)
    points = robot.legs.home_mm + np.array([[0.0, 40.0, 30.0]])
    start = robot.legs.home_drives[None].copy(), robot.legs.home_mm[None].copy()
    found = inverse_kinematics(robot, (points, robot.legs.home_turn[None]), start, robot.twists())
    assert np.abs(found - robot.legs.home_drives).max() > 1e-3
    np.testing.assert_array_equal(start[0], robot.legs.home_drives[None])


def test_a_plan_keeps_within_the_ranges_of_the_drives():
    """A slide and a joint beyond theirs; what was measured there is still taken."""
    robot = _arm([_SCARA[0] | {"range_deg": [-60, 60]}, *_SCARA[1:]])
    shoulder, elbow = np.radians([59.0, 61.0, 0.0]), np.radians(40.0)
    drives = np.stack([shoulder, np.full(3, elbow), [0.0, 0.0, 101.0]], axis=1)
    points = robot.forward(drives)
    np.testing.assert_allclose(robot.forward(robot.inverse(points)), points, rtol=0.0, atol=1e-6)
    lost = [[False, False, False], [True, False, False], [False, False, True]]
    np.testing.assert_array_equal(np.isnan(robot.planned(points)), lost)
    with pytest.raises(UnreachableError, match=r"^point 2 at .* mm is out of the range of q1_rad; 2 of 3 points"):
        robot.require_reachable(points)
    np.testing.assert_array_equal(robot.require_reachable(points[:1]), robot.inverse(points[:1]))


def test_whole_turns_bring_joints_alone_into_their_ranges():
    """A slide has no whole turns, nor does a drive that another joint follows by half."""
    turn, rows = 2.0 * np.pi, [{"range_deg": [-170, 170]}, {"range_deg": [-90, 90]}, {"drives": {"q2": 0.5}}]
    robot = _arm([*rows, {"sliding": True, "range_mm": [-1.0, 1.0]}])
    values = np.array([0.1, 0.2, 0.3])
    np.testing.assert_allclose(robot.in_range((values + turn * np.eye(3))[:1]), [values], atol=1e-12)
    np.testing.assert_allclose(robot.in_range((values - 2.0 * turn * np.eye(3))[:1]), [values], atol=1e-12)
    np.testing.assert_array_equal(np.isnan(robot.in_range(values + turn * np.eye(3))), np.diag([False, True, True]))
    # the ends of the ranges belong to them, a place between 170 and 190 deg does not
    np.testing.assert_array_equal(robot.in_range(robot.drive_range.T), robot.drive_range.T)
    assert np.isnan(robot.in_range(np.array([[np.pi, 0.0, 0.0]]))[0, 0])


def test_a_drive_whose_range_nobody_states_may_leave_what_is_assumed(tmp_path):
    robot = from_mjcf(mjcf(tmp_path, CRANKED, actuators=servos(*CRANKED_JOINTS)), "tip")
    assert robot.assumed == set(robot.parts.columns[1:])
    beyond = robot.drive_range[None, :, 1] + 1.0
    assert np.isnan(robot.in_range(beyond)).tolist() == [[True] + 5 * [False]]


@pytest.mark.parametrize(("rows", "turned"), [(_SCARA, ""), (_SIX, ", with the platform turned as in the home pose")])
def test_an_arm_out_of_reach_has_no_legs_that_are(rows, turned):
    robot = _arm(rows)
    with pytest.raises(UnreachableError, match=rf"^point 1 at .* mm is out of reach{turned}; 1 of 1 points"):
        robot.require_reachable(np.array([[5000.0, 0.0, 300.0]]))
