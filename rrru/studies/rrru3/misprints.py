"""Misprinted equations of paper A, evaluated at a pose: printed, corrected, and by an independent check."""

from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.robots.rrru3 import Rrru3
from rrru.studies.paper import Finding, finding

_ROBOT = Rrru3()
_POSE = np.array([[-700.0, 60.0, 600.0]])


@cache
def _theta():
    """Drive angles (3,) at the pose."""
    return _ROBOT.inverse(_POSE)[0]


def _half_turn(degrees):
    """Angles in degrees brought to -180..180."""
    return (degrees + 180.0) % 360.0 - 180.0


def _rotated():
    """Where theta11 turns a unit link to, (3,)."""
    return Rotation.from_rotvec([0.0, 0.0, _theta()[0]]).apply([1.0, 0.0, 0.0])


@finding("eq. (1), element (2,4)", "L c(theta)", "L s(theta)", "1", lambda c, y, s: abs(s - y) < 1e-12 < abs(c - y))
def _unit_link():
    """Y of a unit link turned by theta11 about z."""
    return np.cos(_theta()[0]), _rotated()[1], np.sin(_theta()[0])


def _link(matrix, length):
    """Finding on the matrix of a link of a length in mm."""

    def lengths():
        angle = _theta()[0]
        return np.hypot(length * angle, length * angle), np.hypot(length * np.cos(angle), length * _rotated()[1])

    return Finding(
        f"{matrix}, elements (1,4) and (2,4)",
        "L theta",
        "L c(theta), L s(theta)",
        f"length of the link of {matrix[1:]} turned by theta11",
        "mm",
        lengths,
        lambda printed, right: abs(right - length) < 1e-9 < abs(printed - length),
    )


@finding(
    "eq. (6), K15, K16, K17",
    "K15 with -2 L11 (r-R-Px), K16 = +4 L11 Pz, K17 with +2 L11 (r-R-Px)",
    "all three signs reversed",
    "deg",
    lambda printed, right, worst: worst < 1e-6 and abs(abs(printed - right) - 180.0) < 1e-6,
)
def _equation_6():
    """Theta11 at x = -700, y = 0, z = 600: both printed roots are half a turn from the closure's, with the signs
    reversed they are them.
    """
    point = np.array([-700.0, 0.0, 600.0])
    closing = np.degrees([_ROBOT.inverse(point[None], elbow=elbow)[0, 0] for elbow in ("out", "in")])
    printed, right = (np.degrees(_roots_of_equation_6(point, sign)) for sign in (1.0, -1.0))
    # rows: the closure's angles; columns: roots
    off_printed, off_right = (np.abs(_half_turn(r - closing[:, None])) for r in (printed - 180.0, right))
    worst = max(off_printed.min(axis=1).max(), off_right.min(axis=1).max())
    return printed[off_printed[0].argmin()], right[off_right[0].argmin()], worst


def _roots_of_equation_6(point, sign):
    """Both roots (2,) for theta11 in rad, with the printed signs (+1) or the reversed ones (-1), at a point (3,)."""
    x, y, z = -point[0], point[1], point[2]
    arm, offset, forearm, radial = 400.0, 100.0, 800.0, 0.0 - x
    square = arm**2 + radial**2 + z**2 - (offset + np.sqrt(forearm**2 - y**2)) ** 2
    k15, k16, k17 = square - sign * 2.0 * arm * radial, sign * 4.0 * arm * z, square + sign * 2.0 * arm * radial
    return 2.0 * np.arctan((-k16 + np.array([1.0, -1.0]) * np.sqrt(k16**2 - 4.0 * k15 * k17)) / (2.0 * k15))


@finding(
    "eq. (7), l_A12A13",
    "-s(theta11 + theta12)",
    "-s(theta11 + theta12) L12",
    "mm",
    lambda printed, right: abs(right - 600.0) < 1e-6 < abs(printed - 600.0),
)
def _equation_7():
    """Height that the three links of leg 1 span at (-700, 60, 600); it has to be 600."""
    first = _theta()[0]
    second, third = _ROBOT.passive_angles(_POSE, _theta()[None])[0, 0, :2]
    sine = np.sin(first + second)
    return 400.0 * np.sin(first) + np.array([sine, 100.0 * sine]) + 800.0 * np.cos(third) * sine


@finding(
    "eq. (8), third leg", "(Pz + b2)", "(Pz + c2)", "mm^2", lambda printed, right: abs(right) < 1e-6 < abs(printed)
)
def _equation_8():
    """Left side at (-700, 60, 600) with the angles of the inverse; it has to be 0."""
    # its frame is the robot frame turned by pi about z: leg 3 points to +60 degrees; r = R, so c1 = L1 cos(theta31)
    x, y, z = _POSE[0] * [-1.0, -1.0, 1.0]
    c1 = 400.0 * np.cos(_theta()[2])
    side = np.sqrt(3.0) * x - y
    links = 100.0**2 + 800.0**2 + 100.0 * np.sqrt(4.0 * 800.0**2 - side**2)
    flat = (x - c1 / 2.0) ** 2 + (y - np.sqrt(3.0) * c1 / 2.0) ** 2
    return flat + (z - 400.0 * np.sin(_theta()[1:])) ** 2 - links


EQUATIONS = (
    _unit_link,
    *(_link(matrix, length) for matrix, length in (("T11", 400.0), ("T12", 100.0), ("T13", 800.0))),
    _equation_6,
    _equation_7,
    _equation_8,
)
