"""Every refusal says where, what stands there and what is allowed."""

import gzip

import numpy as np
import pandas as pd
import pytest

from rrru.campaign.ingest.campaign_file import IngestSpec, ingest
from rrru.errors import IngestError
from rrru.robots.rrru3 import Rrru3
from tests.places import DATA
from tests.refusals import cases, refusals

SOURCE = DATA / "field_01.csv"
TEXT = SOURCE.read_text()
LINES = TEXT.splitlines()
FIELD = pd.read_csv(SOURCE)
ROBOT = Rrru3()
COMMAND = [f"command_{axis}_mm" for axis in "xyz"]
MEASURED = [f"measured_{axis}_mm" for axis in "xyz"]
THETA = [f"theta{k}_rad" for k in (1, 2, 3)]
AT_COMMAND = ", ".join(COMMAND)
CSV, REGISTER = "comma-separated text in UTF-8", {"frame": "register"}


def cells(*changes):
    """The campaign with some cells changed: (row from 1 below the header, column, value)."""
    frame = FIELD.astype(object)
    for row, column, value in changes:
        frame.loc[row - 1, column] = value
    return frame


def columns(names, factor=1.0, shift=0.0):
    """The campaign with some columns multiplied and shifted."""
    frame = FIELD.copy()
    frame[names] = frame[names] * factor + shift
    return frame


def exchanged(names, others):
    """The campaign with some columns in the place of others."""
    frame = FIELD.copy()
    frame[names] = FIELD[others].to_numpy()
    return frame


def lines(*changes):
    """The file's text with some lines changed: (line from 0, new line)."""
    changed = list(LINES)
    for line, text in changes:
        changed[line] = text
    return "\n".join(changed)


def parquet():
    """Bytes of the campaign as a parquet file."""
    return FIELD.to_parquet(None)


def problems_of(content, tmp_path, name="f.csv", **settings):
    """Problems with which a file of some content is refused."""
    path = tmp_path / name
    if isinstance(content, pd.DataFrame):
        content.to_csv(path, index=False) if path.suffix == ".csv" else content.to_parquet(path, index=False)
    elif content is not None:
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(IngestError) as caught:
        ingest(IngestSpec(str(path), **settings), ROBOT)
    assert all(problem["file"] == str(path) for problem in caught.value.problems)
    return caught.value.problems


def assert_problem(problems, row, column, value, allowed):
    """One of the problems is at this row below the header, in the line after it, and column, and says these things."""
    line = None if row is None else row + 1
    assert any(
        (p["row"], p["column"]) == (line, column) and value in p["value"] and allowed in p["allowed"] for p in problems
    ), problems[:3]


FILES = {
    "not there": (None, "nothing.csv", "no such file", "an existing file"),
    "empty": (b"", "f.csv", "an empty file", CSV),
    "only line ends": ("\n\n \n", "f.csv", "an empty file", CSV),
    "only a header": (LINES[0] + "\n\n", "f.csv", "a header (run, trajectory,", "one row per measured point"),
    "no header": ("\n".join(LINES[1:]), "f.csv", "a first line of values (1, line_1,", "names of all columns"),
    "text above the header": ("tracker 7\n" + TEXT, "f.csv", "a first line of 1 fields (tracker 7", "nothing above it"),
    "semicolons and decimal commas": (
        TEXT.replace(",", ";").replace(".", ","),
        "f.csv",
        "semicolons between",
        'format: {kind: csv, separator: ";", decimal: ","}',
    ),
    "tabs": (TEXT.replace(",", "\t"), "f.csv", "tabs between the fields", "commas between the fields"),
    "decimal commas": (
        TEXT.replace(".", ","),
        "f.csv",
        "15 fields (run, trajectory",
        "a decimal comma makes two fields",
    ),
    "a quote left open": (
        lines((4, LINES[4].replace("line_1", '"line_1'))),
        "f.csv",
        "unexpected end of data",
        "each quote closed",
    ),
    "UTF-16": (TEXT.encode("utf-16"), "f.csv", "UTF-16", "save the file again with the encoding UTF-8"),
    "UTF-16 without a mark": (TEXT.encode("utf-16-be"), "f.csv", "UTF-16", "encoding UTF-8"),
    "Latin-1": (TEXT.replace("line_1", "línea").encode("latin-1"), "f.csv", "byte 0xed in line 2", "encoding UTF-8"),
    "binary": (TEXT.encode()[:9000] + b"\0" + TEXT.encode()[9000:], "f.csv", "byte 0 in line 75", CSV),
    "a parquet file named .csv": (parquet(), "f.csv", "a parquet file", CSV),
    "an .xlsx named .csv": (b"PK\x03\x04" + bytes(99), "f.csv", "a zip archive, which .xlsx", CSV),
    "a gzip named .csv": (gzip.compress(TEXT.encode()), "f.csv", "a gzip archive", CSV),
    "a CSV named .parquet": (TEXT, "f.parquet", "run,trajectory", "comma-separated text has the extension .csv"),
    "an empty parquet file": (b"", "f.parquet", "an empty file", "a parquet file"),
    "a truncated parquet file": (
        parquet()[:9000],
        "f.parquet",
        "a damaged or truncated parquet file of 9000 bytes",
        "a whole parquet file",
    ),
    "a parquet file without its end": (
        parquet()[:-4],
        "f.parquet",
        "a damaged or truncated parquet file",
        "a whole parquet file",
    ),
    "a parquet file with a hole": (
        parquet()[:100] + bytes(300) + parquet()[400:],
        "f.parquet",
        "a damaged or truncated",
        "a whole parquet",
    ),
    "a parquet file without rows": (FIELD.head(0), "f.parquet", "and no row", "one row per measured point"),
    "an unknown extension": (TEXT, "f.txt", "the extension '.txt'", ".csv, .parquet, .xlsx, or the format stated"),
    "no extension": (TEXT, "f", "the extension ''", "spatial_analyzer"),
    "a CSV named .xlsx": (TEXT, "f.xlsx", "run,trajectory", "an .xlsx workbook"),
}


