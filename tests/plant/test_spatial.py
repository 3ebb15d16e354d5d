"""The spatial closure against eq. (8), a general solver on 18 equations, and physics."""

import numpy as np

from rrru.plant.spatial import SpatialGeometry
from rrru.robots.rrru3 import Rrru3
from tests.reference import rrru3_slow

_LENGTHS = np.tile([400.0, 400.0, 100.0, 800.0, 400.0], (3, 1))


def _solve(points, theta, lengths=_LENGTHS, deviations=None, **options):
    robot = Rrru3()
    geometry = SpatialGeometry(
        np.array(robot.azimuth_rad), lengths, np.zeros((3, 6, 6)) if deviations is None else deviations
    )
    return geometry.solve(theta, robot.passive_angles(points, robot.inverse(points)), **options)


def test_parallel_axes_give_eq_8_for_any_lengths(rich_poses):
    points, theta = rich_poses
    generator = np.random.default_rng(0)
    robot = Rrru3(parameter_set="published")
    deviations = generator.uniform(-1, 1, 14) * np.r_[[0.01] * 3, [2.0] * 11]
    lengths = _LENGTHS.copy()
    lengths[:, 1:4] += deviations[3:12].reshape(3, 3)
    lengths[:, 0] += deviations[12]
    lengths[:, 4] += deviations[13]
    solution = _solve(points, theta + deviations[:3], lengths)
    assert solution.converged.all()
    np.testing.assert_allclose(solution.position_mm, robot.forward(theta, deviations, points), atol=1e-8)
    assert np.abs(solution.rotation_rad).max() < 1e-12


def test_crooked_axes_equal_a_general_solver(rich_poses):
    points, theta = rich_poses
    generator = np.random.default_rng(1)
    deviations = generator.normal(size=(3, 6, 6)) * np.repeat([0.3, 0.001], 3)
    shift = generator.normal(0.0, 0.2, (len(points), 3, 3))
    solution = _solve(points, theta, deviations=deviations, joint_shift_mm=shift)
    passive = Rrru3().passive_angles(points, theta)
    for k in range(8):
        guess = np.concatenate([passive[k].ravel(), np.zeros(3), points[k]])
        pose = rrru3_slow.close(theta[k], _LENGTHS, deviations, guess, shift[k])
        np.testing.assert_allclose(solution.position_mm[k], pose[:3, 3], atol=1e-7)
        np.testing.assert_allclose(
            solution.rotation_rad[k], (pose[[2, 0, 1], [1, 2, 0]] - pose[[1, 2, 0], [2, 0, 1]]) / 2, atol=1e-9
        )
    assert np.linalg.norm(solution.rotation_rad, axis=1).min() > 1e-5


def test_one_link_deviation_equals_the_length_that_it_adds(rich_poses):
    points, theta = rich_poses
    deviations = np.zeros((3, 6, 6))
    deviations[1, 3, 0] = 0.7
    lengths = _LENGTHS.copy()
    lengths[1, 3] += 0.7
    np.testing.assert_allclose(
        _solve(points, theta, deviations=deviations).position_mm, _solve(points, theta, lengths).position_mm, atol=1e-8
    )


def test_lengths_of_their_own_at_every_point_equal_one_robot_per_point(rich_poses):
    points, theta = rich_poses
    grown = _LENGTHS + np.random.default_rng(3).uniform(-1.0, 1.0, (len(points), 3, 5))
    together = _solve(points, theta, grown)
    for k in range(6):
        alone = _solve(points[k : k + 1], theta[k : k + 1], grown[k])
        np.testing.assert_allclose(together.position_mm[k], alone.position_mm[0], atol=1e-8)
    everywhere = _solve(points, theta, np.broadcast_to(grown[0], grown.shape))
    np.testing.assert_array_equal(everywhere.position_mm, _solve(points, theta, grown[0]).position_mm)


def test_turning_the_whole_base_turns_the_whole_robot(rich_poses):
    """The same small rotation of all three legs about the base's z axis turns the platform by it."""
    points, theta = rich_poses
    turn = 0.002
    geometry = SpatialGeometry(np.array(Rrru3().azimuth_rad) + turn, _LENGTHS, np.zeros((3, 6, 6)))
    solution = geometry.solve(theta, Rrru3().passive_angles(points, theta))
    c, s = np.cos(turn), np.sin(turn)
    np.testing.assert_allclose(
        solution.position_mm, points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]), atol=1e-8
    )


def test_points_without_solution_are_said_so(rich_poses):
    points, theta = rich_poses
    lengths = _LENGTHS.copy()
    lengths[:, 3] = 200.0
    solution = _solve(points[:5], theta[:5], lengths)
    assert not solution.converged.any() and np.isnan(solution.position_mm).all()
