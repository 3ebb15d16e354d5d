"""Misprints and contradictions of paper A, each recomputed: what the printed form gives, and what an independent check gives."""

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from rrru.mechanisms import singularity
from rrru.mechanisms.rrru3 import Rrru3
from rrru.reproduce.paper_a import ERRORS_MM, MIGRATION, TABLE_5, TABLE_6

_LINE_X = np.linspace(-800.0, -300.0, 26)


def audit_table():
    """Rows of `audit`."""
    rows = [*_equations(), *_table_6(), *_trajectories(), *_contradictions()]
    names = ("where", "printed", "right", "check", "unit", "value_printed", "value_right", "shown")
    return pd.DataFrame(rows, columns=names)


def _line(y=0.0, z=600.0, x=_LINE_X):
    """Points of a line group, shape (n, 3)."""
    return np.stack([x, np.full_like(x, y), np.full_like(x, z)], axis=1)


def _equations():
    """Misprinted equations, each at one pose."""
    robot = Rrru3()
    point = np.array([[-700.0, 60.0, 600.0]])
    theta = robot.inverse(point)
    passive = robot.passive_angles(point, theta)
    first, second, third = theta[0, 0], *passive[0, 0, :2]
    plane = first + second
    yield from _matrix_elements(first)
    on_axis = np.array([[-700.0, 0.0, 600.0]])
    printed, right = np.degrees(_equation_6(on_axis[0])), np.degrees(robot.inverse(on_axis)[0, 0])
    yield (
        "eq. (6), K15, K16, K17",
        "K15 with -2 L11 (r-R-Px), K16 = +4 L11 Pz, K17 with +2 L11 (r-R-Px)",
        "all three signs reversed",
        "theta11 at x = -700, y = 0, z = 600 against the closure; the printed form is off by half a turn",
        "deg",
        printed,
        right,
        bool(abs(abs(right - printed) - 180.0) < 1e-6),
    )
    # eq. (7) is written in the frame turned by pi about z, with z downwards negative in the links' vertical part
    links = 400.0 * np.sin(first) + np.array([np.sin(plane), 100.0 * np.sin(plane)]) + 800.0 * np.cos(third) * np.sin(plane)
    yield (
        "eq. (7), l_A12A13",
        "-s(theta11 + theta12)",
        "-s(theta11 + theta12) L12",
        "height that the three links of leg 1 span at (-700, 60, 600); it has to be 600",
        "mm",
        links[0],
        links[1],
        bool(abs(links[1] - 600.0) < 1e-6 < abs(links[0] - 600.0)),
    )
    printed, right = _equation_8_third_leg(point[0], theta[0])
    yield (
        "eq. (8), third leg",
        "(Pz + b2)",
        "(Pz + c2)",
        "left side at (-700, 60, 600) with the angles of the inverse; it has to be 0",
        "mm^2",
        printed,
        right,
        bool(abs(right) < 1e-6 < abs(printed)),
    )


def _matrix_elements(angle):
    """Eq. (1) and the matrices below eq. (2), against a rotation by the same angle."""
    _, sine, _ = Rotation.from_rotvec([0.0, 0.0, angle]).apply([1.0, 0.0, 0.0])
    yield (
        "eq. (1), element (2,4)",
        "L c(theta)",
        "L s(theta)",
        "y of a unit link turned by theta11 about z",
        "1",
        np.cos(angle),
        sine,
        bool(abs(sine - np.sin(angle)) < 1e-12 < abs(sine - np.cos(angle))),
    )
    for matrix, length in (("T11", 400.0), ("T12", 100.0), ("T13", 800.0)):
        yield (
            f"{matrix}, elements (1,4) and (2,4)",
            "L theta",
            "L c(theta), L s(theta)",
            f"length of the link of {matrix[1:]} turned by theta11",
            "mm",
            np.hypot(length * angle, length * angle),
            np.hypot(length * np.cos(angle), length * sine),
            bool(abs(np.hypot(np.cos(angle), sine) - 1.0) < 1e-12),
        )


