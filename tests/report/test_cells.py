"""Cells of a page's tables: short numbers that keep their value, words for names."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rrru.diagnosis.schemas import TABLES
from rrru.report import cells


@given(st.floats(allow_nan=False, allow_infinity=False, min_value=-1e12, max_value=1e12))
def test_a_number_keeps_four_digits(value):
    text = cells.short(value)
    assert float(text.replace(cells.MINUS, "-")) == pytest.approx(value, rel=5.001e-4, abs=1e-300) and len(text) < 12


_CELLS = (
    *((True, "yes"), (np.bool_(False), "no"), (None, "–"), (np.nan, "–"), (0.0, "0"), (-3, "\N{MINUS SIGN}3")),
    *((0.25, "0.25"), (1234.5, "1234"), (2.0, "2"), ("a-b", "a-b"), (np.inf, "∞"), (-np.inf, "\N{MINUS SIGN}∞")),
)
_HEADS = (
    *(("gap_rms_mm", "gap rms (mm)"), ("speed_mm_s", "speed (mm/s)"), ("points", "points")),
    *(("share_low", "share low"), ("per_travel_um_per_mm", "per travel (µm/mm)"), ("benefit_percent", "benefit (%)")),
)


@pytest.mark.parametrize(("value", "text"), _CELLS)
def test_cells_are_short(value, text):
    assert cells.text(value) == text


@pytest.mark.parametrize(("name", "words"), _HEADS)
def test_a_column_is_named_in_words(name, words):
    assert cells.words(name) == words


def test_a_grid_says_what_its_columns_mean():
    table = next(table for table in TABLES if table.name == "gap_sets")
    frame = pd.DataFrame({"campaign": ["a"], "rank": [1], "probability": [0.5]})
    made = cells.grid(frame, "key", "Title", table, heads={"rank": "place"})
    assert [column.words for column in made.columns] == ["campaign", "place", "probability"]
    assert [column.look for column in made.columns] == ["", "n", "n"]
    assert made.columns[1].hint == "1: most probable" and made.rows == [["a", "1", "0.5"]]
