"""The audit against values that were computed apart from this project, and the published table's completeness."""

import numpy as np
import pytest

from rrru.studies.rrru3 import paper_a
from rrru.studies.rrru3.audit import audit_table
from rrru.studies.rrru3.study_numbers import group_orders, study_numbers
from tests.schemas import check


@pytest.fixture(scope="module")
def audit():
    return check("audit", audit_table())


def _values(audit, where, text):
    row = audit[(audit["where"] == where) & audit["check"].str.contains(text, regex=False)]
    assert len(row) == 1
    return row["value_printed"].iloc[0], row["value_right"].iloc[0]


def test_every_misprint_shows(audit):
    """What does not show is what the scans lost, and the one claim that holds."""
    hidden = audit[~audit["shown"]]
    assert (hidden[hidden["kind"] != "lost"]["right"] == "they do, in rank").all() and (
        hidden["kind"] != "lost"
    ).sum() == 1
    assert not audit[audit["kind"] == "lost"]["shown"].any()
    shown = audit.groupby("paper")["shown"].sum()
    assert shown["A"] >= 20 and shown["B"] >= 8 and shown["C"] >= 8
    assert (audit["printed"].str.len() > 0).all() and (audit["right"].str.len() > 0).all()


@pytest.mark.parametrize(
    ("where", "text", "printed", "right"),
    [
        ("eq. (6), K15, K16, K17", "theta11", -114.87, 65.13),
        ("Table 6", "smallest error predicted", 16.18, 2.88),
        ("Table 6", "largest error predicted", 26.99, 8.62),
        ("Table 6", "smallest difference", 14.70, 0.34),
        ("Table 6", "largest difference", 19.63, 0.91),
    ],
)
def test_sourced_values(audit, where, text, printed, right):
    assert _values(audit, where, text) == pytest.approx((printed, right), abs=0.006)


def test_where_the_line_is_singular(audit):
    assert _values(audit, "section 3.2, start and end points", "|x| where")[0] == pytest.approx(782.0, abs=1.0)
    assert -790.0 < _values(audit, "section 3.2, group 1", "x where")[1] < -780.0


def test_paper_numbers_are_the_sourced_ones():
    """A sample typed in a second time; the sums guard the rest."""
    by_item = {(n.item, n.source): n.value for n in paper_a.NUMBERS}
    assert by_item["P_c=1.0", "Table 3, Fig. 6"] == 0.6516 and by_item["P_m=0.7", "Table 4, Fig. 7"] == 0.5112
    assert sum(paper_a.CROSSOVER) == pytest.approx(5.3308) and sum(paper_a.MIGRATION) == pytest.approx(5.1134)
    assert by_item["spiral_dL23", "Table 6"] == -0.1612 and by_item["lines_da", "Table 5, dr - dR"] == 2.0955
    assert len(by_item) == len(paper_a.NUMBERS) == 20 + 20 + 2 * 15 + 17 + 2


def test_study_numbers_by_hand():
    trajectory = np.array(["line_1"] * 2 + [f"line_{k}" for k in range(2, 8)] + ["spiral"] * 2)
    before = np.zeros((10, 3))
    before[:, 0] = [3.0, 4.0, 1.0, 1.0, 1.0, 1.0, 9.0, 1.0, 2.0, 2.0]
    lines, spiral = before / 10.0, before / 100.0
    lines[8:] = [[-5.0, 0.0, 0.0], [3.0, 4.0, -2.0]]
    spiral[9] = [0.5, -0.7, 0.1]
    numbers = study_numbers(trajectory, before, lines, spiral)
    assert numbers["group1_before_min"] == 3.0 and numbers["lines_before_max"] == 9.0
    assert (numbers["group1_after_max"], numbers["lines_after_min"]) == (0.4, 0.1)
    assert (numbers["spiral_under_lines_x_min"], numbers["spiral_under_lines_x_max"]) == (-5.0, 3.0)
    assert (
        numbers["spiral_under_lines_max"] == pytest.approx(np.sqrt(29.0))
        and numbers["spiral_under_lines_z_abs_max"] == 2.0
    )
    assert numbers["spiral_under_spiral_component_min"] == -0.7 and numbers["lines_2_7_under_spiral_max"] == 0.09
    assert set(numbers) | {"lines_objective"} == set(paper_a.ERRORS_MM)
    orders = group_orders(trajectory, before, lines)
    assert orders["group6_before"] == pytest.approx(9.0 / 4.0 - 1.0) and orders["centre_before"] < 0.0
