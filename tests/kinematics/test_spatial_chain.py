"""The general model on the 3-RRRU against chains closed in space, a general solver on 18 equations, and physics."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rrru.robots.rrru3 import Rrru3
from tests.reference import rrru3_slow, spatial_chain
from tests.reference.spatial_chain import LENGTHS, PLACES

ROBOT = Rrru3()
_NONE = np.zeros((3, len(PLACES), 6))


def _twists(displacements):
    """Twists (n or 1, sites, 6) of the package from displacements (.., 3 legs, 8, 6) of the chains."""
    displacements = np.reshape(displacements, (-1, 3, len(PLACES), 6))
    result = np.zeros((len(displacements), len(ROBOT.legs.sites), 6))
    for leg in range(3):
        for k, place in enumerate(PLACES):
            result[:, ROBOT.legs.site_numbers[f"leg {leg + 1} {place}"]] = displacements[:, leg, k]
    return result


def _crooked(seed, count=1, sizes=(0.3, 0.001)):
    """Random displacements (count, 3, 8, 6) of given sizes in mm and rad."""
    return np.random.default_rng(seed).normal(size=(count, 3, len(PLACES), 6)) * np.repeat(sizes, 3)


def _passive(points):
    return ROBOT.passive_angles(points, ROBOT.inverse(points))


def _rotation(poses):
    """Rotation vectors (n, 3) of platforms that nominally stand upright."""
    return poses.turned_from(np.broadcast_to(np.eye(3), poses.turn.shape))


def test_the_chains_have_a_displacement_at_every_site_of_a_leg():
    named = [f"leg {leg} {place}" for leg in (1, 2, 3) for place in PLACES]
    assert ("world", *named, "tool") == ROBOT.legs.sites


@pytest.mark.parametrize("count", [1, 200])
def test_crooked_axes_equal_the_chains(rich_poses, count):
    """The same displacements at all points, or others at every point."""
    points, theta = rich_poses
    displacements = _crooked(1, count)
    poses = ROBOT.solve(theta, points, _twists(displacements))
    position, turn = spatial_chain.close(LENGTHS, displacements, theta, _passive(points))
    assert poses.closed.all()
    np.testing.assert_allclose(poses.position_mm, position, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(poses.turn, turn, rtol=0.0, atol=1e-12)
    assert np.linalg.norm(_rotation(poses), axis=1).min() > 1e-5


def test_crooked_axes_equal_a_general_solver(rich_poses):
    points, theta = rich_poses
    displacements = _crooked(2)
    poses = ROBOT.solve(theta[:8], points[:8], _twists(displacements))
    for k in range(8):
        guess = np.concatenate([_passive(points)[k].ravel(), np.zeros(3), points[k]])
        pose = rrru3_slow.close(theta[k], LENGTHS, displacements[0], guess)
        np.testing.assert_allclose(poses.position_mm[k], pose[:3, 3], atol=1e-7)
        np.testing.assert_allclose(poses.turn[k], pose[:3, :3], atol=1e-9)


def test_parallel_axes_give_eq_8_for_any_lengths(rich_poses):
    """The chains with other lengths, the general model with its twists for them, and eq. (8)."""
    points, theta = rich_poses
    robot = Rrru3(parameter_set="published")
    deviations = np.random.default_rng(0).uniform(-1, 1, 14) * np.r_[[0.01] * 3, [2.0] * 11]
    lengths = LENGTHS.copy()
    lengths[:, 1:4] += deviations[3:12].reshape(3, 3)
    lengths[:, 0] += deviations[12]
    lengths[:, 4] += deviations[13]
    position, turn = spatial_chain.close(lengths, _NONE, theta + deviations[:3], _passive(points))
    np.testing.assert_allclose(position, robot.forward(theta, deviations, points), atol=1e-8)
    assert np.abs(turn - np.eye(3)).max() < 1e-12
    poses = robot.solve(theta, points, robot.twists(deviations))
    np.testing.assert_allclose(poses.position_mm, position, rtol=0.0, atol=1e-9)
    assert np.abs(_rotation(poses)).max() < 1e-12


def test_one_link_deviation_equals_the_length_that_it_adds(rich_poses):
    points, theta = rich_poses
    displacements, lengths = _NONE.copy(), LENGTHS.copy()
    displacements[1, PLACES.index("wrist"), 0] = 0.7
    lengths[1, 3] += 0.7
    poses = ROBOT.solve(theta, points, _twists(displacements))
    position, _ = spatial_chain.close(lengths, _NONE, theta, _passive(points))
    np.testing.assert_allclose(poses.position_mm, position, rtol=0.0, atol=1e-9)


def test_twists_of_their_own_at_every_point_equal_one_robot_per_point(rich_poses):
    points, theta = rich_poses
    twists = _twists(_crooked(3, len(points), (1.0, 0.002)))
    together = ROBOT.solve(theta, points, twists)
    for k in range(6):
        alone = ROBOT.solve(theta[k : k + 1], points[k : k + 1], twists[k : k + 1])
        np.testing.assert_allclose(together.position_mm[k], alone.position_mm[0], rtol=0.0, atol=1e-9)
    everywhere = ROBOT.solve(theta, points, np.tile(twists[:1], (len(points), 1, 1)))
    np.testing.assert_array_equal(everywhere.position_mm, ROBOT.solve(theta, points, twists[:1]).position_mm)


def test_turning_the_whole_base_turns_the_whole_robot(rich_poses):
    """The same rotation of all three legs about the base's z axis turns the platform by it; its sides may turn back."""
    points, theta = rich_poses
    turn = 0.002
    turned = Rotation.from_rotvec([0.0, 0.0, turn])
    displacements = _NONE.copy()
    displacements[:, PLACES.index("root"), 5] = turn
    poses = ROBOT.solve(theta, points, _twists(displacements))
    np.testing.assert_allclose(poses.position_mm, turned.apply(points), rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(_rotation(poses), np.tile([0.0, 0.0, turn], (len(points), 1)), atol=1e-12)
    other = Rrru3(azimuth_rad=tuple(np.array(ROBOT.azimuth_rad) + turn))
    np.testing.assert_allclose(other.solve(theta, points).position_mm, turned.apply(points), rtol=0.0, atol=1e-9)
    position, _ = spatial_chain.close(LENGTHS, _NONE, theta, _passive(points), spatial_chain.AZIMUTH + turn)
    np.testing.assert_allclose(position, turned.apply(points), rtol=0.0, atol=1e-9)


def test_points_without_solution_are_said_so(rich_poses):
    points, theta = rich_poses
    displacements = _NONE.copy()
    displacements[:, PLACES.index("wrist"), 0] = -600.0
    poses = ROBOT.solve(theta[:5], points[:5], _twists(displacements))
    assert not poses.closed.any() and np.isnan(poses.position_mm).all() and np.isnan(_rotation(poses)).all()
    # they do not harm others
    mixed = _twists(np.concatenate([displacements[None], _crooked(4)]))
    poses = ROBOT.solve(theta[:2], points[:2], mixed)
    alone = ROBOT.solve(theta[1:2], points[1:2], mixed[1:])
    assert poses.closed.tolist() == [False, True]
    np.testing.assert_allclose(poses.position_mm[1], alone.position_mm[0], rtol=0.0, atol=1e-9)
