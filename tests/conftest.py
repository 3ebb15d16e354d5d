"""Poses that many tests share."""

import os

# one thread for linear algebra, as snakemake gives its scripts: sums are the same and two workers do not compete
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402
import pytest  # noqa: E402

from rrru.kinematics import singularity  # noqa: E402
from rrru.robots.rrru3 import Rrru3  # noqa: E402


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


# folders and files that take longest
_LONGEST = ("workflow", "blind_validation", "real", "ingest", "data_check", "diagnosis", "test_cli.py")


def pytest_collection_modifyitems(items):
    """Long files begin first: a worker that begins one at the end works alone."""

    def rank(item):
        return next((number for number, name in enumerate(_LONGEST) if name in item.path.parts), len(_LONGEST))

    items.sort(key=rank)
