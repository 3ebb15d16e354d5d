"""Paper B's claims and contradictions, recomputed, and what its scan has lost. Its dimensions are lost: Ptt3's nominal
ones stand in.
"""

import numpy as np
from scipy.optimize import brentq

from rrru.robots import singularity
from rrru.robots.ptt3 import Ptt3

_POINTS = np.array(
    [[0.0, 0.0, -250.0], [40.0, 25.0, -230.0], [-60.0, 10.0, -260.0], [15.0, -70.0, -210.0], [-35.0, -45.0, -280.0]]
)
_LOST = {
    "Table 1": ("dimensions of the robot", "L 350 mm, R 300 mm, r 60 mm, chosen"),
    "Table 2": ("five positions through inverse and forward solution", "five positions of our own in the tests"),
    "Table 3": ("conditions of the five experiments", "1 and 2 from the text; for 3 to 5 three payloads, chosen"),
    "Table 4": ("readings of the backlash measurement", "readings of a virtual encoder"),
    "Table 5": ("backlash of every screw under every load", "backlash of the virtual robot, chosen"),
    "Table 6": ("repeatability per unit travel", "only its order, better with compensation, can be compared"),
    "Table 7": ("tracker readings of experiment 3", "nothing"),
    "Table 8": ("errors before and after", "only the least benefits, 90 % and 80 %, can be compared"),
    "eq. (1)": ("closure of a leg", "|P - E_i| = L, E_i = (R - r + b_i) e_i"),
    "eq. (2)": ("inverse solution", "b_i = u_i - (R - r) + sqrt(L^2 - v_i^2 - Z^2)"),
    "eq. (3)": ("forward solution", "lower point of three spheres"),
    "eq. (4)": ("J", "row i: link direction over its share along rail i"),
    "eq. (5)": ("det J and its factors k1, k2", "det J = -Z kappa / (D1 D2 D3)"),
    "eqs. (6) to (9)": ("where det J vanishes, and most of the sentence before them", "Z = 0 or kappa = 0"),
    "eqs. (14) to (17)": ("Gaussian, hidden layer, weights, output", "a Gaussian network as the text describes it"),
    "eq. (18)": ("path of the platform, with the constants r1 and C", "a path of 180 positions, chosen"),
    "eq. (19)": ("backlash from the encoder's readings", "difference of the mean readings, 10 turns forwards and back"),
    "eq. (20)": ("repeatability per unit travel", "spread of 7 repeats over the travel"),
    "eq. (21)": (
        "benefit, and the mean errors A_b and A_a in it",
        "1 - A_a / A_b, means of absolute errors: signed ones may cancel",
    ),
    "Figures 10 to 18": ("curves", "the statements about them in the text"),
}


def lost():
    """Rows of `audit` (without `paper` and `kind`) for what the scan has lost."""
    return [
        (where, f"lost: {what}", instead, "what stands in for it", "", np.nan, np.nan, False)
        for where, (what, instead) in _LOST.items()
    ]


def as_printed():
    """Rows of `audit` (without `paper` and `kind`) for what contradicts itself or says less than it seems."""
    yield (
        "section 3.3, Table 8, Figs. 16 to 18",
        "errors after compensation, as results",
        "they are computed by putting the corrected sliders into eq. (13); nothing is measured after compensation",
        "as printed",
        "",
        np.nan,
        np.nan,
        True,
    )
    yield (
        "eq. (2) and section 3.2",
        "dimensions R, r, L and hR, hr, l",
        "one name each",
        "as printed",
        "",
        np.nan,
        np.nan,
        True,
    )


def computed():
    """Rows of `audit` (without `paper` and `kind`) that a computation shows."""
    yield from _constraint_singularity()
    yield _kinematic_singularity()
    yield _first_order()
    yield _relative_heights()


