"""Poses that many tests share."""

import numpy as np
import pytest

from rrru.robots import singularity
from rrru.robots.rrru3 import Rrru3


@pytest.fixture(scope="session")
def rich_poses():
    """Positions (200, 3) in mm spread over the workspace, clear of both singularities by 0.15, and their drive
    angles.
    """
    robot = Rrru3()
    points = np.random.default_rng(5).uniform([-500.0, -400.0, 450.0], [500.0, 400.0, 950.0], (2000, 3))
    theta = robot.inverse(points)
    clear = (singularity.translational_measure(robot, points, theta) > 0.15) & (
        singularity.constraint_measure(robot, points, theta) > 0.15
    )
    assert clear.sum() >= 200
    return points[clear][:200], theta[clear][:200]
