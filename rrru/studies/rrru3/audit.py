"""Misprints and contradictions of paper A: values of the printed form and of an independent check."""

from dataclasses import replace
from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.estimation.observations.target_positions import TargetPositions
from rrru.genetic.algorithm import minimise
from rrru.genetic.settings import GeneticSettings
from rrru.kinematics import singularity
from rrru.robots.rrru3 import Rrru3
from rrru.studies import paper
from rrru.studies.paper import Finding, finding
from rrru.studies.rrru3.paper import ANGLES, ERRORS_MM, MIGRATION, REPEATED, TABLE_5, TABLE_6
from rrru.studies.rrru3.study_numbers import SPIKE_MM, spikes

_ROBOT, _TIED = Rrru3(), Rrru3(parameter_set="tied")
_FRAME = (
    "section 3.2, start and end points",
    "frame not stated; eqs. (4), (8) suggest theirs",
    "robot frame of eq. (7)",
)
# that frame is rotated by pi about z
_TURNED = np.array([-1.0, -1.0, 1.0])
_SINGULAR_X = np.linspace(-800.0, -700.0, 2001)
_TWICE = "abstract and section 3.3"
# where misprinted equations are evaluated
_POSE = np.array([[-700.0, 60.0, 600.0]])


def _line(y=0.0, x=None):
    """Points (n, 3) of a line group."""
    x = np.linspace(-800.0, -300.0, 26) if x is None else x
    return np.stack([x, np.full_like(x, y), np.full_like(x, 600.0)], axis=1)


def _predicted(values, points):
    """Position errors (n, 3) that deviations by tied name predict at points (n, 3)."""
    return _TIED.forward(_TIED.inverse(points), _TIED.parameters.vector(values), points) - points


@cache
def _read_both_ways():
    """Errors (26, 3) on group 1 that Table 5 predicts, and Table 6 with its angles read in rad and in degrees."""
    degrees = {name: np.radians(value) if name in ANGLES else value for name, value in TABLE_6.items()}
    return tuple(_predicted(values, _line()) for values in (TABLE_5, TABLE_6, degrees))


def _table_6(bound, take, measured):
    """Findings on the unit of Table 6's angles, from the smallest or the largest errors on group 1."""
    table = ("Table 6", "drive angle errors in rad", "very likely degrees")
    yield Finding(
        *table,
        f"{bound} error predicted on group 1, read in rad and in deg; "
        f"Table 5 predicts {{2:.2f}}, measured {ERRORS_MM[measured]}",
        "mm",
        lambda: tuple(take(np.linalg.norm(_read_both_ways()[k], axis=1)) for k in (1, 2, 0)),
        lambda rad, degrees, table_5: abs(degrees - table_5) < abs(rad - table_5),
    )
    yield Finding(
        *table,
        f"{bound} difference between Tables 5 and 6 on group 1, in rad and in deg; "
        "'the spiral's calibration compensates the lines to 0.08-1.12 mm' needs about 1",
        "mm",
        lambda: tuple(take(np.linalg.norm(_read_both_ways()[0] - _read_both_ways()[k], axis=1)) for k in (1, 2)),
        lambda rad, degrees: degrees < ERRORS_MM["lines_after_max"] < rad,
    )


@finding(*_FRAME, "1", lambda printed, right: printed < 0.27 < right)
def _translational_measure():
    """Smallest translational measure on group 1: in the frame of eqs. (4), (8), and in the robot frame."""
    frames = (_line() * _TURNED, _line())
    return tuple(singularity.translational_measure(_ROBOT, p, _ROBOT.inverse(p)).min() for p in frames)


def _first_crossing(determinant):
    """The x in mm where a determinant (2001,) changes sign first; NaN where it does not."""
    crossing = np.flatnonzero(np.diff(np.sign(determinant)))
    return _SINGULAR_X[crossing[0]] if crossing.size else np.nan


@finding(*_FRAME, "mm", lambda printed, _: 700.0 <= printed <= 800.0)
def _translational_crossing():
    """|x| where group 1 in the frame of eqs. (4), (8) crosses a translational singularity; null: none in the robot
    frame.
    """
    points = _line(x=_SINGULAR_X) * _TURNED
    forces = singularity.leg_forces(_ROBOT, points, _ROBOT.inverse(points))
    return abs(_first_crossing(np.linalg.det(forces))), np.nan


