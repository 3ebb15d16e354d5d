"""Paper A's equations and tables as printed and as they should be, each evaluated beside an independent check.

Every function returns what the printed form gives, what the right form gives, and what else decides. Lengths in mm.
"""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.fit.residuals import Residuals
from rrru.genetic.algorithm import minimise
from rrru.genetic.settings import GeneticSettings
from rrru.plant.virtual_robot import VirtualRobot
from rrru.robots import singularity
from rrru.robots.rrru3 import Rrru3
from rrru.studies.rrru3.paper import ANGLES, MIGRATION, TABLE_5, TABLE_6

_ROBOT = Rrru3()
_POSE = np.array([[-700.0, 60.0, 600.0]])
# eqs. (4) and (8) are written in the frame turned by pi about z
_TURNED = np.array([-1.0, -1.0, 1.0])


def _line(y=0.0, x=None):
    """Points (n, 3) of a line group."""
    x = np.linspace(-800.0, -300.0, 26) if x is None else x
    return np.stack([x, np.full_like(x, y), np.full_like(x, 600.0)], axis=1)


def _predicted(values, points):
    """Position errors (n, 3) that deviations by tied name predict at points (n, 3)."""
    robot = Rrru3(parameter_set="tied")
    return robot.forward(robot.inverse(points), robot.parameters.vector(values), points) - points


def _half_turn(degrees):
    """Angles in degrees brought to -180..180."""
    return (np.asarray(degrees) + 180.0) % 360.0 - 180.0


def unit_link():
    """Eq. (1): y of a unit link turned by theta11, printed and by rotation, and corrected."""
    angle = _ROBOT.inverse(_POSE)[0, 0]
    return np.cos(angle), Rotation.from_rotvec([0.0, 0.0, angle]).apply([1.0, 0.0, 0.0])[1], np.sin(angle)


def link_length(length):
    """Matrices below eq. (2): length of a turned link."""
    angle = _ROBOT.inverse(_POSE)[0, 0]
    return np.hypot(length * angle, length * angle), np.hypot(length * np.cos(angle), length * unit_link()[1])


def equation_6():
    """theta11 in degrees: printed and reversed signs; how far both roots are from what they should be."""
    point = np.array([-700.0, 0.0, 600.0])
    closing = np.degrees([_ROBOT.inverse(point[None], elbow=elbow)[0, 0] for elbow in ("out", "in")])
    printed, right = (np.degrees(_roots_of_equation_6(point, sign)) for sign in (1.0, -1.0))
    # rows: the closure's angles; columns: roots
    half_turn_off, off = (np.abs(_half_turn(r - closing[:, None])) for r in (printed - 180.0, right))
    worst = max(half_turn_off.min(axis=1).max(), off.min(axis=1).max())
    return printed[half_turn_off[0].argmin()], right[off[0].argmin()], worst


def _roots_of_equation_6(point, sign):
    """Both roots (2,) for theta11 in rad, with the printed signs (+1) or the reversed ones (-1), at a point (3,)."""
    x, y, z = -point[0], point[1], point[2]
    arm, offset, forearm, radial = 400.0, 100.0, 800.0, 0.0 - x
    square = arm**2 + radial**2 + z**2 - (offset + np.sqrt(forearm**2 - y**2)) ** 2
    k15, k16, k17 = square - sign * 2.0 * arm * radial, sign * 4.0 * arm * z, square + sign * 2.0 * arm * radial
    return 2.0 * np.arctan((-k16 + np.array([1.0, -1.0]) * np.sqrt(k16**2 - 4.0 * k15 * k17)) / (2.0 * k15))


def equation_7():
    """Height that the three links of leg 1 span."""
    theta = _ROBOT.inverse(_POSE)
    first, second, third = theta[0, 0], *_ROBOT.passive_angles(_POSE, theta)[0, 0, :2]
    sine = np.sin(first + second)
    return 400.0 * np.sin(first) + np.array([sine, 100.0 * sine]) + 800.0 * np.cos(third) * sine


