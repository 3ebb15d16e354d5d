"""The audit rows of papers B and C against the full, nonlinear kinematics and hand calculation."""

import numpy as np
import pytest

from rrru.fit.least_squares import least_squares
from rrru.fit.residuals import Residuals
from rrru.robots.delta import Delta
from rrru.studies.delta import audit_paper_c
from rrru.studies.ptt3 import audit_paper_b
from tests.reference import tripods_slow


def _row(room, text):
    """Printed and right value of the one computed row whose check contains a text."""
    rows = [row for row in room.computed() if text in row[3]]
    assert len(rows) == 1
    return rows[0][5:7]


def test_the_two_papers_lost_what_their_scans_lack():
    where = {room.__name__[-1]: {row[0] for row in room.lost()} for room in (audit_paper_b, audit_paper_c)}
    assert where["b"] >= {f"Table {k}" for k in range(1, 9)} | {"eq. (1)", "eq. (18)", "eq. (21)"}
    assert where["c"] >= {"Table 1", "eq. (1)", "dimensions"}
    # printed in the scan
    assert not where["b"] & {"eq. (10)", "eq. (11)", "eq. (12)", "eq. (13)"}


def test_radii_by_hand():
    """At (0, 0, -250) all legs have D = sqrt(350^2 - 250^2), so that det J = 250 x 3 sqrt(3)/2 / D."""
    by_hand = 250.0 * 1.5 * np.sqrt(3.0) / np.sqrt(350.0**2 - 250.0**2)
    assert _row(audit_paper_b, "det J at (0, 0, -250)") == pytest.approx((by_hand, by_hand))
    assert _row(audit_paper_b, "slider position at which") == pytest.approx((1e-3, 1e-3 - 240.0), abs=1e-6)
    # the couples then lean 0.001 mm over 350 mm from the vertical
    assert _row(audit_paper_b, "constraint measure") == pytest.approx(2 * (np.sqrt(1.5) * 1e-3 / 350.0,), rel=1e-4)


def test_det_j_vanishes_where_the_links_ends_stand_in_line():
    """On the first azimuth at u = D_1 the three ends seen from above are in line: both other links have half of D_1 in
    their planes.
    """
    assert _row(audit_paper_b, "crosses zero")[1] == pytest.approx(np.sqrt(350.0**2 - 250.0**2))


def test_eqs_11_and_12_differ_by_half_the_second_derivative():
    points = np.array(
        [[0.0, 0.0, -250.0], [40.0, 25.0, -230.0], [-60.0, 10.0, -260.0], [15.0, -70.0, -210.0], [-35.0, -45.0, -280.0]]
    )
    azimuth = np.radians([0.0, 120.0, 240.0])
    v = points[:, 1:2] * np.cos(azimuth) - points[:, :1] * np.sin(azimuth)
    z = points[:, 2:]
    cubed = (350.0**2 - v**2 - z**2) ** 1.5
    second = [(350.0**2 - z**2) * np.sin(azimuth) ** 2, (350.0**2 - z**2) * np.cos(azimuth) ** 2, 350.0**2 - v**2]
    half = max((0.5 * part / cubed).max() for part in second)
    small, large = _row(audit_paper_b, "two corrected sliders")
    assert large == pytest.approx(half, rel=0.03) and small == pytest.approx(0.25 * half, rel=0.03)


def test_heights_relative_to_the_first_point_by_a_general_solver():
    rows = []
    for point in audit_paper_b._POINTS:
        azimuth = np.radians([0.0, 120.0, 240.0])
        u = point[0] * np.cos(azimuth) + point[1] * np.sin(azimuth)
        v = point[1] * np.cos(azimuth) - point[0] * np.sin(azimuth)
        sliders = u - 240.0 + np.sqrt(350.0**2 - v**2 - point[2] ** 2)
        rows.append(
            tripods_slow.ptt3_forward(sliders, 351.0, 240.0, 0.0, point - np.array([0.0, 0.0, 3.0]))[2] - point[2]
        )
    rows = np.array(rows)
    expected = (np.abs(rows - rows[0])[1:].mean(), np.abs(rows).mean())
    assert _row(audit_paper_b, "mean z error") == pytest.approx(expected, abs=1e-6)


def test_only_the_minus_sign_puts_the_second_axis_on_y():
    assert _row(audit_paper_c, "with +pi/6 and with -pi/6") == pytest.approx((60.0, 0.0), abs=1e-6)
    assert _row(audit_paper_c, "beta_2 + pi/2") == pytest.approx((180.0, 0.0), abs=1e-6)


def test_what_distances_see_by_driving_the_robot_with_wrong_zeros():
    """Distances and positions of the nonlinear robot for the least seen combination, found from its own distances."""
    robot, points = Delta(), audit_paper_c._spread(100.0, 200.0, 20)
    theta = robot.inverse(points)

    def seen(deviations):
        moved = robot.forward(theta, deviations)
        return moved, np.linalg.norm(moved[1:] - moved[0], axis=1)

    step = 1e-5
    columns = [(seen(step * e)[1] - seen(-step * e)[1]) / (2.0 * step) for e in np.eye(3)]
    _, sizes, directions = np.linalg.svd(np.stack(columns, axis=1))
    assert _row(audit_paper_c, "x, y displacements, and distances")[1] == pytest.approx(sizes[0] / sizes[2], rel=1e-4)
    weak = directions[2] / 375.0
    nominal, moved = seen(np.zeros(3)), seen(1e-2 * weak)
    stretch = 100.0 * np.sqrt(((moved[1] - nominal[1]) ** 2).mean())
    shift = 100.0 * np.sqrt(((moved[0] - nominal[0]) ** 2).sum(axis=1).mean())
    assert _row(audit_paper_c, "least seen combination") == pytest.approx((stretch, shift), rel=1e-3)


def test_what_wrong_lengths_leave_by_drawing_robots():
    """Forty robots with lengths off by 0.1 mm, each with its best zero offsets.

    Squares of few normal numbers scatter as much as their mean does, at most sqrt(2) times it: the rms of forty within
    4 x 1.41 / 2 / sqrt(40).
    """
    robot, legs, points = Delta(), Delta(parameter_set="legs"), audit_paper_c._spread(0.0, 300.0, 200)
    theta = robot.inverse(points)
    generator, squares = np.random.default_rng(0), []
    for _ in range(40):
        deviations = np.r_[np.zeros(3), generator.normal(0.0, 0.1, 9)]
        squares.append(least_squares(Residuals(robot, theta, legs.forward(theta, deviations), points)).rms_mm ** 2)
    exact, left = _row(audit_paper_c, "best zero offsets")
    assert exact == 0.0 and left == pytest.approx(
        np.sqrt(np.mean(squares)), rel=4.0 * np.sqrt(2.0) / 2.0 / np.sqrt(40.0)
    )


def test_what_a_levelled_arm_means_on_the_plane():
    robot, points = Delta(), audit_paper_c._spread(0.0, 300.0, 200)
    theta = robot.inverse(points)
    squares = [((robot.forward(theta, np.radians(0.1) * e) - points) ** 2).sum(axis=1).mean() for e in np.eye(3)]
    tenth, one = _row(audit_paper_c, "0.1 and of 1 degree")
    assert tenth == pytest.approx(np.sqrt(np.sum(squares)), rel=1e-3) and one == pytest.approx(10.0 * tenth)