@finding(
    "section 3.2, group 1",
    "spikes and a poor boundary, unexplained",
    "a constraint singularity is on the line, which eq. (8) does not show",
    "mm",
    lambda _, right: -800.0 <= right <= -700.0,
)
def _constraint_crossing():
    """X where the platform can rotate with locked drives, on y = 0."""
    points = _line(x=_SINGULAR_X)
    return np.nan, _first_crossing(singularity.constraint_determinant(_ROBOT, points, _ROBOT.inverse(points)))


@finding(
    "section 3.2, Fig. 9",
    "compensation removes several sharp spikes",
    "a calibration removes a smooth curve only: spikes that it removes come from the commands, not from random errors",
    "mm",
    lambda printed, right: right < 0.1 * printed,
)
def _spikes():
    """Height on group 1 of a spike that cannot be in 0.294 to 1.220, and of the highest in Table 5's correction."""
    return SPIKE_MM, spikes(np.linalg.norm(_predicted(TABLE_5, _line()), axis=1))[0]


@finding(
    "section 3.2, groups 2-7",
    "positions not given",
    "y = +-112 fits the largest error",
    "mm",
    lambda printed, right: abs(right / printed - 1.0) < 0.05,
)
def _largest_error():
    """Largest error that Table 5 predicts at y = 112, compared with the printed largest error (group 6)."""
    return ERRORS_MM["lines_before_max"], np.linalg.norm(_predicted(TABLE_5, _line(y=112.0)), axis=1).max()


@finding(
    "Tables 5 and 6",
    "dR and dr as two results",
    "one result, dr - dR",
    "mm",
    lambda printed, right: right < 1e-8 < 0.1 < printed,
)
def _radii():
    """Largest change on group 1, spatial closure: r alone 1 mm larger, and both R and r 1 mm larger."""
    points = _line()[::5]
    theta = _ROBOT.inverse(points)
    changed = (_ROBOT.twists_of({"dR": radius, "dr": 1.0}) for radius in (0.0, 1.0))
    return tuple(np.abs(_ROBOT.solve(theta, points, twists).position_mm - points).max() for twists in changed)


@finding(
    "Table 4",
    "migration probability 0.7 is best",
    "with one population nothing migrates",
    "mm",
    lambda printed, right: right == 0.0 < printed,
)
def _migration():
    """Range of the ten printed objectives, and difference between P_m = 0.1 and 1.0 at the same seed here."""
    points = _line()
    residuals = TargetPositions(_TIED, _TIED.inverse(points), points + _predicted(TABLE_5, points), points)
    settings = GeneticSettings(generations=100, stall_generations=0)
    low, high = (
        minimise(residuals.mean_distance, _TIED.parameters.low, _TIED.parameters.high, one, 1).objective
        for one in (replace(settings, migration_fraction=fraction) for fraction in (0.1, 1.0))
    )
    return max(MIGRATION) - min(MIGRATION), abs(high - low)


@finding(
    _TWICE,
    "lines after spiral calibration: max 1.18 and 1.12",
    "undecidable",
    "mm",
    lambda abstract, body: abs(abstract - body) > 0.0,
)
def _printed_twice():
    """As printed."""
    return REPEATED[0].value, ERRORS_MM["lines_2_7_under_spiral_max"]


@finding(
    _TWICE,
    "spiral after its own calibration: max 1.56, but a component of -1.63",
    "the largest error is at least 1.63",
    "mm",
    lambda size, component: component > size,
)
def _component():
    """A component cannot exceed the error's size."""
    return ERRORS_MM["spiral_under_spiral_max"], abs(ERRORS_MM["spiral_under_spiral_component_min"])


@finding("title and text", "3-RRU and 3-RRRU", "3-RRRU", "1", lambda named, drawn: named < drawn)
def _joints():
    """Single-axis joints per leg: RRU has 4, Fig. 2 shows five (A_i1 to A_i5)."""
    return tuple(sum({"R": 1, "U": 2}[joint] for joint in leg) for leg in ("RRU", "RRRU"))


# --- equations, at a pose: printed, corrected, and by an independent check


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


COMPUTED = (
    _unit_link,
    *(_link(matrix, length) for matrix, length in (("T11", 400.0), ("T12", 100.0), ("T13", 800.0))),
    _equation_6,
    _equation_7,
    _equation_8,
    *_table_6("smallest", np.min, "group1_before_min"),
    *_table_6("largest", np.max, "group1_before_max"),
    *(_translational_measure, _translational_crossing, _constraint_crossing, _spikes),
    *(_largest_error, _radii, _migration),
)
READ = (_printed_twice, _component, _joints)


def audit_rows():
    """Rows of `audit` for paper A."""
    return paper.audit_rows("A", COMPUTED, READ)