def equation_8():
    """Left side of the third line in mm^2, with the angles of the inverse."""
    theta = _ROBOT.inverse(_POSE)[0]
    # leg 3 points to +60 degrees in the turned frame; r = R, so that c1 = L1 cos(theta31)
    x, y, z = _TURNED * _POSE[0]
    c1 = 400.0 * np.cos(theta[2])
    b2, c2 = -400.0 * np.sin(theta[1]), -400.0 * np.sin(theta[2])
    side = np.sqrt(3.0) * x - y
    links = 100.0**2 + 800.0**2 + 100.0 * np.sqrt(4.0 * 800.0**2 - side**2)
    flat = (x - c1 / 2.0) ** 2 + (y - np.sqrt(3.0) * c1 / 2.0) ** 2
    return flat + (z + b2) ** 2 - links, flat + (z + c2) ** 2 - links


def _table_6():
    """Errors (26, 3) on group 1 that Table 6 predicts, its angles read in rad and in degrees."""
    degrees = {name: np.radians(v) if name in ANGLES else v for name, v in TABLE_6.items()}
    return _predicted(TABLE_6, _line()), _predicted(degrees, _line())


def error_size(take):
    """Smallest or largest (np.min, np.max) error on group 1 by Table 6, in rad and in degrees, and by Table 5."""
    return tuple(take(np.linalg.norm(e, axis=1)) for e in (*_table_6(), _predicted(TABLE_5, _line())))


def difference_size(take):
    """Smallest or largest difference between what Tables 5 and 6 predict on group 1, in rad and in degrees."""
    lines = _predicted(TABLE_5, _line())
    return tuple(take(np.linalg.norm(lines - spiral, axis=1)) for spiral in _table_6())


def translational_margin():
    """Smallest translational measure on group 1, in the frame of eqs. (4), (8) and in the robot frame."""
    return tuple(
        singularity.translational_measure(_ROBOT, points, _ROBOT.inverse(points)).min()
        for points in (_line() * _TURNED, _line())
    )


def _first_crossing(x, determinant):
    """The x where a determinant (n,) changes sign first; NaN where it does not."""
    crossing = np.flatnonzero(np.diff(np.sign(determinant)))
    return x[crossing[0]] if crossing.size else np.nan


def translational_crossing():
    """|x| of a translational singularity on group 1 in the frame of eqs. (4), (8)."""
    x = np.linspace(-800.0, -700.0, 2001)
    points = _line(x=x) * _TURNED
    return abs(
        _first_crossing(x, np.linalg.det(singularity.leg_forces(_ROBOT, points, _ROBOT.inverse(points))))
    ), np.nan


def constraint_crossing():
    """Where on group 1 a constraint singularity lies, which eq. (8) does not see."""
    x = np.linspace(-800.0, -700.0, 2001)
    points = _line(x=x)
    return np.nan, _first_crossing(x, singularity.constraint_determinant(_ROBOT, points, _ROBOT.inverse(points)))


def largest_error_at(y):
    """Largest error that Table 5 predicts on a line group at y."""
    return np.linalg.norm(_predicted(TABLE_5, _line(y=y)), axis=1).max()


def radii():
    """Largest change on group 1, on the spatial closure: r alone 1 mm larger, and both R and r."""
    points = _line()[::5]
    robot = VirtualRobot()
    theta = robot.mechanism.inverse(points)
    passive = robot.mechanism.passive_angles(points, theta)

    def largest_change(radius_mm, platform_mm):
        lengths = robot.geometry.lengths_mm + np.array([radius_mm, 0.0, 0.0, 0.0, platform_mm])
        moved = replace(robot.geometry, lengths_mm=lengths).solve(theta, passive).position_mm
        return np.abs(moved - points).max()

    return largest_change(0.0, 1.0), largest_change(1.0, 1.0)


def migration():
    """Range of the ten printed objectives, and difference between P_m = 0.1 and 1.0 at the same seed."""
    points, robot = _line(), Rrru3(parameter_set="tied")
    residuals = Residuals(robot, robot.inverse(points), points + _predicted(TABLE_5, points), points)
    bounds = robot.parameters.low, robot.parameters.high
    settings = GeneticSettings(generations=100, stall_generations=0)
    low, high = (
        minimise(residuals.mean_distance, *bounds, replace(settings, migration_fraction=fraction), 1).objective
        for fraction in (0.1, 1.0)
    )
    return max(MIGRATION) - min(MIGRATION), abs(high - low)
