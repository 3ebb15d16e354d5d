"""Files of other programs, as they are, give the campaign that they were written from."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from rrru.calibration.campaign_noise import campaign_noise
from rrru.campaign.ingest.campaign_file import ingest
from rrru.campaign.ingest.formats import Format
from rrru.campaign.ingest.spec import IngestSpec
from rrru.campaign.noise import read_noise
from rrru.errors import ConfigError, IngestError
from rrru.robots.rrru3 import Rrru3
from tests.campaign.ingest.samples import FILES, SAMPLES, section
from tests.places import DATA
from tests.schemas import check_measurements

ROBOT = Rrru3()
COMMAND = [f"command_{axis}_mm" for axis in "xyz"]
MEASURED = [f"measured_{axis}_mm" for axis in "xyz"]


@pytest.fixture(scope="module")
def source():
    """What the samples were written from."""
    frame = pd.read_csv(DATA / "field_01.csv")
    return frame[frame["run"].isin([1, 2, 3, 8])].reset_index(drop=True)


def read(name, **more):
    """What ingest makes of a sample."""
    return ingest(IngestSpec.from_config(section(name) | more), ROBOT)


def refused(path, **settings):
    """Problems with which a file is refused."""
    with pytest.raises(IngestError) as caught:
        ingest(IngestSpec.from_config({"ingest": str(path)} | settings), ROBOT)
    return caught.value.problems


def distances(position):
    """Distances (n, n) between positions, the same in every frame."""
    return np.linalg.norm(position[:, None] - position[None], axis=2)


@pytest.mark.parametrize("name", SAMPLES)
def test_a_sample_holds_the_campaign_that_it_was_written_from(name, source):
    table = read(name).measurements
    check_measurements(ROBOT, table)
    assert np.abs(table[COMMAND].to_numpy() - source[COMMAND].to_numpy()).max() < 1e-9
    off = distances(table[MEASURED].to_numpy()) - distances(source[MEASURED].to_numpy())
    assert np.abs(off).max() < 2e-4
    assert table["trajectory"].tolist() == source["trajectory"].tolist()
    if name != "spatial_analyzer":
        assert np.abs(table["time_s"] - (source["time_s"] - source["time_s"][0])).max() < 2e-3


def test_the_spread_of_a_reading_is_half_its_expanded_uncertainty():
    raw = pd.read_csv(FILES / "leica.csv", encoding="cp1252")
    table = read("leica").measurements
    for axis in "xyz":
        assert np.allclose(2.0 * table[f"noise_{axis}_mm"], raw[f"U(95) {axis.upper()}  [mm]"])
    medians = [np.median(raw[f"U(95) {axis}  [mm]"]) / 2.0 for axis in "XYZ"]
    assert read_noise(table) == pytest.approx(np.sqrt(np.mean(np.square(medians))))
    assert table["temperature_c"].tolist() == raw["Temperature  [°C]"].tolist()
    assert campaign_noise(ROBOT, table, (None, None))[::2] == (read_noise(table), "readings")
    assert campaign_noise(ROBOT, table, (0.05, None))[::2] == (0.05, "given")
    assert read_noise(read("spatial_analyzer").measurements) is None


@pytest.mark.parametrize(("unit", "factor"), [("m", 1e-3), ("in", 1.0 / 25.4), ("µm", 1e3)])
def test_the_unit_in_a_header_counts(unit, factor, tmp_path):
    raw = pd.read_csv(FILES / "leica.csv", encoding="cp1252")
    lengths = [name for name in raw if name.endswith("[mm]")]
    raw[lengths] *= factor
    raw.columns = [name.replace("[mm]", f"[{unit}]") for name in raw]
    raw.to_csv(tmp_path / "f.csv", index=False)
    expected = read("leica").measurements
    found = read("leica", ingest=str(tmp_path / "f.csv")).measurements
    for column in (*MEASURED, "noise_x_mm"):
        assert np.abs(found[column] - expected[column]).max() < 1e-6


@pytest.mark.parametrize(
    ("comment", "factor"), [("// Units: Meters", 1e-3), ("// X, Y, Z [in]", 1.0 / 25.4), ("// inches", 1.0 / 25.4)]
)
def test_the_unit_in_a_comment_counts(comment, factor, tmp_path):
    lines = (FILES / "spatial_analyzer.txt").read_text().splitlines()
    rows = [line.split(",") for line in lines if line and not line.startswith("//")]
    scaled = [[*row[:3], *(f"{float(cell) * factor:.9f}" for cell in row[3:])] for row in rows]
    text = "\n".join([comment, lines[3], *(",".join(row) for row in scaled)])
    (tmp_path / "f.txt").write_text(text)
    found = read("spatial_analyzer", ingest=str(tmp_path / "f.txt")).measurements
    expected = read("spatial_analyzer").measurements
    assert np.abs(found[MEASURED].to_numpy() - expected[MEASURED].to_numpy()).max() < 1e-5


def test_lists_without_a_header_are_taken_by_how_many_fields_they_have(tmp_path):
    expected = read("spatial_analyzer").measurements
    lines = (FILES / "spatial_analyzer.txt").read_text().splitlines()
    rows = [[cell.strip() for cell in line.split(",")] for line in lines if line and not line.startswith("//")]
    forms = {"commas": ",".join, "spaces": " ".join, "semicolons at the end": lambda row: ";".join(row) + ";;;;"}
    for form in forms.values():
        (tmp_path / "f.xyz").write_text("\n".join(form(row[1:]) for row in rows))
        result = read("spatial_analyzer", ingest=str(tmp_path / "f.xyz"))
        assert np.abs(result.measurements[MEASURED].to_numpy() - expected[MEASURED].to_numpy()).max() < 1e-9
        assert "5 fields are taken as Group, Point, X, Y, Z" in result.notes[0]


def test_date_and_time_of_day_may_stand_apart(tmp_path):
    text = (FILES / "leica.csv").read_text("cp1252").replace("Time Stamp", "Date,Time")
    (tmp_path / "f.csv").write_text("report 7\n\n" + text.replace("2026-03-04 ", "2026-03-04,"), "utf-16")
    result = read("leica", ingest=str(tmp_path / "f.csv"))
    assert result.measurements["time_s"].equals(read("leica").measurements["time_s"])
    assert "left out: 2 lines above the header" in result.notes


def test_a_sheet_of_several_has_to_be_named(tmp_path):
    with pd.ExcelWriter(tmp_path / "f.xlsx") as book:
        for name in ("a", "b"):
            pd.read_excel(FILES / "workbook.xlsx", sheet_name="Points").to_excel(book, sheet_name=name, index=False)
    problem = refused(tmp_path / "f.xlsx")[0]
    assert "'a', 'b'" in problem["value"] and "sheet: a" in problem["allowed"]
    found = ingest(
        IngestSpec.from_config({"ingest": str(tmp_path / "f.xlsx"), "format": {"kind": "xlsx", "sheet": "b"}}), ROBOT
    )
    assert len(found.measurements) == 118


# the first line after ten o'clock
LATE = next(k + 1 for k, line in enumerate((FILES / "leica.csv").read_text("cp1252").splitlines()) if " 10:" in line)
BROKEN = {
    "an unknown unit": ("leica", lambda text: text.replace("Y  [mm]", "Y  [ft]"), None, "the unit ft", "mm, m, in"),
    "no axes": ("leica", lambda text: text.replace("Z  [mm]", "W"), None, "no line with X, Y and Z", "a header X [mm]"),
    "a spread of nothing": ("leica", lambda text: text.replace("0.0489", "0"), 2, "0", "above 0 and up to 100 mm"),
    "a clock that is put back": ("leica", lambda text: text.replace(" 10:", " 09:"), LATE, "s after", "never run"),
    "an ambiguous day and month": (
        "leica",
        lambda text: text.replace("2026-03-04", "03/04/2026"),
        2,
        "'03/04/2026 09:58:12.250'",
        "time_format",
    ),
    "two units": (
        "spatial_analyzer",
        lambda text: "// Units: Meters\n" + text,
        None,
        "meters and millimeters",
        "one unit",
    ),
    "polar coordinates": ("spatial_analyzer", lambda text: "// Cylindrical\n" + text, None, "Cylindrical", "Cartesian"),
    "only comments": (
        "spatial_analyzer",
        lambda text: "// nothing",
        None,
        "1 comment lines and no point",
        "a point list",
    ),
    "seven unnamed fields": (
        "spatial_analyzer",
        lambda text: "\n".join(f"{line},7" for line in text.splitlines()[5:]),
        None,
        "rows of 7 fields",
        "3 to 6 fields",
    ),
    "a point without z": ("spatial_analyzer", lambda text: text.replace(",  244.865280", ""), 6, "blank", "a number"),
    "a decimal point among commas": (
        "decimal_comma",
        lambda text: text.replace("-702,76483", "-702.76483"),
        2,
        "'-702.76483'",
        "comma",
    ),
    "commas where semicolons are stated": (
        "decimal_comma",
        lambda text: text.replace(",", ".").replace(";", ","),
        None,
        "commas between the fields",
        'kind: csv, separator: ","',
    ),
}


@pytest.mark.parametrize("case", BROKEN)
def test_what_is_wrong_with_a_file_is_told(case, tmp_path):
    name, change, row, value, allowed = BROKEN[case]
    own = section(name)
    encoding = "cp1252" if name == "leica" else "utf-8"
    path = tmp_path / "f.csv"
    before = Path(own["ingest"]).read_text(encoding)
    path.write_text(change(before), encoding)
    assert path.read_text(encoding) != before
    problems = refused(path, **{key: given for key, given in own.items() if key != "ingest"})
    assert any(p["row"] == row and value in p["value"] and allowed in p["allowed"] for p in problems), problems[:3]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("ods", "format is 'ods'; allowed: csv, leica"),
        ({"kind": "csv", "decimal": "·"}, "decimal is '·'"),
        ({"kind": "csv", "separator": "::"}, "separator is '::'; allowed: one character"),
        ({"kind": "csv", "separator": ",", "decimal": ","}, "allowed: two characters"),
    ],
)
def test_formats_that_do_not_exist_are_refused(given, said):
    with pytest.raises(ConfigError, match=said):
        Format.from_config(given)


def test_a_format_takes_its_own_keys_alone():
    with pytest.raises(ConfigError, match="format xlsx has no separator; allowed: sheet"):
        read("workbook", format={"kind": "xlsx", "separator": ";"})
