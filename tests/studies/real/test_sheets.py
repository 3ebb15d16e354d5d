"""A user's columns as those of a campaign file, and what of them is refused."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from rrru.errors import ConfigError, IngestError
from rrru.studies.real.series import Series
from rrru.studies.real.sheets import in_file, in_series_terms, sheet, stated_noise
from tests.studies.real import simulated_arm

RAW = simulated_arm.log(6)
TWO = {"one": {"position": ["X", "Y", "Z"]}, "two": {"position": ["A", "B", "C"], "unit": "m"}}


def _series(**changes):
    return Series("mine_x", "mine", "x", "", Path("log_x.csv"), simulated_arm.section(**changes))


def _refused(raw, message, **changes):
    with pytest.raises(ConfigError, match=message):
        sheet(_series(**changes), raw)


def test_columns_come_in_our_units():
    found = sheet(_series(), RAW)
    np.testing.assert_allclose(found["q2_rad"], np.radians(RAW["J2"]))
    np.testing.assert_allclose(found["measured_x_mm"], RAW["X"])
    turns = Rotation.from_quat(found[[f"measured_q{axis}" for axis in "xyzw"]]).as_euler("ZYX", degrees=True)
    np.testing.assert_allclose(turns, RAW[[*"ABC"]], atol=1e-9)
    assert list(found["row"]) == [1, 2, 3, 4, 5, 6]


def test_targets_lie_together_and_those_that_were_not_seen_are_left_out():
    raw = RAW.astype(float)
    raw.loc[1, "A"] = raw.loc[2, "X"] = np.nan
    found = sheet(_series(readings=TWO), raw)
    expected = [(1, "one"), (1, "two"), (2, "one"), (3, "two"), *((row, name) for row in (4, 5, 6) for name in TWO)]
    assert list(zip(found["row"], found["target"], strict=True)) == expected
    np.testing.assert_allclose(found.loc[1, "measured_x_mm"], 1e3 * RAW["A"][0])


def test_every_third_row_is_held_out_where_the_file_says_nothing():
    assert list(sheet(_series(), RAW)["held_out"]) == [False, True, False, False, True, False]


@pytest.mark.parametrize("flags", [[0, 0, 1, 0, 0, 1], [False, False, True, False, False, True]])
@pytest.mark.parametrize("key", [{}, {"held_out": "held_out"}])
def test_rows_are_held_out_as_flagged(flags, key):
    assert list(sheet(_series(**key), RAW.assign(held_out=flags))["held_out"]) == [bool(flag) for flag in flags]


def test_flags_are_zero_or_one_and_leave_rows_to_fit():
    _refused(RAW.assign(held_out=1), "column held_out: 1 in every row")
    _refused(RAW.assign(held_out=[0, 1, 2, 0, 0, 0]), "row 3, column held_out: 2; allowed: 0 or 1")
    _refused(RAW.assign(held_out=[0, 1, None, 0, 0, 0]), "row 3, column held_out: nan; allowed: 0 or 1")
    _refused(RAW.assign(held_out="no"), "row 1, column held_out: 'no'; allowed: a number")
    _refused(RAW, "mine.held_out: no column 'flag'", held_out="flag")


@pytest.mark.parametrize(("column", "value"), [("X", "abc"), ("J2", "1,5"), ("A", "inf"), ("X", np.inf)])
def test_cells_without_a_number_are_named(column, value):
    raw = RAW.astype(object)
    raw.loc[3, column] = value
    _refused(raw, f"log_x.csv: row 4, column {column}: .*; allowed: a number")


def test_a_blank_joint_is_named_where_something_was_read():
    raw = RAW.astype(float)
    raw.loc[3, "J2"] = np.nan
    _refused(raw, "row 4, column J2: blank; allowed: a number where a target was seen")
    raw.loc[3, "X"] = np.nan
    assert len(sheet(_series(), raw)) == len(raw) - 1


def test_columns_that_are_not_there_are_named():
    _refused(RAW.drop(columns="J3"), r"real\.sets\.mine\.joints: no column 'J3' in log_x.csv, which has J1, J2")
    _refused(RAW.drop(columns="Y"), r"readings\.tcp: no column 'Y'")
    _refused(RAW.assign(X=np.nan), "no row has numbers in X, Y, Z")


def test_noise_is_that_of_the_usual_reading():
    raw = RAW.assign(s=[0.01, 0.01, 0.01, 0.01, 0.01, 5.0])
    reading = {"position": ["X", "Y", "Z"], "unit": "mm", "position_std": ["s", "s", "s"]}
    noise_mm, noise_rad = stated_noise(_series(readings={"tcp": reading}), raw)
    assert noise_mm == pytest.approx(0.01) and noise_rad is None
    for stated in (0.0, -0.01):
        with pytest.raises(ConfigError, match=r"log_x\.csv: column s: 0 or less at the median"):
            stated_noise(_series(readings={"tcp": reading}), RAW.assign(s=stated))


def test_a_temperature_is_passed_on_and_its_blanks_are_named():
    found = sheet(_series(temperature="T"), RAW.assign(T=21.5))
    assert (found["temperature_c"] == 21.5).all()
    _refused(RAW, r"mine\.temperature: no column 'T'", temperature="T")


def test_ingest_errors_use_the_terms_of_the_file():
    raw = RAW.astype(float)
    raw.loc[1, "A"] = np.nan
    series = _series(readings=TWO)
    whole = sheet(series, raw)
    said = {"file": "sheet.parquet", "row": 5, "column": "measured_x_mm", "value": "as in row 2", "allowed": "once"}
    (problem,) = in_series_terms(IngestError([said]), series, whole).problems
    assert problem == {"file": "log_x.csv", "row": 3, "column": "A", "value": "as in row 1 of two", "allowed": "once"}
    assert in_file("run 1 point 3: far", whole) == "row 2 of one: far"
    assert in_file("run 1 point 99: far", pd.DataFrame()) == "run 1 point 99: far"
