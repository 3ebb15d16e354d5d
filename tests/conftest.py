"""Poses that many tests share."""

import os

# one thread for linear algebra, as snakemake gives its scripts: sums are the same and two workers do not compete
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
# some environments forbid to keep compiled modules: each of some hundred jobs would compile those of the package anew
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

import numpy as np  # noqa: E402
import pytest  # noqa: E402

from tests import compile_once  # noqa: E402

compile_once.install()

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


@pytest.fixture
def quick_figures(monkeypatch):
    """Fewer points in pictures and simple fonts, which take a third of a figure's time otherwise."""
    from rrru.figures import style

    monkeypatch.setattr(style, "_DPI", 100)
    monkeypatch.setitem(style._STYLE, "pdf.fonttype", 3)


# Files that take longest, in the order in which workers get them: a worker that begins one at the end works alone.
# The first makes the run that files of `workflow` share; whoever needs it meanwhile waits, so the second does not.
_FIRST = (
    "workflow/test_delta.py",
    "workflow/test_own_robot.py",
    "test_cli.py",
    "real/test_irb120.py",
    "real/test_ur10.py",
    "diagnosis/test_diagnose.py",
    "real/test_chains.py",
    "data_check/test_check_data.py",
    "workflow/test_circle.py",
    "workflow/test_docs.py",
    "workflow/test_run.py",
    "workflow/test_gap.py",
    "ingest/test_gross_errors.py",
    "correction/test_corrected_model.py",
    "diagnosis/test_stated_motion.py",
    "figures/test_figures.py",
    "workflow/test_refusals.py",
    "diagnosis/test_budget.py",
    "diagnosis/test_noise_model.py",
    "test_package.py",
)


# then folders of which every file takes some time
_NEXT = ("workflow", "blind_validation", "real", "ingest", "diagnosis")


def pytest_collection_modifyitems(items):
    """Long files begin first."""
    rank = {name: number for number, name in enumerate((*_FIRST, *_NEXT))}

    def place(item):
        path = item.path
        names = (f"{path.parent.name}/{path.name}", path.name, *path.parts)
        return min(rank.get(name, len(rank)) for name in names)

    items.sort(key=place)
