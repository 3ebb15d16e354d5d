"""Rotary Delta: paper C's equations (1) to (6) from its vector loops, its frames and its symmetries."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rrru.robots.delta import Delta
from tests.reference import tripods_slow

BETA = np.array([-np.pi / 6.0, np.pi / 2.0, 7.0 * np.pi / 6.0])
_DEPTH = np.sqrt(900.0**2 - 500.0**2)


def _inside(count=30, seed=0):
    """Positions (count, 3) in mm about the calibration frame's origin."""
    return np.random.default_rng(seed).uniform([-300.0, -300.0, -150.0], [300.0, 300.0, 150.0], (count, 3))


@pytest.fixture(scope="module")
def closed():
    """Drive angles (30, 3), positions (30, 3) and links' directions (30, 3, 3) that a general solver closes."""
    theta = np.random.default_rng(1).uniform(-0.5, 0.6, (30, 3))
    solved = [
        tripods_slow.delta_close(t, BETA, 375.0, 900.0, 125.0, _DEPTH, np.array([0.0, 0.0, -20.0])) for t in theta
    ]
    return theta, np.array([s[0] for s in solved]), np.array([s[1] for s in solved])


def test_forward_inverse_and_links_equal_the_vector_loops(closed):
    theta, position, links = closed
    robot = Delta()
    np.testing.assert_allclose(robot.forward(theta), position, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(robot.inverse(position), theta, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(robot.link_directions(position, theta), links, rtol=0.0, atol=1e-9)


def test_zero_errors_move_the_platform_as_eqs_3_to_6_say(closed):
    theta, position, links = closed
    slow = [tripods_slow.delta_zero_jacobian(t, BETA, 375.0, w) for t, w in zip(theta, links, strict=True)]
    robot = Delta()
    np.testing.assert_allclose(robot.parameter_jacobian(position, theta), slow, rtol=1e-8, atol=1e-7)
    step = np.array([1e-6, -2e-6, 1.5e-6])
    moved = [
        tripods_slow.delta_close(t + step, BETA, 375.0, 900.0, 125.0, _DEPTH, p)[0] - p
        for t, p in zip(theta[:5], position[:5], strict=True)
    ]
    np.testing.assert_allclose(np.array(slow[:5]) @ step, moved, rtol=1e-4, atol=1e-7)


def test_a_zero_error_is_a_shift_of_the_drive(closed):
    theta = closed[0]
    deviations = np.array([0.003, -0.002, 0.001])
    np.testing.assert_allclose(
        Delta().forward(theta, deviations), Delta().forward(theta + deviations), rtol=0.0, atol=1e-10
    )


def test_errors_of_every_leg_are_errors_of_its_dimensions():
    robot = Delta(parameter_set="tied")
    theta = robot.inverse(_inside())
    moved = robot.forward(theta, robot.parameters.vector({"dl1": 0.5, "dl2": -0.7, "da": 0.3}))
    other = Delta(l1_mm=375.5, l2_mm=899.3, a_mm=125.3)
    # the other robot's frame has its origin at the other robot's zero
    apart = np.array([0.0, 0.0, robot.origin_depth_mm - other.origin_depth_mm])
    np.testing.assert_allclose(moved, other.forward(theta) + apart, atol=1e-9)


def test_the_second_drive_axis_lies_on_y():
    robot = Delta()
    np.testing.assert_allclose(np.exp(1j * np.array(robot.azimuth_rad)), np.exp(1j * BETA), atol=1e-15)
    feet = robot.ends(np.zeros((1, 3)), robot.numbers())[0] - robot.l1_mm * robot.radial
    np.testing.assert_allclose(feet[1], [0.0, 125.0, _DEPTH], atol=1e-9)


def test_arms_are_level_at_the_calibration_frames_origin():
    robot = Delta()
    np.testing.assert_allclose(robot.inverse([[0.0, 0.0, 0.0]]), 0.0, atol=1e-12)
    ends = robot.ends(np.zeros((1, 3)), robot.numbers())[0]
    np.testing.assert_allclose(ends[:, 2], _DEPTH)
    np.testing.assert_allclose(np.linalg.norm(ends, axis=1), 900.0)


def test_lowering_all_arms_lowers_the_platform_on_the_axis():
    theta = np.linspace(-0.5, 0.9, 15)
    position = Delta().forward(np.tile(theta[:, None], (1, 3)))
    np.testing.assert_allclose(position[:, :2], 0.0, atol=1e-9)
    assert (np.diff(position[:, 2]) < 0.0).all()
    # on the axis the link is the long side of an upright triangle
    drop = np.sqrt(900.0**2 - (125.0 + 375.0 * np.cos(theta)) ** 2)
    np.testing.assert_allclose(position[:, 2], _DEPTH - 375.0 * np.sin(theta) - drop, atol=1e-9)


def test_turning_by_a_third_passes_the_drives_on_and_a_mirror_swaps_two():
    robot, points = Delta(), _inside()
    theta = robot.inverse(points)
    turned = Rotation.from_euler("z", 120.0, degrees=True).apply(points)
    np.testing.assert_allclose(robot.inverse(turned), np.roll(theta, 1, axis=1), atol=1e-10)
    np.testing.assert_allclose(robot.inverse(points * [-1.0, 1.0, 1.0]), theta[:, [2, 1, 0]], atol=1e-10)


def test_knees_point_outwards():
    robot, points = Delta(), _inside()
    legs = robot.numbers()
    ends = robot.ends(robot.inverse(points), legs)
    feet = robot.a_mm * robot.radial + np.array([0.0, 0.0, robot.origin_depth_mm])
    outward = ((ends - feet) * robot.radial).sum(axis=-1)
    # the other solution mirrors the knee in the plane through the drive axis and the platform
    to_platform = points[:, None, :] - feet
    plane = np.cross(robot.tangent, to_platform)
    plane /= np.linalg.norm(plane, axis=-1, keepdims=True)
    mirrored = (ends - feet) - 2.0 * ((ends - feet) * plane).sum(axis=-1, keepdims=True) * plane
    np.testing.assert_allclose(np.linalg.norm(mirrored + feet - points[:, None, :], axis=-1), 900.0)
    assert (outward > (mirrored * robot.radial).sum(axis=-1)).all()


def test_a_parallelogram_resists_turning_about_its_couple_only():
    """Two rods s apart along the tangent: a turn of the platform changes the difference of their lengths only by its
    share of the couple.
    """
    robot, points = Delta(), _inside()
    theta = robot.inverse(points)
    constraint_moments, links = robot.constraint_moments(points, theta), robot.link_directions(points, theta)
    for leg in range(3):
        for axis, about in (
            (constraint_moments[:, leg], True),
            (links[:, leg], False),
            (np.tile(robot.tangent[leg], (len(points), 1)), False),
        ):
            half = 40.0 * robot.tangent[leg]
            lengths = [
                np.linalg.norm(900.0 * links[:, leg] + 1e-5 * np.cross(axis, side), axis=-1) for side in (half, -half)
            ]
            change = np.abs(lengths[0] - lengths[1])
            assert (change > 1e-4).all() if about else (change < 1e-9).all()
