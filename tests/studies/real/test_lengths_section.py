"""Rows of machines of which lengths are known: their numbers and flags, and what of them is refused."""

import pandas as pd
import pytest

from rrru.errors import ConfigError, IngestError
from rrru.studies.real import belts, figures
from rrru.studies.real.lengths_section import Section, held_out, row_numbers

READ = Section({"files": "run_x.csv"}, "mine", ("files",), ())


@pytest.mark.parametrize("numbers", [["a", 2], [1, 1], [1, None], [1.5, 2]])
def test_rows_have_numbers_of_their_own(numbers):
    with pytest.raises(IngestError, match=r"run_x\.csv, row [12], column row: .*; allowed: whole numbers, each once"):
        row_numbers(pd.DataFrame({"row": numbers}), READ)


def test_rows_without_numbers_are_counted():
    assert list(row_numbers(pd.DataFrame({"x": [5, 6]}), READ)) == [1, 2]


def test_flags_of_rows_held_out_are_zero_or_one():
    assert list(held_out(pd.DataFrame({"held_out": [0, 1]}), READ)) == [False, True]
    assert held_out(pd.DataFrame({"held_out": [1, 1]}), READ) is None
    with pytest.raises(IngestError, match=r"run_x\.csv, row 2, column held_out: got 'x'; allowed: 0 or 1"):
        held_out(pd.DataFrame({"held_out": [0, "x"]}), READ)


@pytest.mark.parametrize(
    ("key", "change"),
    [("unit", {"heights_mm": {"a": 900.0}}), ("lengths", {"lengths": {"a": "a", "b": "b", "c": "c", "d": "a"}})],
)
def test_belts_have_columns_of_their_own_and_are_longer_than_high(key, change):
    frame = pd.DataFrame({name: [700.0 + 10 * k * k, 800.0, 850.0, 820.0] for k, name in enumerate("abcd")})
    section = {"kind": "belts", "files": "run_x.csv", "lengths": {name: name for name in "abcd"}} | change
    with pytest.raises(ConfigError, match=rf"real\.sets\.mine\.{key}: got"):
        belts.study(frame, section, "mine")


def test_a_set_without_files_has_a_page_that_says_so():
    tables = {name: pd.DataFrame(columns=["campaign"]) for name in ("real_points", "real_parameters")}
    (text,) = figures.lengths(tables, {"set": "mine"}).texts
    assert text.get_text() == "mine: no usable file of this set was found"
