"""Paper C's claims and contradictions, recomputed, and the lost parts of its scan.

The paper gives no dimensions: Delta's nominal ones are used instead.
"""

from itertools import combinations
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.calibration.identifiability import analyse
from rrru.robots.delta import Delta
from rrru.studies import paper
from rrru.studies.delta.published import RESULTS
from rrru.studies.paper import Finding, finding

_PRINTED = {number.item: number.value for number in RESULTS}
_CONCLUSION = ("conclusion (1)", "x, y errors of the platform along one plane identify the zero errors")
# ASSUME the size of the part of the plane that the poses and the tracker's points cover
_CALIBRATED_MM, _CHECKED_MM = 200.0, 300.0
_LOST = paper.read_lost(Path(__file__).with_name("lost.csv"))


def disc(height_mm, radius_mm, count):
    """Positions (count, 3) in mm spread evenly over a disc (sunflower)."""
    k = np.arange(count)
    radius, angle = radius_mm * np.sqrt((k + 0.5) / count), k * np.pi * (3.0 - np.sqrt(5.0))
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(count, height_mm)], axis=1)


def _off_y(first_rad, back_rad):
    """Angle in degrees between Y and the second level arm, legs counted from `first_rad`, turned back by `back_rad`."""
    arm = Rotation.from_euler("x", 0.0).apply([0.0, 1.0, 0.0])
    direction = Rotation.from_euler("z", first_rad + 2.0 * np.pi / 3.0 + back_rad).apply(arm)
    return np.degrees(np.arccos(np.clip(direction[1], -1.0, 1.0)))


# the scan prints minus signs as question marks
@finding(
    "structure angles, Fig. 2",
    "beta_i = ? pi/6 + 2 pi (i ? 1)/3",
    "-pi/6 + 2 pi (i - 1)/3",
    "deg",
    lambda plus, minus: minus < 1e-9 < plus,
)
def _first_axis():
    """Angle between Y and the second drive axis's middle with +pi/6 and with -pi/6; the text says that Y points
    there.
    """
    return tuple(_off_y(sign * np.pi / 6.0, -np.pi / 2.0) for sign in (1.0, -1.0))


@finding("eq. (2), text", "beta_i?pi2", "beta_i - pi/2", "deg", lambda plus, minus: minus < 1e-9 < plus)
def _arms():
    """Angle between Y and the second arm, level, turned by beta_2 + pi/2 and by beta_2 - pi/2; arms point outwards."""
    return tuple(_off_y(-np.pi / 6.0, sign * np.pi / 2.0) for sign in (1.0, -1.0))


def _planar_jacobians():
    """Derivatives by the zero errors at z = 100, (n, k, 3): 20 positions, 19 displacements in x, y, 19 distances."""
    robot, points = Delta(), disc(100.0, _CALIBRATED_MM, 20)
    position = robot.parameter_jacobian(points, robot.inverse(points))
    moved, way = position[1:] - position[0], points[1:] - points[0]
    distance = np.einsum("na,nak->nk", way / np.linalg.norm(way, axis=1, keepdims=True), moved)
    return position, moved[:, :2], distance[:, None]


@finding(*_CONCLUSION, "they do, in rank", "1", lambda errors, rank: rank < errors)
def _rank():
    """Zero errors, and rank of the distances from position 1 over 20 positions at z = 100 mm, within 200 mm of the
    axis.
    """
    return 3, analyse(Delta(), _planar_jacobians()[2]).rank


@finding(
    *_CONCLUSION,
    "eqs. (8) to (15) use distances, which keep half of the x, y displacements",
    "1",
    lambda displacements, distances: distances > displacements,
)
def _conditions():
    """Condition over these 20 positions: x, y displacements, and distances."""
    return tuple(analyse(Delta(), jacobian).condition for jacobian in _planar_jacobians()[1:])


@finding(
    *_CONCLUSION,
    "differences between the zero errors mostly shift the whole plane, which does not affect distances: "
    "the error of the position is {2:.0f} times that of the distances",
    "mm",
    lambda stretch, shift, _: shift > stretch,
)
def _least_seen():
    """Rms change for the least observable zero errors, 1 mm at the arms' ends: of the distances, and of the
    position.
    """
    position, _, distance = _planar_jacobians()
    identifiability = analyse(Delta(), distance)
    weak = identifiability.directions[-1] * identifiability.scale
    stretch, shift = (np.sqrt(((matrix @ weak) ** 2).sum() / len(matrix)) for matrix in (distance, position))
    return stretch, shift, shift / stretch


def _checked_jacobians():
    """Derivatives (600, k) of positions on z = 0 by zero errors and by the legs' lengths."""
    robot, points = Delta(parameter_set="legs"), disc(0.0, _CHECKED_MM, 200)
    jacobian = robot.parameter_jacobian(points, robot.inverse(points)).reshape(-1, len(robot.parameters))
    angle = np.array([unit == "rad" for unit in robot.parameters.units])
    return jacobian[:, angle], jacobian[:, ~angle]


@finding(
    "eq. (3), text",
    "errors of l1 and l2 can be neglected",
    f"the zero errors cannot absorb them; a mean of {_PRINTED['after_mean']} mm remains, "
    "which zero errors alone do not explain",
    "mm",
    lambda exact, left: left > 1e-3 > exact,
)
def _left_by_lengths():
    """Rms error on z = 0 with the best zero offsets: exact lengths, and independent errors of 0.1 mm of every l1, l2
    and a.
    """
    zeros, lengths = _checked_jacobians()
    remaining = lengths - zeros @ np.linalg.lstsq(zeros, lengths, rcond=None)[0]
    return 0.0, 0.1 * np.sqrt((remaining**2).sum() / (len(remaining) / 3))


@finding(
    "text at Fig. 7",
    "arms levelled by eye, mean error 0.932 mm before calibration",
    "an eye that levels to 0.1 degree, or points taken relative to a common shift",
    "mm",
    lambda tenth, one: one > _PRINTED["before_max"] > tenth,
)
def _levelled_by_eye():
    """Rms error on z = 0 from independent zero errors of 0.1 and of 1 degree."""
    zeros, _ = _checked_jacobians()
    per_degree = np.radians(1.0) * np.sqrt((zeros**2).sum() / (len(zeros) / 3))
    return 0.1 * per_degree, per_degree


@finding(
    "eqs. (13) to (15)",
    "distances between any two positions, m >= 4",
    "distances from position 1, as the text at eq. (8) says",
    "1",
    lambda any_two, from_one: any_two > from_one,
)
def _equations():
    """Equations from 4 positions: between any two, where 3 positions would do for 3 errors, and from position 1."""
    return len(list(combinations(range(4), 2))), 4 - 1


COMPUTED = (_first_axis, _arms, _rank, _conditions, _least_seen, _left_by_lengths, _levelled_by_eye)
READ = (_equations, Finding("Fig. 6, target", "4055x dots", "40 x 55 dots"))


def audit_rows():
    """Rows of `audit` for paper C."""
    return paper.audit_rows("C", COMPUTED, READ, _LOST)
