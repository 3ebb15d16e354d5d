"""The audit of paper A against values that were computed apart from this project, and its error numbers by hand."""

import numpy as np
import pytest

from rrru.studies.rrru3 import paper
from rrru.studies.rrru3.audit import audit_rows
from rrru.studies.rrru3.study_numbers import group_orders, study_numbers


def test_sourced_values():
    audit = audit_rows()

    def values(where, text):
        row = audit[(audit["where"] == where) & audit["check"].str.contains(text, regex=False)]
        return row[["value_printed", "value_right"]].to_numpy().squeeze(axis=0)

    assert values("eq. (6), K15, K16, K17", "theta11") == pytest.approx((-114.87, 65.13), abs=0.006)
    assert values("Table 6", "smallest error predicted") == pytest.approx((16.18, 2.88), abs=0.006)
    assert values("Table 6", "largest error predicted") == pytest.approx((26.99, 8.62), abs=0.006)
    assert values("Table 6", "smallest difference") == pytest.approx((14.70, 0.34), abs=0.006)
    assert values("Table 6", "largest difference") == pytest.approx((19.63, 0.91), abs=0.006)
    assert values("section 3.2, start and end points", "|x| where")[0] == pytest.approx(782.0, abs=1.0)
    assert -790.0 < values("section 3.2, group 1", "x where")[1] < -780.0
    assert "Table 5 predicts 2.57, measured 4.232" in audit["check"].str.cat()


def test_paper_numbers_are_the_sourced_ones():
    """A sample typed in a second time; the sums guard the rest."""
    by_item = {(n.item, n.source): n.value for n in paper.NUMBERS}
    assert by_item["P_c=1.0", "Table 3, Fig. 6"] == 0.6516 and by_item["P_m=0.7", "Table 4, Fig. 7"] == 0.5112
    assert sum(paper.CROSSOVER) == pytest.approx(5.3308) and sum(paper.MIGRATION) == pytest.approx(5.1134)
    assert by_item["spiral_dL23", "Table 6"] == -0.1612 and by_item["lines_da", "Table 5, dr - dR"] == 2.0955
    assert len(by_item) == len(paper.NUMBERS) == 20 + 20 + 2 * 15 + 17 + 2 + 10


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
    assert numbers["spiral_under_lines_max"] == pytest.approx(np.sqrt(29.0))
    assert numbers["spiral_under_lines_z_abs_max"] == 2.0 and numbers["spiral_under_spiral_component_min"] == -0.7
    assert numbers["lines_2_7_under_spiral_max"] == 0.09
    assert set(numbers) | {"lines_objective"} == set(paper.ERRORS_MM)
    orders = group_orders(trajectory, before, lines, spiral)
    assert orders["group6_before"] == pytest.approx(9.0 / 4.0 - 1.0) and orders["centre_before"] < 0.0
    # means 3.5, 1, 1, 1, 1, 9, 1
    assert orders["outer_before"] == pytest.approx(1.0 / 3.5 - 1.0)
    assert orders["centre_spiral"] == pytest.approx(1.0 / 3.5 - 1.0)
    # draws first
    both = study_numbers(trajectory, *(np.stack([errors, 2.0 * errors]) for errors in (before, lines, spiral)))
    assert all(both[item].tolist() == pytest.approx([value, 2.0 * value]) for item, value in numbers.items())
