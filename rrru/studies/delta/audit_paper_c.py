"""Paper C's claims and contradictions, recomputed, and what its scan has lost. The paper gives no dimensions: Delta's
nominal ones stand in.
"""

from itertools import combinations

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.fit.identifiability import analyse
from rrru.robots.delta import Delta
from rrru.studies.delta.paper_c import RESULTS

_AFTER_MEAN_MM = next(number.value for number in RESULTS if number.item == "after_mean")
_CLAIM = "x, y errors of the platform along one plane identify the zero errors"
# ASSUME the size of the part of the plane that the poses and the tracker's points cover
_CALIBRATED_MM, _CHECKED_MM = 200.0, 300.0
_LOST = {
    "eq. (1)": ("vector loop", "r = a_i + l1 u_i + l2 w_i"),
    "eq. (2)": ("direction of a drive arm", "Rot(Z, beta_i - pi/2) Rot(x_i, -theta_i) e_2"),
    "eqs. (3) to (7)": ("error model, Q_x and J", "w_i . dr = l1 w_i . du_i, Q_x turns y towards -z; dr = J dtheta"),
    "eqs. (8) and (9)": ("model distance and its first-order form, A_j", "|r_j - r_1|, its derivative by dtheta"),
    "eqs. (10) to (12)": ("optical centre, measured distance, B_j", "O_cj = -R_j^T T_j, |O_cj - O_c1|"),
    "eqs. (13) to (15)": (
        "distance error and the system H dtheta = b",
        "least squares, H^+ = (H^T H)^-1 H^T as printed",
    ),
    "Table 1": ("zero errors that were found", "zero errors of the virtual robot, chosen"),
    "Figures 7 and 8": ("error over the plane", "the largest and the mean error in the text"),
    "dimensions": ("none are printed", "l1 375 mm, l2 900 mm, a 125 mm, chosen"),
}


def lost():
    """Rows of `audit` (without `paper` and `kind`) for what the scan has lost."""
    return [
        (where, f"lost: {what}", instead, "what stands in for it", "", np.nan, np.nan, False)
        for where, (what, instead) in _LOST.items()
    ]


def as_printed():
    """Rows of `audit` (without `paper` and `kind`) for what contradicts itself or says less than it seems."""
    pairs = len(list(combinations(range(4), 2)))
    yield (
        "eqs. (13) to (15)",
        "distances between any two positions, m >= 4",
        "distances from position 1, as the text at eq. (8) says",
        "equations from 4 positions: between any two, where 3 positions would do for 3 errors, and from position 1",
        "1",
        float(pairs),
        3.0,
        pairs > 3,
    )
    yield ("Fig. 6, target", "4055x dots", "40 x 55 dots", "as printed", "", np.nan, np.nan, True)


def computed():
    """Rows of `audit` (without `paper` and `kind`) that a computation shows."""
    yield from _signs()
    yield from _identifiability()
    yield from _what_remains()


def _signs():
    """Where the minus signs belong that the scan prints as question marks."""
    arm = Rotation.from_euler("x", 0.0).apply([0.0, 1.0, 0.0])

    def off_y(first, back):
        beta = first + 2.0 * np.pi / 3.0
        direction = Rotation.from_euler("z", beta + back).apply(arm)
        return np.degrees(np.arccos(np.clip(direction[1], -1.0, 1.0)))

    plus, minus = off_y(np.pi / 6.0, -np.pi / 2.0), off_y(-np.pi / 6.0, -np.pi / 2.0)
    yield (
        "structure angles, Fig. 2",
        "beta_i = ? pi/6 + 2 pi (i ? 1)/3",
        "-pi/6 + 2 pi (i - 1)/3",
        "angle between Y and the second drive axis's middle with +pi/6 and with -pi/6; the text says that Y points there",
        "deg",
        plus,
        minus,
        bool(minus < 1e-9 < plus),
    )
    plus = off_y(-np.pi / 6.0, np.pi / 2.0)
    yield (
        "eq. (2), text",
        "beta_i?pi2",
        "beta_i - pi/2",
        "angle between Y and the second arm, level, turned by beta_2 + pi/2 and by beta_2 - pi/2; arms point outwards",
        "deg",
        plus,
        minus,
        bool(minus < 1e-9 < plus),
    )


