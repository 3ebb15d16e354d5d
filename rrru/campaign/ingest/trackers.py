"""The cells of point lists as trackers' programs write them: names, units and uncertainties from their headers.

A list of SpatialAnalyzer is text with comment lines, "// ..", above rows of point names and coordinates, whose last
comment names the columns. A Leica-style list is CSV with units in the names of its columns. After each coordinate it
has the expanded uncertainty U(95), which is twice the standard deviation: coverage factor k = 2, JCGM 100:2008 (GUM),
6.3 and G.6.6.
"""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

from rrru.campaign.ingest.cells import Cells, decode, fields, separator_of, table
from rrru.campaign.ingest.problems import Problems
from rrru.campaign.ingest.sheet import MEASURED, NOISE

LENGTHS = {
    **dict.fromkeys(("mm", "millimeter", "millimeters", "millimetre", "millimetres"), 1.0),
    **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), 1000.0),
    **dict.fromkeys(("in", "inch", "inches"), 25.4),
    **dict.fromkeys(("um", "µm", "μm", "micron", "microns"), 1e-3),
}
_CELSIUS = ("c", "°c", "degc", "deg c")
_BRACKET = re.compile(r"^(.*?)\s*[\[(]\s*([^\])]*?)\s*[\])]\s*$")
_COVERAGE = 2.0
# our names by those of the lists' columns, in small letters and without units
_MEANS = {
    **{axis: ours for axis, ours in zip("xyz", MEASURED, strict=True)},
    **{f"u(95) {axis}": ours for axis, ours in zip("xyz", NOISE, strict=True)},
    **dict.fromkeys(("name", "point", "point name", "point id", "target name", "punkt", "punktname"), "name"),
    **dict.fromkeys(("group", "group name", "point group"), "trajectory"),
    **dict.fromkeys(("time", "timestamp", "time stamp", "date time", "date/time", "local time", "zeit"), "time_s"),
    "temperature": "temperature_c",
}
_UNUSED = ("collection", "collection name", "pressure", "humidity")
_BY_COUNT = {3: "X Y Z", 4: "Point X Y Z", 5: "Group Point X Y Z", 6: "Collection Group Point X Y Z"}
_OTHER_AXES = re.compile(r"\b(cylindric|spheric|polar)", re.IGNORECASE)
_UNIT_TEXT = re.compile(
    r"(?:units?\s*[:=]\s*|[\[(]\s*)([a-zµμ]+)|\b(millimet(?:er|re)s?|met(?:er|re)s|inch(?:es)?)\b", re.IGNORECASE
)
_LIST = "a point list: // comments, and rows of a point's name, X, Y and Z"
HEADER_LINES = 50


def leica_cells(data: bytes, problems: Problems, separator: str | None = None, decimal: str = ".") -> Cells:
    """Cells of a Leica-style CSV's bytes: from the line that names X, Y and Z on; see the module."""
    text = decode(data, problems, "comma-separated text with columns X [mm], Y [mm], Z [mm]", ("utf-16", "cp1252"))
    rows, lines = fields(text, separator or ",", problems)
    at = next((i for i, row in enumerate(rows[:HEADER_LINES]) if names_axes(row)), None)
    if at is None:
        first = ", ".join(rows[0][:8])
        found = separator_of(text.strip().splitlines()[:1], decimal)
        advice = f"; or stated: format: {{kind: leica, separator: {json.dumps(found)}}}" if found != "," else ""
        allowed = f"a header X [mm], Y [mm], Z [mm]{advice}"
        problems.refuse_now(value=f"no line with X, Y and Z ({first}, ...)", allowed=allowed)
    names, below = _one_clock(rows[at], rows[at + 1 :])
    cells = table(names, below, lines[at + 1 :], problems, decimal)
    notes = (f"left out: {at} lines above the header",) if at else ()
    return _known(cells, problems, {}, notes)


def spatial_analyzer_cells(data: bytes, problems: Problems, separator: str | None = None, decimal: str = ".") -> Cells:
    """Cells of a SpatialAnalyzer point list's bytes; see the module."""
    text = decode(data, problems, _LIST, ("utf-16", "cp1252"))
    lines = {number: line.strip() for number, line in enumerate(text.splitlines(), start=1)}
    comments = [line.lstrip("/").strip() for line in lines.values() if line.startswith("//")]
    body = {number: line for number, line in lines.items() if line and not line.startswith("//")}
    if not body:
        problems.refuse_now(value=f"{len(comments)} comment lines and no point", allowed=_LIST)
    if other := next((line for line in comments if _OTHER_AXES.search(line)), None):
        problems.refuse_now(value=f"the comment {other!r}", allowed="Cartesian coordinates: export X, Y, Z")
    between = separator or separator_of([*body.values()], decimal)
    rows = [_split(line, between) for line in body.values()]
    names, rows, notes = _named(comments, rows, between, problems)
    cells = table(names, rows, [*body][-len(rows) :], problems, decimal)
    return _known(cells, problems, _stated_unit(comments, problems), notes)