@pytest.mark.parametrize("case", FILES)
def test_a_file_that_is_not_what_it_should_be(case, tmp_path):
    content, name, value, allowed = FILES[case]
    problems = problems_of(content, tmp_path, name)
    assert len(problems) == 1
    assert_problem(problems, None, None, value, allowed)


def test_a_missing_column_lists_those_of_the_file_alone(tmp_path):
    """`trajectory`, which is added to a file without one, is not among them."""
    lacking = FIELD.drop(columns=["run", "trajectory", "point", "measured_x_mm"])
    problems = problems_of(lacking, tmp_path)
    why = "since a reading needs all three coordinates (a height alone is not read)"
    allowed = f"a column measured_x_mm, {why}; the file has {', '.join(lacking.columns)}"
    assert [problem["allowed"] for problem in problems] == [allowed]


def test_a_directory(tmp_path):
    (tmp_path / "f.csv").mkdir()
    assert_problem(problems_of(None, tmp_path), None, None, "a directory", "a file of measurements")


NO_NUMBER = "a finite number; drop a row that lacks one"
CELLS = {
    "text": ("measured_x_mm", "NA", NO_NUMBER),
    "text in time": ("time_s", "soon", NO_NUMBER),
    "NaN": ("theta2_rad", "NaN", NO_NUMBER),
    "infinity": ("measured_z_mm", "-inf", NO_NUMBER),
    "too large": ("measured_z_mm", "1e999", NO_NUMBER),
    "grouped digits": ("payload_kg", "1_000", NO_NUMBER),
    "a decimal comma": ("speed_mm_s", "80,5", "a number with a decimal point, not a comma"),
    "blank": ("command_x_mm", "", "a number"),
    "half a run": ("run", "1.5", "a whole number: 1, 2, 3, ..."),
    "point zero": ("point", "0", "a whole number: 1, 2, 3, ..."),
    "no name": ("trajectory", "", "the trajectory's name"),
    "a clock's time": ("time_s", "1.7e+09", "0 to 1e6 s since the campaign's start"),
    "standing still": ("speed_mm_s", "0", "above 0 and up to 20000 mm/s"),
    "a negative payload": ("payload_kg", "-2", "0 to 1000 kg"),
}


@pytest.mark.parametrize("name", ["f.csv", "f.parquet"])
@pytest.mark.parametrize("case", CELLS)
def test_a_cell_that_is_no_value(case, name, tmp_path):
    column, value, allowed = CELLS[case]
    frame = cells((6, column, value))
    problems = problems_of(frame if name == "f.csv" else frame.astype(str), tmp_path, name)
    # a parquet file has no line of names
    assert_problem(problems, 6 if name == "f.csv" else 5, column, value or "blank", allowed)


