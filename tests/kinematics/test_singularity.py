"""Both singularity measures against facts computed apart from this project, the 12 x 12 closure and what a lock-up
means.
"""

import numpy as np
import pytest

from rrru.kinematics import singularity, workspace
from rrru.robots.catalogue import make_mechanism
from rrru.robots.rrru3 import Rrru3
from tests.reference.spatial_chain import closure_determinant


def _line(y, x):
    points = np.stack([x, np.full_like(x, y), np.full_like(x, 600.0)], axis=1)
    return points, Rrru3().inverse(points)


def test_translational_measure_on_group_1_is_the_sourced_one():
    measure = singularity.translational_measure(Rrru3(), *_line(0.0, np.linspace(-800.0, -300.0, 26)))
    assert measure.min() == pytest.approx(0.276, abs=5e-4)


def test_the_line_in_the_turned_frame_crosses_a_singularity_near_782():
    x = np.linspace(700.0, 800.0, 1001)
    determinant = np.linalg.det(singularity.leg_forces(Rrru3(), *_line(0.0, x)))
    crossing = x[np.flatnonzero(np.diff(np.sign(determinant)))]
    assert crossing == pytest.approx([782.0], abs=1.0)


@pytest.mark.parametrize("y", [0.0, 112.5, -112.5])
def test_constraint_determinant_changes_sign_with_the_spatial_closure(y):
    points, theta = _line(y, np.linspace(-800.0, -700.0, 101))
    robot = Rrru3()
    small = singularity.constraint_determinant(robot, points, theta)
    full = closure_determinant(theta, robot.passive_angles(points, theta))
    change = np.flatnonzero(np.diff(np.sign(small)))
    assert change.tolist() == np.flatnonzero(np.diff(np.sign(full))).tolist()
    assert len(change) == 1 and -790.0 <= points[change[0], 0] <= -779.0


def test_closure_determinant_is_the_product_of_both_singularities(rich_poses):
    """det(12 x 12) / (det of forces x det of couples) depends on the passive chains only and never vanishes in the
    workspace.
    """
    points, theta = rich_poses
    robot = Rrru3()
    full = closure_determinant(theta, robot.passive_angles(points, theta))
    forces = np.linalg.det(singularity.leg_forces(robot, points, theta))
    constraint_moments = np.linalg.det(robot.constraint_moments(points, theta))
    ratio = np.abs(full / (forces * constraint_moments))
    assert ratio.min() > 0.2 * np.median(ratio)


def test_locked_drives_resist_along_the_leg_forces_only(rich_poses):
    """A small displacement across two legs' directions changes only the third leg's closure."""
    points, theta = rich_poses
    robot = Rrru3()
    force = singularity.leg_forces(robot, points, theta)
    free = np.cross(force[:, 0], force[:, 1])
    change = robot.closure(points + 1e-4 * free, theta)
    assert np.abs(change[:, :2]).max() < 1e-4 * np.abs(change[:, 2]).max()


def test_workspace_slice_is_reachable_exactly_where_the_inverse_exists():
    points = workspace.slice_points("xz", 25.0, (-1000.0, 1000.0), (100.0, 1300.0), 50.0)
    assert (points[:, 1] == 25.0).all() and len(points) == 41 * 25
    reachable, translational, constraint, _ = workspace.measures(Rrru3(), points, Rrru3().planned(points))
    assert (reachable == np.isfinite(Rrru3().inverse(points)).all(axis=1)).all()
    assert 0 < reachable.sum() < len(points)
    assert np.isfinite(translational[reachable]).all() and np.isnan(constraint[~reachable]).all()


def test_the_measure_of_a_scara_is_that_of_its_two_links_and_its_slide():
    """Closed form: the planar Jacobian of two links by the characteristic length, and 1 for the slide; see Craig."""
    links, characteristic_length_mm = (400.0, 300.0), 500.0
    dh = [{"a_mm": links[0], "range_deg": [-170, 170]}, {"a_mm": links[1], "alpha_deg": 180, "range_deg": [-170, 170]}]
    robot = make_mechanism("scara", {"dh": [*dh, {"sliding": True, "range_mm": [0, 200]}]})
    assert robot.characteristic_length_mm == characteristic_length_mm
    drives = np.random.default_rng(3).uniform([-2.0, -2.5, 10.0], [2.0, 2.5, 190.0], (50, 3))
    drives[0, 1] = 0.0  # stretched
    measure, *_ = robot.singularities(robot.forward(drives), drives)
    for (first, second, _), found in zip(drives, measure, strict=True):
        upper, lower = links[0] * np.exp(1j * first), links[1] * np.exp(1j * (first + second))
        planar = [1j * (upper + lower), 1j * lower]
        jacobian = np.zeros((3, 3))
        jacobian[:2, :2] = (
            np.array([[one.real for one in planar], [one.imag for one in planar]]) / characteristic_length_mm
        )
        jacobian[2, 2] = 1.0
        size = np.linalg.svd(jacobian, compute_uv=False)
        assert found == pytest.approx(size[-1] / size[0], abs=1e-9)
    assert measure[0] == pytest.approx(0.0, abs=1e-9) and np.median(measure) > 0.2