def _equation_6(point):
    """theta11 in rad as eq. (6) prints it, with the root of the robot's assembly; point (3,) in the robot frame."""
    x, y, z = -point[0], point[1], point[2]
    arm, offset, forearm, radial = 400.0, 100.0, 800.0, 0.0 - x
    square = arm**2 + radial**2 + z**2 - (offset + np.sqrt(forearm**2 - y**2)) ** 2
    k15, k16, k17 = square - 2.0 * arm * radial, 4.0 * arm * z, square + 2.0 * arm * radial
    roots = 2.0 * np.arctan((-k16 + np.array([1.0, -1.0]) * np.sqrt(k16**2 - 4.0 * k15 * k17)) / (2.0 * k15))
    # the root half a turn from the closure's: the one that the sign error displaced
    target = Rrru3().inverse(point[None])[0, 0]
    return roots[np.argmin(np.abs(np.abs(roots - target) - np.pi))]


def _equation_8_third_leg(point, theta):
    """Left side of the third line of eq. (8) in mm^2, printed and corrected, at a pose in the robot frame."""
    # the frame of eq. (8) is the robot frame turned by pi about z: leg 3 points to +60 degrees; r = R, so that c1 = L1 cos(theta31)
    x, y, z = -point[0], -point[1], point[2]
    c1 = 400.0 * np.cos(theta[2])
    b2, c2 = -400.0 * np.sin(theta[1]), -400.0 * np.sin(theta[2])
    side = np.sqrt(3.0) * x - y
    links = 100.0**2 + 800.0**2 + 100.0 * np.sqrt(4.0 * 800.0**2 - side**2)
    flat = (x - c1 / 2.0) ** 2 + (y - np.sqrt(3.0) * c1 / 2.0) ** 2
    return flat + (z + b2) ** 2 - links, flat + (z + c2) ** 2 - links


def _predicted(values, points):
    """Position errors (n, 3) that errors by tied name predict at points (n, 3)."""
    robot = Rrru3(errors="tied")
    return robot.forward(robot.inverse(points), robot.parameters.vector(values), points) - points


def _table_6():
    """Whether Table 6's drive angle errors are radians or degrees."""
    points = _line()
    degrees = {k: np.radians(v) if k.startswith("dtheta") else v for k, v in TABLE_6.items()}
    lines = _predicted(TABLE_5, points)
    spiral_rad, spiral_deg = _predicted(TABLE_6, points), _predicted(degrees, points)
    where, printed, right = "Table 6", "drive angle errors in rad", "very likely degrees"
    size = {
        "Table 5": np.linalg.norm(lines, axis=1),
        "rad": np.linalg.norm(spiral_rad, axis=1),
        "deg": np.linalg.norm(spiral_deg, axis=1),
    }
    for bound, take, measured in (("smallest", np.min, "group1_before_min"), ("largest", np.max, "group1_before_max")):
        yield (
            where,
            printed,
            right,
            f"{bound} error predicted on group 1, read in rad and in deg; Table 5 predicts {take(size['Table 5']):.2f}, "
            f"measured {ERRORS_MM[measured]}",
            "mm",
            take(size["rad"]),
            take(size["deg"]),
            bool(abs(take(size["deg"]) - take(size["Table 5"])) < abs(take(size["rad"]) - take(size["Table 5"]))),
        )
        apart_rad, apart_deg = (take(np.linalg.norm(lines - spiral, axis=1)) for spiral in (spiral_rad, spiral_deg))
        yield (
            where,
            printed,
            right,
            f"{bound} difference between Tables 5 and 6 on group 1, in rad and in deg; "
            "'the spiral's calibration compensates the lines to 0.08-1.12 mm' needs about 1",
            "mm",
            apart_rad,
            apart_deg,
            bool(apart_deg < 1.34 < apart_rad),
        )