TURNED = columns(MEASURED)
TURNED["measured_y_mm"] *= -1.0
UPSIDE_DOWN = columns(["command_z_mm", "measured_z_mm"], -1.0).drop(columns=THETA)
RESTARTED = FIELD.assign(time_s=FIELD["time_s"] - FIELD.groupby("run")["time_s"].transform("min"))
CONTENT = {
    "a missed point": cells(*[(5, name, "") for name in MEASURED]),
    "half a missed point": cells((5, "measured_y_mm", "")),
    "too many fields": lines((4, LINES[4] + ",7")),
    "too few fields": lines((4, "1,line_1,4")),
    "an empty line": lines((4, "")),
    "a missing column": FIELD.drop(columns="measured_x_mm"),
    "distances alone": FIELD.drop(columns=["measured_x_mm", "measured_y_mm", "measured_z_mm"]).assign(
        **{"Distance [mm]": 812.5}
    ),
    "heights alone": FIELD.drop(columns=["measured_x_mm", "measured_y_mm"]),
    "orientations in degrees": FIELD.assign(**{f"measured_r{axis}_rad": 30.0 for axis in "xyz"}),
    "a misspelt column": TEXT.replace("measured_x", "mesured_x"),
    "an unknown column": FIELD.assign(wind=1.0),
    "a misspelt optional column": TEXT.replace("time_s", "Time_s"),
    "a column without a name": FIELD.to_csv(),
    "a mapped column that is missing": TEXT,
    "a column twice": TEXT.replace("payload_kg", "speed_mm_s"),
    "some drive angles": FIELD.drop(columns="theta2_rad"),
    "some drive angles without commanded positions": FIELD.drop(columns=["theta2_rad", *COMMAND]),
    "a blank drive angle": FIELD.assign(theta2_rad=""),
    "a point twice": cells((4, "point", 3)),
    "many copied measurements": cells(*[(row, n, FIELD.loc[row - 2, n]) for row in range(9, 60, 2) for n in MEASURED]),
    "a copied row": "\n".join([*LINES[:6], *LINES[5:]]),
    "points that go back": FIELD.iloc[[0, 2, 1, *range(3, 222)]].drop(columns="time_s"),
    "runs that go back": pd.concat([FIELD[26:52], FIELD[:26]]).drop(columns="time_s"),
    "two trajectories in a run": cells((5, "trajectory", "arc")),
    "too few points": FIELD.head(2),
    "a short run": FIELD.iloc[:28],
    "time that runs back": cells((5, "time_s", 0.5)),
    "time that starts again": RESTARTED,
    "a speed in m/s": columns("speed_mm_s", 1e-3),
    "a command out of reach": cells((7, "command_x_mm", -1500)),
    "a measurement out of reach": cells((7, "measured_x_mm", 9999)),
    "zeros for a missed point": cells(*[(7, name, 0) for name in MEASURED]),
    "metres as millimetres": columns(COMMAND + MEASURED, 1e-3),
    "millimetres as metres": TEXT,
    "inches as millimetres": columns(COMMAND + MEASURED, 1 / 25.4),
    "measured in metres only": columns(MEASURED, 1e-3),
    "measured in inches only": columns(MEASURED, 1 / 25.4),
    "degrees as radians": columns(THETA, 180 / np.pi),
    "radians as degrees": TEXT,
    "the other elbow": TEXT,
    "legs numbered the other way": exchanged(THETA, THETA[::-1]),
    "an angle that contradicts": cells((4, "theta2_rad", -0.1525)),
    "exchanged axes": exchanged(MEASURED[:2], MEASURED[1::-1]),
    "an axis turned round": columns("measured_z_mm", -1.0),
    "another frame": columns("measured_x_mm", shift=5e3),
    "one run in another frame": FIELD.assign(measured_x_mm=FIELD["measured_x_mm"] + 200.0 * (FIELD["run"] == 3)),
    "a robot upside down": UPSIDE_DOWN,
    "a left-handed frame": TURNED,
    "points of other commands": exchanged(MEASURED, [MEASURED[1], MEASURED[2], MEASURED[0]]).assign(
        measured_x_mm=FIELD["measured_x_mm"].to_numpy()[::-1]
    ),
    "two registration points": TEXT,
    "registration points on a line": TEXT,
    "a registration point not there": TEXT,
}
# settings that are not the usual ones
SETTINGS = {
    "a mapped column that is missing": {"columns": {"time_s": "t"}},
    "millimetres as metres": {"unit": "m"},
    "measured in inches only": REGISTER,
    "radians as degrees": {"angle_unit": "deg"},
    "the other elbow": {"elbow": "in"},
    "a left-handed frame": REGISTER,
    "points of other commands": REGISTER,
    "two registration points": REGISTER | {"registration_points": ((1, 1), (2, 2))},
    "registration points on a line": REGISTER | {"registration_points": tuple((1, k) for k in range(1, 20))},
    "a registration point not there": REGISTER | {"registration_points": ((9, 1),)},
}