def _spread(height_mm, radius_mm, count):
    """Positions (count, 3) in mm spread evenly over a disc (sunflower)."""
    k = np.arange(count)
    radius, angle = radius_mm * np.sqrt((k + 0.5) / count), k * np.pi * (3.0 - np.sqrt(5.0))
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(count, height_mm)], axis=1)


def _planar_jacobians(robot):
    """Derivatives by the zero errors in the plane z = 100: positions (20, 3, 3), x, y displacements (19, 2, 3),
    distances (19, 1, 3).
    """
    points = _spread(100.0, _CALIBRATED_MM, 20)
    position = robot.parameter_jacobian(points, robot.inverse(points))
    moved, way = position[1:] - position[0], points[1:] - points[0]
    distance = np.einsum("na,nak->nk", way / np.linalg.norm(way, axis=1, keepdims=True), moved)
    return position, moved[:, :2], distance[:, None]


def _identifiability():
    """What displacements and distances in the plane z = 100 see of the zero errors."""
    robot = Delta()
    position, displacement, distance = _planar_jacobians(robot)
    by_distance, by_displacement = analyse(robot, distance), analyse(robot, displacement)
    yield (
        "conclusion (1)",
        _CLAIM,
        "they do, in rank",
        "zero errors, and rank of the distances from position 1 over 20 positions at z = 100 mm, within 200 mm of the axis",
        "1",
        3.0,
        float(by_distance.rank),
        by_distance.rank < 3,
    )
    yield (
        "conclusion (1)",
        _CLAIM,
        "eqs. (8) to (15) use distances, which keep half of the x, y displacements",
        "condition over these 20 positions: x, y displacements, and distances",
        "1",
        by_displacement.condition,
        by_distance.condition,
        bool(by_distance.condition > by_displacement.condition),
    )
    weak = by_distance.directions[-1] * by_distance.scale
    shift, stretch = (np.sqrt(((matrix @ weak) ** 2).sum() / len(matrix)) for matrix in (position, distance))
    yield (
        "conclusion (1)",
        _CLAIM,
        "differences between the zero errors mostly shift the whole plane, which distances do not see: "
        f"the position is off {shift / stretch:.0f} times as far as the distances",
        "rms change for the least seen combination of zero errors, 1 mm at the arms' ends: of the distances, and of the position",
        "mm",
        stretch,
        shift,
        bool(shift > stretch),
    )


def _what_remains():
    """Errors of arms, links and base that the zero errors cannot take up, and what the error before calibration
    says.
    """
    robot, points = Delta(parameter_set="legs"), _spread(0.0, _CHECKED_MM, 200)
    jacobian = robot.parameter_jacobian(points, robot.inverse(points)).reshape(-1, len(robot.parameters))
    angle = np.array([unit == "rad" for unit in robot.parameters.units])
    zeros, lengths = jacobian[:, angle], jacobian[:, ~angle]
    kept = lengths - zeros @ np.linalg.lstsq(zeros, lengths, rcond=None)[0]
    left = 0.1 * np.sqrt((kept**2).sum() / len(points))
    yield (
        "eq. (3), text",
        "errors of l1 and l2 can be neglected",
        f"the zero errors cannot take them up; a mean of {_AFTER_MEAN_MM} mm is left, which zero errors alone do not explain",
        "rms error on z = 0 with the best zero offsets: exact lengths, and independent errors of 0.1 mm of every l1, l2 and a",
        "mm",
        0.0,
        left,
        bool(left > 1e-3),
    )
    per_degree = np.radians(1.0) * np.sqrt((zeros**2).sum() / len(points))
    yield (
        "text at Fig. 7",
        "arms levelled by eye, mean error 0.932 mm before calibration",
        "an eye that levels to 0.1 degree, or points taken relative to a common shift",
        "rms error on z = 0 from independent zero errors of 0.1 and of 1 degree",
        "mm",
        0.1 * per_degree,
        per_degree,
        bool(per_degree > 1.442 > 0.1 * per_degree),
    )