def _trajectories():
    """Which frame the trajectories are in, and what lies on them."""
    robot, points = Rrru3(), _line()
    turned = points * np.array([-1.0, -1.0, 1.0])
    measure = {name: singularity.translational_measure(robot, p, robot.inverse(p)) for name, p in (("robot", points), ("turned", turned))}
    x = np.linspace(-800.0, -700.0, 2001)
    fine = _line(x=x)
    away = fine * np.array([-1.0, -1.0, 1.0])
    determinant = np.linalg.det(singularity.leg_forces(robot, away, robot.inverse(away)))
    yield (
        "section 3.2, start and end points",
        "frame not stated; eqs. (4), (8) suggest theirs",
        "robot frame of eq. (7)",
        "smallest translational measure on group 1: in the frame of eqs. (4), (8), and in the robot frame",
        "1",
        measure["turned"].min(),
        measure["robot"].min(),
        bool(measure["robot"].min() > 0.27 > measure["turned"].min()),
    )
    crossing = np.flatnonzero(np.diff(np.sign(determinant)))
    yield (
        "section 3.2, start and end points",
        "frame not stated; eqs. (4), (8) suggest theirs",
        "robot frame of eq. (7)",
        "|x| where group 1 in the frame of eqs. (4), (8) crosses a translational singularity; null: none in the robot frame",
        "mm",
        abs(x[crossing[0]]) if crossing.size else np.nan,
        np.nan,
        bool(crossing.size > 0),
    )
    constraint = singularity.constraint_determinant(robot, fine, robot.inverse(fine))
    change = np.flatnonzero(np.diff(np.sign(constraint)))
    yield (
        "section 3.2, group 1",
        "spikes and a poor boundary, unexplained",
        "a constraint singularity lies on the line, which eq. (8) does not see",
        "x where the platform can turn with locked drives, on y = 0",
        "mm",
        np.nan,
        x[change[0]] if change.size else np.nan,
        bool(change.size > 0),
    )
    outer = np.linalg.norm(_predicted(TABLE_5, _line(y=112.0)), axis=1).max()
    yield (
        "section 3.2, groups 2-7",
        "positions not given",
        "y = +-112 fits the largest error",
        "largest error that Table 5 predicts at y = 112, against the printed largest error (group 6)",
        "mm",
        ERRORS_MM["lines_before_max"],
        outer,
        bool(abs(outer / ERRORS_MM["lines_before_max"] - 1.0) < 0.05),
    )


def _contradictions():
    """Numbers that the paper prints twice, or that say less than it seems."""
    yield (
        "abstract and section 3.3",
        "lines after spiral calibration: max 1.18 and 1.12",
        "undecidable",
        "as printed",
        "mm",
        1.18,
        1.12,
        True,
    )
    yield (
        "abstract and section 3.3",
        "spiral after its own calibration: max 1.56, but a component of -1.63",
        "the largest error is at least 1.63",
        "a component cannot exceed the error's size",
        "mm",
        ERRORS_MM["spiral_under_spiral_max"],
        abs(ERRORS_MM["spiral_under_spiral_component_min"]),
        True,
    )
    yield (
        "title and text",
        "3-RRU and 3-RRRU",
        "3-RRRU",
        "single-axis joints per leg: RRU has 4, Fig. 2 shows five (A_i1 to A_i5)",
        "1",
        4.0,
        5.0,
        True,
    )
    for name, values in (("Table 5", TABLE_5), ("Table 6", TABLE_6)):
        shifted = values | {"dR": values["dR"] + 1.0, "dr": values["dr"] + 1.0}
        change = np.abs(_predicted(shifted, _line()) - _predicted(values, _line())).max()
        yield (
            name,
            "dR and dr as two results",
            "one result, dr - dR",
            "largest change on group 1 when both grow by 1 mm (first value: what two independent errors would do when only dr grows)",
            "mm",
            np.abs(_predicted(values | {"dr": values["dr"] + 1.0}, _line()) - _predicted(values, _line())).max(),
            change,
            bool(change < 1e-9),
        )
    yield (
        "Table 4",
        "migration probability 0.7 is best",
        "with one population nothing migrates",
        "range of the ten printed objectives; MATLAB's `ga` with a scalar population size skips the step",
        "mm",
        max(MIGRATION) - min(MIGRATION),
        0.0,
        True,
    )