@refusals("case", "row", "column", "value", "allowed")
def test_a_campaign_that_makes_no_sense(case, row, column, value, allowed, tmp_path):
    problems = problems_of(CONTENT[case], tmp_path, **SETTINGS.get(case, {}))
    assert_problem(problems, row, column, value, allowed)


def test_every_campaign_that_makes_no_sense_has_its_words():
    known = {name for name, *_ in cases(__file__)["test_a_campaign_that_makes_no_sense"]}
    assert known == CONTENT.keys() and known > SETTINGS.keys()


@pytest.mark.parametrize(
    "case",
    ["metres as millimetres", "millimetres as metres", "degrees as radians", "exchanged axes", "the other elbow"],
)
def test_one_cause_is_one_problem(case, tmp_path):
    assert len(problems_of(CONTENT[case], tmp_path, **SETTINGS.get(case, {}))) == 1


def test_all_problems_are_reported_at_once_under_the_file_s_names(tmp_path):
    frame = cells(
        (3, "measured_x_mm", "NA"),
        (9, "time_s", 0.0),
        (12, "theta1_rad", 0.0),
        (40, "command_x_mm", 3000.0),
        (60, "run", "x"),
    )
    frame = frame.rename(columns={"measured_x_mm": "X"}).assign(wind=0.0)
    problems = problems_of(frame, tmp_path, columns={"measured_x_mm": "X"})
    assert [(p["row"], p["column"]) for p in problems] == [
        (None, "wind"),
        (4, "X"),
        (61, "run"),
        (10, "time_s"),
        (41, AT_COMMAND),
        (13, "theta1_rad"),
    ]


def test_a_kind_of_problem_lists_twenty_and_counts_the_rest(tmp_path):
    problems = problems_of(FIELD.assign(time_s="late"), tmp_path)
    assert [p["row"] for p in problems] == [*range(2, 22), None]
    assert problems[-1]["value"] == "222 problems of this kind, of which the first 20 are listed"


@pytest.mark.parametrize(
    ("ours", "header", "unit"),
    [("time_s", "Zeit [ms]", "s"), ("speed_mm_s", "speed (m/s)", "mm/s"), ("payload_kg", "Nutzlast [g]", "kg")],
)
def test_another_unit_in_a_header_is_not_read_as_ours(ours, header, unit, tmp_path):
    frame = FIELD.assign(**{ours: FIELD.get(ours, 1.0)}).rename(columns={ours: header})
    path = tmp_path / "units.csv"
    frame.to_csv(path, index=False)
    spec = IngestSpec(str(path), columns={ours: header})
    with pytest.raises(IngestError, match=f"{unit}: convert the column") as raised:
        ingest(spec, ROBOT)
    assert header in str(raised.value)


def test_distances_are_refused_once(tmp_path):
    """To leave them out, as the message on an undeclared column said, leaves nothing that was measured."""
    frame = FIELD.drop(columns=MEASURED).assign(wire_1_mm=812.5, wire_2_mm=640.0)
    (problem,) = problems_of(frame, tmp_path)
    assert problem["column"] == "wire_1_mm, wire_2_mm" and problem["value"] == "distances, which are not read"


@pytest.mark.parametrize("count", [3, 30])
def test_undeclared_columns_list_the_known_ones_once(count, tmp_path):
    """The list was printed for each undeclared column."""
    names = [f"sensor_{k}" for k in range(count)]
    path = tmp_path / "sensors.csv"
    FIELD.assign(**dict.fromkeys(names, 1.0)).to_csv(path, index=False)
    with pytest.raises(IngestError) as raised:
        ingest(IngestSpec(str(path)), ROBOT)
    text = str(raised.value)
    assert all(name in text for name in names[:3]) and text.count("extra_columns: ignore") >= 3
    assert text.count("known: ") == text.count("measured_rx_rad") == 1
