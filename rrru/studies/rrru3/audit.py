"""Misprints and contradictions of paper A: what the printed form gives, and what an independent check gives."""

import numpy as np

from rrru.studies import paper
from rrru.studies.paper import Finding
from rrru.studies.rrru3 import misprints
from rrru.studies.rrru3.paper import ERRORS_MM, REPEATED

_FRAME = (
    "section 3.2, start and end points",
    "frame not stated; eqs. (4), (8) suggest theirs",
    "robot frame of eq. (7)",
)
_TABLE_6 = ("Table 6", "drive angle errors in rad", "very likely degrees")
_TWICE = "abstract and section 3.3"


def _axes(joints):
    """Number of single-axis joints of a leg: a revolute joint R is one, a universal joint U two."""
    return sum({"R": 1, "U": 2}[joint] for joint in joints)


def _link(matrix, length):
    """Finding on the matrix of a link."""
    return Finding(
        f"{matrix}, elements (1,4) and (2,4)",
        "L theta",
        "L c(theta), L s(theta)",
        f"length of the link of {matrix[1:]} turned by theta11",
        "mm",
        lambda: misprints.link_length(length),
        lambda printed, right: abs(right - length) < 1e-9 < abs(printed - length),
    )


def _table_6(bound, take, measured):
    """Findings on the unit of Table 6, from its smallest or its largest errors."""
    yield Finding(
        *_TABLE_6,
        f"{bound} error predicted on group 1, read in rad and in deg; "
        f"Table 5 predicts {{2:.2f}}, measured {ERRORS_MM[measured]}",
        "mm",
        lambda: misprints.error_size(take),
        lambda rad, degrees, table_5: abs(degrees - table_5) < abs(rad - table_5),
    )
    yield Finding(
        *_TABLE_6,
        f"{bound} difference between Tables 5 and 6 on group 1, in rad and in deg; "
        "'the spiral's calibration compensates the lines to 0.08-1.12 mm' needs about 1",
        "mm",
        lambda: misprints.difference_size(take),
        lambda rad, degrees: degrees < ERRORS_MM["lines_after_max"] < rad,
    )


EQUATIONS = (
    Finding(
        "eq. (1), element (2,4)",
        "L c(theta)",
        "L s(theta)",
        "y of a unit link turned by theta11 about z",
        "1",
        misprints.unit_link,
        lambda printed, rotated, right: abs(right - rotated) < 1e-12 < abs(printed - rotated),
    ),
    _link("T11", 400.0),
    _link("T12", 100.0),
    _link("T13", 800.0),
    Finding(
        "eq. (6), K15, K16, K17",
        "K15 with -2 L11 (r-R-Px), K16 = +4 L11 Pz, K17 with +2 L11 (r-R-Px)",
        "all three signs reversed",
        "theta11 at x = -700, y = 0, z = 600: both printed roots are half a turn from the closure's, "
        "with the signs reversed they are them",
        "deg",
        misprints.equation_6,
        lambda printed, right, worst: worst < 1e-6 and abs(abs(printed - right) - 180.0) < 1e-6,
    ),
    Finding(
        "eq. (7), l_A12A13",
        "-s(theta11 + theta12)",
        "-s(theta11 + theta12) L12",
        "height that the three links of leg 1 span at (-700, 60, 600); it has to be 600",
        "mm",
        misprints.equation_7,
        lambda printed, right: abs(right - 600.0) < 1e-6 < abs(printed - 600.0),
    ),
    Finding(
        "eq. (8), third leg",
        "(Pz + b2)",
        "(Pz + c2)",
        "left side at (-700, 60, 600) with the angles of the inverse; it has to be 0",
        "mm^2",
        misprints.equation_8,
        lambda printed, right: abs(right) < 1e-6 < abs(printed),
    ),
)
RESULTS = (
    *_table_6("smallest", np.min, "group1_before_min"),
    *_table_6("largest", np.max, "group1_before_max"),
    Finding(
        *_FRAME,
        "smallest translational measure on group 1: in the frame of eqs. (4), (8), and in the robot frame",
        "1",
        misprints.translational_margin,
        lambda printed, right: printed < 0.27 < right,
    ),
    Finding(
        *_FRAME,
        "|x| where group 1 in the frame of eqs. (4), (8) crosses a translational singularity; "
        "null: none in the robot frame",
        "mm",
        misprints.translational_crossing,
        lambda printed, _: 700.0 <= printed <= 800.0,
    ),
    Finding(
        "section 3.2, group 1",
        "spikes and a poor boundary, unexplained",
        "a constraint singularity lies on the line, which eq. (8) does not see",
        "x where the platform can turn with locked drives, on y = 0",
        "mm",
        misprints.constraint_crossing,
        lambda _, right: -800.0 <= right <= -700.0,
    ),
    Finding(
        "section 3.2, groups 2-7",
        "positions not given",
        "y = +-112 fits the largest error",
        "largest error that Table 5 predicts at y = 112, against the printed largest error (group 6)",
        "mm",
        lambda: (ERRORS_MM["lines_before_max"], misprints.largest_error_at(112.0)),
        lambda printed, right: abs(right / printed - 1.0) < 0.05,
    ),
    Finding(
        "Tables 5 and 6",
        "dR and dr as two results",
        "one result, dr - dR",
        "largest change on group 1, spatial closure: r alone 1 mm larger, and both R and r 1 mm larger",
        "mm",
        misprints.radii,
        lambda printed, right: right < 1e-8 < 0.1 < printed,
    ),
    Finding(
        "Table 4",
        "migration probability 0.7 is best",
        "with one population nothing migrates",
        "range of the ten printed objectives, and difference between P_m = 0.1 and 1.0 at the same seed here",
        "mm",
        misprints.migration,
        lambda printed, right: right == 0.0 < printed,
    ),
)
CONTRADICTIONS = (
    Finding(
        _TWICE,
        "lines after spiral calibration: max 1.18 and 1.12",
        "undecidable",
        unit="mm",
        values=lambda: (REPEATED[0].value, ERRORS_MM["lines_2_7_under_spiral_max"]),
        shows=lambda abstract, body: abs(abstract - body) > 0.0,
    ),
    Finding(
        _TWICE,
        "spiral after its own calibration: max 1.56, but a component of -1.63",
        "the largest error is at least 1.63",
        "a component cannot exceed the error's size",
        "mm",
        lambda: (ERRORS_MM["spiral_under_spiral_max"], abs(ERRORS_MM["spiral_under_spiral_component_min"])),
        lambda size, component: component > size,
    ),
    Finding(
        "title and text",
        "3-RRU and 3-RRRU",
        "3-RRRU",
        "single-axis joints per leg: RRU has 4, Fig. 2 shows five (A_i1 to A_i5)",
        "1",
        lambda: (_axes("RRU"), _axes("RRRU")),
        lambda named, drawn: named < drawn,
    ),
)


def audit_rows():
    """Rows of `audit` for paper A."""
    return paper.audit_rows("A", (*EQUATIONS, *RESULTS), CONTRADICTIONS)
