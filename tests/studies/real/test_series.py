"""Which files a data set has, and which sections and files are refused."""

import pytest

from rrru.errors import ConfigError
from rrru.studies.real import series
from tests.refusals import refusals
from tests.studies.real import simulated_arm

ROBOTS = {"arm": simulated_arm.robot(), "rrru3": {"L1_mm": 400.0}}


def _real(folder, **changes):
    return {"folder": str(folder), "sets": {"mine": simulated_arm.section(**changes)}}


def _written(folder, text, name="log_x.csv"):
    (folder / "arm").mkdir(exist_ok=True)
    (folder / "arm" / name).write_text(text)
    return series.found(_real(folder), "mine")[0]


@pytest.fixture(autouse=True)
def _nobodys_folder(monkeypatch):
    monkeypatch.delenv(series.VARIABLE, raising=False)


def test_series_are_called_by_set_file_and_variant(tmp_path):
    (tmp_path / "arm").mkdir()
    for name in ("log_b.csv", "log_a.csv", "other.csv"):
        (tmp_path / "arm" / name).write_text("J1\n1\n")
    real = _real(tmp_path, variants={"stated": {}, "read": {"joints": {"q1_rad": "r1"}}})
    found = series.found(real, "mine")
    assert [one.name for one in found] == ["mine_a_stated", "mine_a_read", "mine_b_stated", "mine_b_read"]
    assert found[1].section["joints"] == {"q1_rad": "r1"} and found[0].file.name == "log_a.csv"


def test_own_folder_goes_before_the_shipped_one(tmp_path, monkeypatch):
    for folder in ("own", "shipped"):
        (tmp_path / folder / "arm").mkdir(parents=True)
        (tmp_path / folder / "arm" / "log_x.csv").write_text("J1\n1\n")
    (tmp_path / "shipped" / "arm" / "log_y.csv").write_text("J1\n1\n")
    monkeypatch.setenv(series.VARIABLE, str(tmp_path / "own"))
    files = [one.file.relative_to(tmp_path).parts[0] for one in series.found(_real(tmp_path / "shipped"), "mine")]
    assert files == ["own", "shipped"]


@pytest.mark.parametrize("folder", ["nowhere", "file"])
def test_a_folder_that_is_none_has_no_files_and_says_so(tmp_path, monkeypatch, folder):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv(series.VARIABLE, str(tmp_path / folder))
    real = _real(tmp_path / "shipped")
    assert series.found(real, "mine") == ()
    assert f"{tmp_path / folder} or" in series.missing(real, "mine") and series.VARIABLE in series.missing(real, "mine")


@refusals("text", "message")
def test_files_that_cannot_be_read_are_named(tmp_path, text, message):
    with pytest.raises(ConfigError, match=r"real\.sets\.mine: .*log_x\.csv") as error:
        _written(tmp_path, text).read()
    assert message in str(error.value)


def test_folders_and_other_files_are_no_tables(tmp_path):
    (tmp_path / "arm" / "log_x.csv").mkdir(parents=True)
    with pytest.raises(ConfigError, match="Is a directory"):
        series.found(_real(tmp_path), "mine")[0].read()
    (tmp_path / "arm" / "log_x.csv").rmdir()
    (tmp_path / "arm" / "log_x.csv").write_bytes(b"J1\n\xe9\xff\n")
    with pytest.raises(ConfigError, match="decode"):
        series.found(_real(tmp_path), "mine")[0].read()


def test_spaces_after_commas_do_not_matter(tmp_path):
    assert list(_written(tmp_path, "J1, X\n1, 2\n").read().columns) == ["J1", "X"]


def test_a_set_is_taken_out_by_null(tmp_path):
    real = _real(tmp_path)
    real["sets"]["other"] = None
    assert list(series.used(real)) == ["mine"]
    series.check({"real": real, "robots": ROBOTS})
    with pytest.raises(ConfigError, match=r"real\.sets: got only null"):
        series.check({"real": {"sets": {"other": None}}, "robots": ROBOTS})


@refusals("changes", "message")
def test_sections_that_do_not_fit_are_refused(tmp_path, changes, message):
    with pytest.raises(ConfigError, match=rf"real\.sets\.mine.*{message}"):
        series.check({"real": _real(tmp_path, **changes), "robots": ROBOTS})


def test_arms_without_readings_are_refused(tmp_path):
    real = _real(tmp_path)
    del real["sets"]["mine"]["readings"]
    with pytest.raises(ConfigError, match="got no readings"):
        series.check({"real": real, "robots": ROBOTS})