def _constraint_singularity():
    """R = r against r < R."""
    where, printed = "section 2.2 and conclusion (2)", "a constraint singularity at R = r, so none for r < R"
    robots = (Ptt3(R_mm=60.0, r_mm=60.0), Ptt3())
    point = _POINTS[:1]
    determinants = [np.linalg.det(robot.jacobian(point, robot.inverse(point)))[0] for robot in robots]
    yield (
        where,
        printed,
        "R and r shift the sliders only: at a position neither J nor the couples depend on them",
        "det J at (0, 0, -250) with R = r, where it should be 0, and with R - r = 240 mm",
        "1",
        *determinants,
        bool(abs(determinants[0] - determinants[1]) < 1e-9 < abs(determinants[0])),
    )
    upright = np.array([[0.0, 0.0, -np.sqrt(robots[0].L_mm ** 2 - 1e-6)]])
    sliders = [robot.inverse(upright) for robot in robots]
    measures = [
        singularity.constraint_measure(robot, upright, slider)[0] for robot, slider in zip(robots, sliders, strict=True)
    ]
    yield (
        where,
        printed,
        "upright links let the platform turn, for r < R as well (U joints with tangential outer axes)",
        "constraint measure 0.001 mm from upright links, with R = r and with R - r = 240 mm",
        "1",
        *measures,
        bool(max(measures) < 1e-4),
    )
    yield (
        where,
        printed,
        "only a travel that ends before b = -(R - r) keeps the platform out of it",
        "slider position at which the links stand upright, with R = r and with R - r = 240 mm",
        "mm",
        *(slider[0, 0] for slider in sliders),
        bool(sliders[1].max() < -200.0),
    )


def _kinematic_singularity():
    """Nearest zero of det J below the rails, along the first rail's azimuth."""
    robot = Ptt3()
    distance = brentq(lambda x: robot.determinant_factors([[x, 0.0, -250.0]])[1][0], 10.0, 280.0)
    point = np.array([[distance, 0.0, -250.0]])
    measure = singularity.translational_measure(robot, point, robot.inverse(point))[0]
    return (
        "section 2.2, eqs. (6) to (9)",
        "no kinematic singularity away from eqs. (7) and (9), which are lost",
        "det J vanishes where Z = 0, and where u_i = sqrt(L^2 - Z^2) on a rail's azimuth and on the surface through it",
        "distance from the axis at Z = -250 mm where det J crosses zero on the first rail's azimuth",
        "mm",
        np.nan,
        distance,
        bool(measure < 1e-6),
    )


def _first_order():
    """Eq. (11) against eq. (12)."""
    robot = Ptt3()
    sliders = robot.inverse(_POINTS)
    jacobian = robot.jacobian(_POINTS, sliders)

    def apart(size_mm):
        steps = size_mm * np.eye(3)
        return max(np.abs(robot.inverse(_POINTS - step) - (sliders - jacobian @ step)).max() for step in steps)

    return (
        "eqs. (11) and (12)",
        "f(p - dp) = f(p) - J dp",
        "equal to first order only; half the error leaves a quarter of the difference",
        "largest difference of the two corrected sliders over five positions, for an error of 0.5 mm and of 1 mm",
        "mm",
        apart(0.5),
        apart(1.0),
        bool(abs(apart(1.0) / apart(0.5) - 4.0) < 0.1),
    )


def _relative_heights():
    """Vertical errors relative to the first point."""
    robot = Ptt3(parameter_set="tied")
    moved = robot.forward(robot.inverse(_POINTS), robot.parameters.vector({"dL": 1.0}))[:, 2] - _POINTS[:, 2]
    relative = np.abs(moved - moved[0])[1:].mean()
    return (
        "section 3.2, vertical error",
        "z error relative to the first position",
        "what all heights share, most of a wrong link length, is not in the z benefit",
        "mean z error over five positions for links 1 mm too long: relative to the first position, and in full",
        "mm",
        relative,
        np.abs(moved).mean(),
        bool(relative < np.abs(moved).mean()),
    )
