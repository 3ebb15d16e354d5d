"""The audit of paper C against the full, nonlinear kinematics."""

import numpy as np
import pytest

from rrru.calibration.calibrate import calibrate
from rrru.estimation.observations.target_positions import TargetPositions
from rrru.robots.delta import Delta
from rrru.studies.delta import audit


def _values(text):
    """Printed and right value of the one computed finding whose check contains a text."""
    (finding,) = (finding for finding in audit.COMPUTED if text in finding.check)
    return finding.values()[:2]


def test_what_the_scan_lacks_is_named():
    rows = audit.audit_rows()
    assert set(rows.loc[rows["kind"] == "lost", "where"]) >= {"Table 1", "eq. (1)", "dimensions"}


def test_only_the_minus_sign_puts_the_second_axis_on_y():
    assert _values("with +pi/6 and with -pi/6") == pytest.approx((60.0, 0.0), abs=1e-6)
    assert _values("beta_2 + pi/2") == pytest.approx((180.0, 0.0), abs=1e-6)


def test_what_distances_see_by_driving_the_robot_with_wrong_zeros():
    """Distances and positions of the nonlinear robot for the least seen combination, found from its own distances."""
    robot, points = Delta(), audit.disc(100.0, 200.0, 20)
    theta = robot.inverse(points)

    def seen(deviations):
        moved = robot.forward(theta, deviations)
        return moved, np.linalg.norm(moved[1:] - moved[0], axis=1)

    step = 1e-5
    columns = [(seen(step * e)[1] - seen(-step * e)[1]) / (2.0 * step) for e in np.eye(3)]
    _, sizes, directions = np.linalg.svd(np.stack(columns, axis=1))
    assert _values("x, y displacements, and distances")[1] == pytest.approx(sizes[0] / sizes[2], rel=1e-4)
    weak = directions[2] / 375.0
    nominal, moved = seen(np.zeros(3)), seen(1e-2 * weak)
    stretch = 100.0 * np.sqrt(((moved[1] - nominal[1]) ** 2).mean())
    shift = 100.0 * np.sqrt(((moved[0] - nominal[0]) ** 2).sum(axis=1).mean())
    assert _values("least observable zero errors") == pytest.approx((stretch, shift), rel=1e-3)


def test_what_wrong_lengths_leave_by_drawing_robots():
    """Forty robots with lengths off by 0.1 mm, each with its best zero offsets.

    Squares of few normal numbers scatter as much as their mean does, at most sqrt(2) times it: the rms of forty within
    4 x 1.41 / 2 / sqrt(40).
    """
    robot, legs, points = Delta(), Delta(parameter_set="legs"), audit.disc(0.0, 300.0, 200)
    theta = robot.inverse(points)
    generator, squares = np.random.default_rng(0), []
    for _ in range(40):
        deviations = np.r_[np.zeros(3), generator.normal(0.0, 0.1, 9)]
        squares.append(calibrate(TargetPositions(robot, theta, legs.forward(theta, deviations), points)).rms_mm ** 2)
    exact, left = _values("best zero offsets")
    assert exact == 0.0 and left == pytest.approx(
        np.sqrt(np.mean(squares)), rel=4.0 * np.sqrt(2.0) / 2.0 / np.sqrt(40.0)
    )


def test_what_a_levelled_arm_means_on_the_plane():
    robot, points = Delta(), audit.disc(0.0, 300.0, 200)
    theta = robot.inverse(points)
    squares = [((robot.forward(theta, np.radians(0.1) * e) - points) ** 2).sum(axis=1).mean() for e in np.eye(3)]
    tenth, one = _values("0.1 and of 1 degree")
    assert tenth == pytest.approx(np.sqrt(np.sum(squares)), rel=1e-3) and one == pytest.approx(10.0 * tenth)
