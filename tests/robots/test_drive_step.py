"""Actuator values of arms of unusual kinds: on rails, of slides alone, stretched; against known truths."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.robots.catalogue import make_mechanism

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
    """The hand's turn about the one axis that a straight wrist lacks."""
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
        # whose freedoms are those of the whole robot
        same = replace(robot, drive_range=ranges)
        same.__dict__["freedoms"] = robot.freedoms
        np.testing.assert_allclose(same.forward(same.inverse(points)), points, rtol=0.0, atol=1e-6)


def test_a_place_that_is_no_number_has_no_drives():
    robot = _arm(_SCARA)
    found = robot.inverse(np.array([[np.nan, 0.0, 300.0], [400.0, 50.0, 320.0]]))
    assert np.isnan(found[0]).all() and np.isfinite(found[1]).all()
