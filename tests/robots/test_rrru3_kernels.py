"""The compiled objective against the plain loop."""

import numpy as np

from rrru.estimation.observations.target_positions import TargetPositions
from rrru.robots.rrru3 import Rrru3
from tests.reference import rrru3_slow


def _residuals(rich_poses, count=30):
    points, theta = rich_poses
    robot = Rrru3(parameter_set="tied")
    measured = points[:count] + np.random.default_rng(0).normal(0.0, 2.0, (count, 3))
    return TargetPositions(robot, theta[:count], measured, points[:count])


def test_mean_distance_equals_the_slow_loop_within_1e_9_mm(rich_poses):
    residuals = _residuals(rich_poses)
    robot = residuals.mechanism
    generator = np.random.default_rng(3)
    for size in (1.0, 0.1, 0.0):
        deviations = generator.uniform(-size, size, (4, 8)) * np.where(
            [u == "rad" for u in robot.parameters.units], 0.03, 4.0
        )
        slow = []
        for legs in robot.numbers(deviations):
            positions = [
                rrru3_slow.forward(theta, legs, start)
                for theta, start in zip(residuals.actuators, residuals.start_mm, strict=True)
            ]
            slow.append(np.linalg.norm(np.array(positions) - residuals.measured_mm, axis=1).mean())
        np.testing.assert_allclose(residuals.mean_distance(deviations), slow, rtol=0.0, atol=1e-9)


def test_population_and_single_vectors_give_the_same_bytes(rich_poses):
    residuals = _residuals(rich_poses)
    deviations = np.random.default_rng(4).uniform(-1, 1, (7, 8)) * np.r_[[0.01] * 3, [1.0] * 5]
    together = residuals.mean_distance(deviations)
    assert together.tolist() == [residuals.mean_distance(one[None])[0] for one in deviations]


def test_a_model_out_of_reach_counts_as_infinite(rich_poses):
    residuals = _residuals(rich_poses)
    deviations = np.zeros((2, 8))
    deviations[1, 5] = -790.0
    value = residuals.mean_distance(deviations)
    assert np.isfinite(value[0]) and np.isinf(value[1])
