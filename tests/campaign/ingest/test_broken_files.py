"""A broken file of any format is taken or refused with file, value and what is allowed, never with anything else.

RRRU_BROKEN_FILES is the number of files per format.
"""

import os
from pathlib import Path

import openpyxl
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rrru.campaign.ingest.campaign_file import ingest
from rrru.campaign.ingest.spec import IngestSpec
from rrru.errors import IngestError
from rrru.robots.rrru3 import Rrru3
from tests.campaign.ingest.samples import SAMPLES, section
from tests.places import DATA

ROBOT = Rrru3()
COUNT = int(os.environ.get("RRRU_BROKEN_FILES", "8"))
NASTY = [
    "",
    "NA",
    "1e999",
    "-1",
    "1,5",
    "1.5.2",
    "0x1F",
    "\u0663",
    "=1/0",
    "2026-13-01 00:00",
    "\x00",
    '"',
    "P01 P02",
    "//",
]
CELLS = st.one_of(st.sampled_from(NASTY), st.text(max_size=6), st.floats(width=32).map(str))
SPLICES = st.lists(st.tuples(st.floats(0, 1), st.integers(0, 40), st.binary(max_size=20)), max_size=3)
EDITS = st.lists(
    st.tuples(st.sampled_from(["cell", "drop", "twice"]), st.floats(0, 1), st.floats(0, 1), CELLS), max_size=4
)
FORMATS = {name: section(name) for name in SAMPLES} | {
    "csv": {"ingest": str(DATA / "field_01.csv")},
    "parquet": {"ingest": str(DATA / "field_01.csv")},
    "commands": section("leica"),
}


def edited(lines, edits, separator):
    """Lines of a text with cells replaced, and lines dropped or doubled."""
    lines = list(lines)
    for kind, down, across, cell in edits:
        at = int(down * (len(lines) - 1))
        if kind == "cell":
            fields = lines[at].split(separator)
            fields[int(across * (len(fields) - 1))] = cell
            lines[at] = separator.join(fields)
        else:
            lines[at : at + 1] = [] if kind == "drop" else [lines[at], lines[at]]
    return lines or [""]


def edited_book(path, edits, out):
    """A workbook with cells replaced, and rows dropped or doubled."""
    book = openpyxl.load_workbook(path)
    sheet = book["Points"]
    for kind, down, across, cell in edits:
        at = 1 + int(down * (sheet.max_row - 1))
        if kind == "cell":
            legal = "".join(sign for sign in cell if sign.isprintable())
            sheet.cell(at, 1 + int(across * (sheet.max_column - 1))).value = legal or None
        elif kind == "drop":
            sheet.delete_rows(at)
        else:
            sheet.append([one.value for one in sheet[at]])
    book.save(out)


def edited_frame(frame, edits):
    """A frame with cells replaced, which makes text of their columns, and rows dropped or doubled."""
    for kind, down, across, cell in edits:
        at = int(down * (len(frame) - 1))
        if kind == "cell":
            column = frame.columns[int(across * (frame.shape[1] - 1))]
            texts = frame[column].astype(str).tolist()
            texts[at] = cell.encode("utf-8", "replace").decode()
            frame = frame.assign(**{column: texts})
        else:
            rows = frame.index[at : at + 1]
            frame = frame.drop(rows) if kind == "drop" else pd.concat([frame, frame.loc[rows]])
    return frame


def broken(name, path, edits, splices, out):
    """Write a broken copy of a sample."""
    if name == "workbook":
        edited_book(path, edits, out)
        data = bytearray(out.read_bytes())
    elif name == "parquet":
        frame = edited_frame(pd.read_csv(path).query("run <= 3"), edits)
        data = bytearray(frame.to_parquet(None))
    else:
        encoding = "cp1252" if name == "leica" else "utf-8"
        separator = ";" if name == "decimal_comma" else ","
        lines = Path(path).read_text(encoding).splitlines()[:125]
        data = bytearray("\n".join(edited(lines, edits, separator)).encode(encoding, "replace"))
    for place, length, new in splices:
        at = int(place * max(len(data) - 1, 0))
        data[at : at + length] = new
    out.write_bytes(bytes(data))


@pytest.mark.parametrize("name", FORMATS)
def test_a_broken_file_is_taken_or_refused(name, tmp_path):
    counts = {"taken": 0, "refused": 0}
    own = FORMATS[name]
    changed = "commands" if name == "commands" else "ingest"
    ending = ".parquet" if name == "parquet" else Path(own[changed]).suffix

    @settings(
        max_examples=COUNT, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True, database=None
    )
    @given(edits=EDITS, splices=st.one_of(st.just([]), SPLICES))
    def one(edits, splices):
        path = tmp_path / f"broken{ending}"
        broken(name, own[changed], edits, splices, path)
        try:
            result = ingest(IngestSpec.from_config(own | {changed: str(path)}), ROBOT)
            assert result.measurements[["command_x_mm", "measured_x_mm"]].notna().all(axis=None)
            counts["taken"] += 1
        except IngestError as error:
            assert error.problems
            for problem in error.problems:
                assert set(problem) == {"file", "row", "column", "value", "allowed"}
                assert problem["value"] and problem["allowed"] and Path(problem["file"]).name in str(error)
            counts["refused"] += 1

    one()
    print(name, counts)
    assert counts["refused"] and sum(counts.values()) >= COUNT
