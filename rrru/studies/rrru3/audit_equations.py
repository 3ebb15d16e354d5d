"""Misprinted equations of paper A, each evaluated at a pose: as printed, corrected, and against an independent
check.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.robots.rrru3 import Rrru3


def misprinted_equations():
    """Rows of `audit` (without `kind`) for the misprinted equations."""
    robot = Rrru3()
    point = np.array([[-700.0, 60.0, 600.0]])
    theta = robot.inverse(point)
    passive = robot.passive_angles(point, theta)
    first, second, third = theta[0, 0], *passive[0, 0, :2]
    plane = first + second
    yield from _matrix_elements(first)
    on_axis = np.array([[-700.0, 0.0, 600.0]])
    closing = [np.degrees(robot.inverse(on_axis, elbow=elbow)[0, 0]) for elbow in ("out", "in")]
    printed, reversed_signs = (np.degrees(_equation_6(on_axis[0], sign)) for sign in (1.0, -1.0))
    # of the two roots, those next to the robot's angle or half a turn from it
    yield (
        "eq. (6), K15, K16, K17",
        "K15 with -2 L11 (r-R-Px), K16 = +4 L11 Pz, K17 with +2 L11 (r-R-Px)",
        "all three signs reversed",
        "theta11 at x = -700, y = 0, z = 600: both printed roots are half a turn from the closure's, with the signs reversed they are them",
        "deg",
        printed[np.argmin(np.abs(_turn(printed - closing[0] - 180.0)))],
        reversed_signs[np.argmin(np.abs(_turn(reversed_signs - closing[0])))],
        bool(
            all(np.abs(_turn(reversed_signs - angle)).min() < 1e-6 for angle in closing)
            and all(np.abs(_turn(printed - angle - 180.0)).min() < 1e-6 for angle in closing)
        ),
    )
    # eq. (7) is written in the frame turned by pi about z, with z downwards negative in the links' vertical part
    links = (
        400.0 * np.sin(first) + np.array([np.sin(plane), 100.0 * np.sin(plane)]) + 800.0 * np.cos(third) * np.sin(plane)
    )
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
            bool(
                abs(np.hypot(length * np.cos(angle), length * sine) - length)
                < 1e-9
                < abs(np.hypot(length * angle, length * angle) - length)
            ),
        )


def _equation_6(point, sign):
    """Both roots (2,) of eq. (6) for theta11 in rad, with the printed signs (+1) or the reversed ones (-1); point (3,),
    robot frame.
    """
    x, y, z = -point[0], point[1], point[2]
    arm, offset, forearm, radial = 400.0, 100.0, 800.0, 0.0 - x
    square = arm**2 + radial**2 + z**2 - (offset + np.sqrt(forearm**2 - y**2)) ** 2
    k15, k16, k17 = square - sign * 2.0 * arm * radial, sign * 4.0 * arm * z, square + sign * 2.0 * arm * radial
    return 2.0 * np.arctan((-k16 + np.array([1.0, -1.0]) * np.sqrt(k16**2 - 4.0 * k15 * k17)) / (2.0 * k15))


def _turn(degrees):
    """Angles in degrees brought to -180..180."""
    return (np.asarray(degrees) + 180.0) % 360.0 - 180.0


def _equation_8_third_leg(point, theta):
    """Left side of the third line of eq. (8) in mm^2, printed and corrected, at a pose in the robot frame."""
    # the frame of eq. (8) is the robot frame turned by pi about z: leg 3 points to +60 degrees; r = R, so that c1 = L1
    # cos(theta31)
    x, y, z = -point[0], -point[1], point[2]
    c1 = 400.0 * np.cos(theta[2])
    b2, c2 = -400.0 * np.sin(theta[1]), -400.0 * np.sin(theta[2])
    side = np.sqrt(3.0) * x - y
    links = 100.0**2 + 800.0**2 + 100.0 * np.sqrt(4.0 * 800.0**2 - side**2)
    flat = (x - c1 / 2.0) ** 2 + (y - np.sqrt(3.0) * c1 / 2.0) ** 2
    return flat + (z + b2) ** 2 - links, flat + (z + c2) ** 2 - links