def _split(line: str, separator: str) -> list[str]:
    """Stripped fields of a line, those at its end left out that are empty."""
    cells = line.split() if separator == " " else [cell.strip().strip('"') for cell in line.split(separator)]
    while cells and not cells[-1]:
        cells.pop()
    return cells


def _named(
    comments: Sequence[str], rows: list[list[str]], separator: str, problems: Problems
) -> tuple[list[str], list[list[str]], tuple[str, ...]]:
    """Names of a list's columns, its rows and a note: by its header, or by how many fields it has."""
    headers = [_split(line, one) for line in comments for one in (separator, ",", " ")]
    headers = [names for names in headers if names_axes(names)]
    notes: tuple[str, ...] = ()
    if names_axes(rows[0]):
        names, rows = rows[0], rows[1:]
    elif headers:
        names = headers[-1]
    else:
        width = max(set(map(len, rows)), key=[len(row) for row in rows].count)
        if width not in _BY_COUNT:
            value = f"rows of {width} fields ({', '.join(rows[0][:6])}, ...) without a line that names them"
            problems.refuse_now(value=value, allowed="a line // Collection, Group, Point, X, Y, Z, or 3 to 6 fields")
        names = _BY_COUNT[width].split()
        notes = (f"no line names the columns: {width} fields are taken as {', '.join(names)}",)
    return names, [row + [""] * (len(names) - len(row)) if row else row for row in rows], notes


def names_axes(names: Sequence[str]) -> bool:
    """Whether x, y and z are among names of columns."""
    return {"x", "y", "z"} <= {_key(name) for name in names}


def _stated_unit(comments: Sequence[str], problems: Problems) -> dict[str, float]:
    """Factor to mm by axis, of the unit that a list's comments state; empty where they state none."""
    words = [word.lower() for line in comments for pair in _UNIT_TEXT.findall(line) for word in pair if word]
    found = {LENGTHS[word]: word for word in words if word in LENGTHS}
    if len(found) > 1:
        problems.refuse_now(value=f"comments with {' and '.join(found.values())}", allowed="one unit of length")
    return {axis: factor for factor in found for axis in "xyz"}


def _known(cells: Cells, problems: Problems, units: Mapping[str, float], notes: tuple[str, ...]) -> Cells:
    """The cells with what their names mean; units: factor to mm by axis where no name says one."""
    means, factors, spreads = {}, {}, {}
    for name in cells.names:
        key, unit = _key(name), unit_of(name)
        ours = _MEANS.get(key)
        if ours is None or ours in means:
            continue
        if ours == "temperature_c" and unit not in (*_CELSIUS, None):
            continue
        means[ours] = name
        if ours in NOISE:
            spreads[name] = 1.0 / _COVERAGE
        if ours in (*MEASURED, *NOISE) and (unit or key[-1] in units):
            factors[name] = _length(name, unit, problems) if unit else units[key[-1]]
    if factors:
        notes = (*notes, f"read in the unit that the file states: {', '.join(factors)}")
    unused = tuple(name for name in cells.names if _key(name) in _UNUSED)
    return replace(cells, means=means, factors=factors, spreads=spreads, unused=unused, notes=tuple(notes))


def _length(name: str, unit: str, problems: Problems) -> float:
    """Factor to mm of a unit; an unknown one is noted."""
    if unit not in LENGTHS:
        problems.add("unit", column=name, value=f"the unit {unit}", allowed="mm, m, in or µm")
    return LENGTHS.get(unit, 1.0)


def _key(name: str) -> str:
    """A column's name in small letters, without unit and double spaces."""
    bare = _BRACKET.match(name) if unit_of(name) else None
    return " ".join((bare[1] if bare else name).lower().split())


def unit_of(name: str) -> str | None:
    """The unit in brackets at the end of a column's name, in small letters, or None."""
    found = _BRACKET.match(name)
    return found[2].lower() if found and not re.fullmatch(r"\d*", found[2]) else None


def _one_clock(names: list[str], rows: list[list[str]]) -> tuple[list[str], list[list[str]]]:
    """Names and rows with one column "Date Time" where date and time of day stand apart."""
    keys = [_key(name) for name in names]
    if not {"date", "time"} <= set(keys):
        return names, rows
    day, time = keys.index("date"), keys.index("time")
    unchanged = [k for k in range(len(names)) if k not in (day, time)]

    def joined(row: list[str]) -> list[str]:
        if len(row) != len(names):
            return row[:-1]
        return [*(row[k] for k in unchanged), f"{row[day]} {row[time]}".strip()]

    return [*(names[k] for k in unchanged), "Date Time"], [joined(row) for row in rows]
