"""Paper B's claims and contradictions, recomputed, and what its scan has lost.

Its dimensions are lost too: Ptt3's nominal ones are used instead.
"""

from pathlib import Path

import numpy as np

from rrru.kinematics import singularity
from rrru.robots.ptt3 import Ptt3
from rrru.studies import paper
from rrru.studies.paper import Finding, finding

POINTS = np.array(
    [[0.0, 0.0, -250.0], [40.0, 25.0, -230.0], [-60.0, 10.0, -260.0], [15.0, -70.0, -210.0], [-35.0, -45.0, -280.0]]
)
# R = r, where the paper sees a singularity, and the nominal robot
_ROBOTS = (Ptt3(R_mm=60.0, r_mm=60.0), Ptt3())
# links 0.001 mm from upright
_UPRIGHT = np.array([[0.0, 0.0, -np.sqrt(_ROBOTS[0].L_mm ** 2 - 1e-6)]])
_CONSTRAINT = ("section 2.2 and conclusion (2)", "a constraint singularity at R = r, so none for r < R")
_LOST = paper.read_lost(Path(__file__).with_name("lost.csv"))


@finding(
    *_CONSTRAINT,
    "R and r shift the sliders only: at a position neither J nor the couples depend on them",
    "1",
    lambda equal, apart: abs(equal - apart) < 1e-9 < abs(equal),
)
def _determinants():
    """Det J at (0, 0, -250) with R = r, where it should be 0, and with R - r = 240 mm."""
    return tuple(np.linalg.det(robot.jacobian(POINTS[:1], robot.inverse(POINTS[:1])))[0] for robot in _ROBOTS)


@finding(
    *_CONSTRAINT,
    "upright links let the platform turn, for r < R as well (bars in pairs on ball joints)",
    "1",
    lambda equal, apart: equal < 1e-4 and apart < 1e-4,
)
def _constraint_measures():
    """Constraint measure 0.001 mm from upright links, with R = r and with R - r = 240 mm."""
    return tuple(singularity.constraint_measure(robot, _UPRIGHT, robot.inverse(_UPRIGHT))[0] for robot in _ROBOTS)


@finding(
    *_CONSTRAINT,
    "only a travel that ends before b = -(R - r) keeps the platform out of it",
    "mm",
    lambda _, apart: apart < -200.0,
)
def _upright_sliders():
    """Slider position at which the links are upright, with R = r and with R - r = 240 mm."""
    return tuple(robot.inverse(_UPRIGHT)[0, 0] for robot in _ROBOTS)


@finding(
    "section 2.2, eqs. (6) to (9)",
    "no kinematic singularity away from eqs. (7) and (9), which are lost",
    "det J vanishes where Z = 0, and where u_i = sqrt(L^2 - Z^2) on a rail's azimuth and on the surface through it",
    "mm",
    lambda _, distance, measure: measure < 1e-6 < distance,
)
def _kinematic_singularity():
    """Distance from the axis at Z = -250 mm where det J crosses zero on the first rail's azimuth."""
    from scipy.optimize import brentq

    robot = _ROBOTS[1]
    distance = brentq(lambda x: robot.determinant_factors([[x, 0.0, -250.0]])[1][0], 10.0, 280.0)
    point = np.array([[distance, 0.0, -250.0]])
    return np.nan, distance, singularity.translational_measure(robot, point, robot.inverse(point))[0]


@finding(
    "eqs. (11) and (12)",
    "f(p - dp) = f(p) - J dp",
    "equal to first order only; half the error leaves a quarter of the difference",
    "mm",
    lambda half, full: abs(full / half - 4.0) < 0.1,
)
def _first_order():
    """Largest difference of the two corrected sliders over five positions, for an error of 0.5 mm and of 1 mm."""
    robot = _ROBOTS[1]
    sliders = robot.inverse(POINTS)
    jacobian = robot.jacobian(POINTS, sliders)
    return tuple(
        max(np.abs(robot.inverse(POINTS - step) - (sliders - jacobian @ step)).max() for step in size * np.eye(3))
        for size in (0.5, 1.0)
    )


@finding(
    "section 3.2, vertical error",
    "z error relative to the first position",
    "what all heights share, most of a wrong link length, is not in the z benefit",
    "mm",
    lambda relative, full: relative < full,
)
def _heights():
    """Mean z error over five positions for links 1 mm too long: relative to the first position, and in full."""
    robot = Ptt3(parameter_set="tied")
    off = robot.forward(robot.inverse(POINTS), robot.parameters.vector({"dL": 1.0}))[:, 2] - POINTS[:, 2]
    return np.abs(off - off[0])[1:].mean(), np.abs(off).mean()


COMPUTED = (_determinants, _constraint_measures, _upright_sliders, _kinematic_singularity, _first_order, _heights)
READ = (
    Finding(
        "section 3.3, Table 8, Figs. 16 to 18",
        "errors after compensation, as results",
        "they are computed by putting the corrected sliders into eq. (13); nothing is measured after compensation",
    ),
    Finding("eq. (2) and section 3.2", "dimensions R, r, L and hR, hr, l", "one name each"),
)


def audit_rows():
    """Rows of `audit` for paper B."""
    return paper.audit_rows("B", COMPUTED, READ, _LOST)
