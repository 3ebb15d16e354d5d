"""Misprints and contradictions of the papers, each recomputed: what the printed form gives, and what an independent
check gives.
"""

from dataclasses import replace

import numpy as np
import pandas as pd

from rrru.fit.residuals import Residuals
from rrru.genetic.algorithm import GeneticSettings, minimise
from rrru.plant.virtual_robot import VirtualRobot
from rrru.robots import singularity
from rrru.robots.rrru3 import Rrru3
from rrru.studies.delta import audit_paper_c
from rrru.studies.ptt3 import audit_paper_b
from rrru.studies.rrru3.audit_equations import misprinted_equations
from rrru.studies.rrru3.paper_a import ERRORS_MM, MIGRATION, TABLE_5, TABLE_6

_LINE_X = np.linspace(-800.0, -300.0, 26)


def audit_table():
    """Rows of `audit`."""
    found = {
        ("A", "computed"): [*misprinted_equations(), *_table_6(), *_trajectories(), *_gauge(), *_migration()],
        ("A", "as printed"): _contradictions(),
    }
    for paper, room in (("B", audit_paper_b), ("C", audit_paper_c)):
        found |= {
            (paper, "computed"): room.computed(),
            (paper, "as printed"): room.as_printed(),
            (paper, "lost"): room.lost(),
        }
    rows = [(paper, *row[:3], kind, *row[3:]) for (paper, kind), own in found.items() for row in own]
    names = ("paper", "where", "printed", "right", "kind", "check", "unit", "value_printed", "value_right", "shown")
    return pd.DataFrame(rows, columns=names)


def _line(y=0.0, z=600.0, x=_LINE_X):
    """Points of a line group, shape (n, 3)."""
    return np.stack([x, np.full_like(x, y), np.full_like(x, z)], axis=1)


def _predicted(values, points):
    """Position errors (n, 3) that errors by tied name predict at points (n, 3)."""
    robot = Rrru3(parameter_set="tied")
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
    measure = {
        name: singularity.translational_measure(robot, p, robot.inverse(p))
        for name, p in (("robot", points), ("turned", turned))
    }
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
        abs(ERRORS_MM["spiral_under_spiral_component_min"]) > ERRORS_MM["spiral_under_spiral_max"],
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


def _gauge():
    """Both radii on the spatial closure, which holds them as lengths of their own."""
    points = _line(x=_LINE_X[::5])
    robot = VirtualRobot()
    passive = robot.mechanism.passive_angles(points, robot.mechanism.inverse(points))

    def driven(radius_change, platform_change):
        lengths = robot.geometry.lengths_mm + np.array([radius_change, 0.0, 0.0, 0.0, platform_change])
        return replace(robot.geometry, lengths_mm=lengths).solve(robot.mechanism.inverse(points), passive).position_mm

    alone, together = (np.abs(driven(*change) - points).max() for change in ((0.0, 1.0), (1.0, 1.0)))
    yield (
        "Tables 5 and 6",
        "dR and dr as two results",
        "one result, dr - dR",
        "largest change on group 1, spatial closure: r alone 1 mm larger, and both R and r 1 mm larger",
        "mm",
        alone,
        together,
        bool(together < 1e-8 < 0.1 < alone),
    )


def _migration():
    """Migration with one population, run: the same seed at P_m = 0.1 and 1.0."""
    points = _line()
    robot = Rrru3(parameter_set="tied")
    theta = robot.inverse(points)
    residuals = Residuals(robot, theta, points + _predicted(TABLE_5, points), points)
    found = [
        minimise(
            residuals.mean_distance,
            robot.parameters.low,
            robot.parameters.high,
            GeneticSettings(migration_fraction=fraction, generations=100, stall_generations=0),
            1,
        ).objective
        for fraction in (0.1, 1.0)
    ]
    yield (
        "Table 4",
        "migration probability 0.7 is best",
        "with one population nothing migrates",
        "range of the ten printed objectives, and difference between P_m = 0.1 and 1.0 at the same seed here",
        "mm",
        max(MIGRATION) - min(MIGRATION),
        abs(found[1] - found[0]),
        bool(found[0] == found[1]),
    )
