"""From a file's cells to the columns of `measurements`, in mm and rad; every cell that is not as expected is noted.

`ours` is a column's name in this package, `theirs` its name in the file.
"""

import difflib
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from decimal import Decimal
from typing import TypeAlias

import numpy as np
import pandas as pd

from rrru.campaign.ingest.cells import Cell, Cells
from rrru.campaign.ingest.clock import is_clock, seconds
from rrru.campaign.ingest.orientations import check_orientations
from rrru.campaign.ingest.problems import Problems
from rrru.campaign.ingest.sheet import COMMAND, MEASURED, NOISE, QUATERNIONS, TURNS, drive_name
from rrru.campaign.ingest.spec import MM, RAD, IngestSpec
from rrru.campaign.ingest.trackers import unit_of
from rrru.kinematics.robot import Robot

REQUIRED = ("trajectory", *COMMAND, *MEASURED)
_GROUPS = (*TURNS.values(), *QUATERNIONS.values(), NOISE)
# `name` joins a file of measurements with a file of commands
_OPTIONAL = ("target", "name", "temperature_c", *(name for group in _GROUPS for name in group))
_TEXT = ("trajectory", "target")
_BEFORE_DRIVES, _AFTER_DRIVES = ("run", "point", "time_s"), ("speed_mm_s", "payload_kg")

# words in the name of a column of distances: a draw-wire encoder, a ballbar, a tape
_DISTANCES = {"distance", "distances", "dist", "length", "ballbar", "wire", "abstand", "distanz", "laenge", "länge"}
# why a coordinate is needed where another one was measured
_ALL_COORDINATES = ", since a reading needs all three coordinates (a height alone is not read)"

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?", re.ASCII)
_OR_NO_ROW = "; drop a row that lacks one"
# larger numbers are no measurements, but damaged cells or markers of missing values
_MAX_NUMBER = 1e12
_Limit: TypeAlias = tuple[Callable[[pd.Series], pd.Series], str]
_WHOLE_NUMBER: _Limit = (lambda v: (v >= 1) & (v <= 1e9) & (v == v.round()), "a whole number: 1, 2, 3, ...")
# ASSUME generous limits of payload and speed of a robot; campaigns of less than 12 days: a time of day or a date, read
# as seconds, is beyond
_LIMITS: dict[str, _Limit] = {
    "run": _WHOLE_NUMBER,
    "point": _WHOLE_NUMBER,
    "time_s": (lambda v: (v >= 0) & (v <= 1e6), "0 to 1e6 s since the campaign's start"),
    "speed_mm_s": (lambda v: (v > 0) & (v <= 2e4), "above 0 and up to 20000 mm/s"),
    "payload_kg": (lambda v: (v >= 0) & (v <= 1e3), "0 to 1000 kg"),
    "temperature_c": (lambda v: (v >= -60) & (v <= 100), "-60 to 100 degrees C"),
    **dict.fromkeys(NOISE, (lambda v: (v > 0) & (v <= 100), "above 0 and up to 100 mm")),
}
# unit of a column, and other units that a header may state, which are refused
_REFUSED_UNITS = {
    "time_s": ("s", ("ms", "us", "µs", "min", "h")),
    "speed_mm_s": ("mm/s", ("m/s", "cm/s", "mm/min", "m/min", "in/s", "%")),
    "payload_kg": ("kg", ("g", "t", "lb", "lbs", "n")),
    "temperature_c": ("degrees C", ("f", "°f", "k")),
}


def known_columns(mechanism: Robot) -> tuple[str, ...]:
    """Names in this package of all columns that a robot's file may have."""
    return (*REQUIRED, *_BEFORE_DRIVES, *mechanism.parts.columns, *_AFTER_DRIVES, *_OPTIONAL)


def resolve(
    spec: IngestSpec,
    cells: Cells,
    mechanism: Robot,
    problems: Problems,
    guessed: Mapping[str, str] | None = None,
    angle_unit: str | None = None,
) -> tuple[dict[str, str], list[str]]:
    """{ours: theirs} of the columns that a file's Cells have, and the undeclared columns.

    guessed: {ours: theirs} of what undeclared columns look like, and angle_unit of the drives' values by their names,
    which messages propose. Missing columns, repeated ones, other units and, unless `extra_columns` is "ignore",
    undeclared ones are noted.
    """
    drives, names = mechanism.parts.columns, cells.names
    for name in sorted({name for name in names if names.count(name) > 1}):
        value = f"{names.count(name)} columns of this name"
        problems.add("repeated column", column=name, value=value, allowed="each name once")
    taken = set(spec.columns.values())
    means = {ours: theirs for ours, theirs in cells.means.items() if theirs not in taken}
    wanted = {ours: spec.columns.get(ours, means.get(ours, ours)) for ours in known_columns(mechanism)}
    found = {ours: theirs for ours, theirs in wanted.items() if theirs in names}
    extra = [name for name in names if name not in (*found.values(), *cells.unused)]
    for ours, (unit, others) in _REFUSED_UNITS.items():
        if ours in found and (stated := unit_of(found[ours])) in others:
            allowed = f"{unit}: convert the column, and its name"
            problems.add("unit", column=found[ours], value=f"the unit {stated}", allowed=allowed)
    # drive values determine the commanded positions as well; where some are missing, these are the problem
    meant = {theirs: ours for ours, theirs in (guessed or {}).items()}
    spare = {ours: theirs for theirs, ours in meant.items() if ours in drives and theirs in extra}
    only_drives = bool(set(drives) & {*found, *spare}) and not set(COMMAND) & set(found)
    listed = ", ".join(name for name in names if name not in cells.added)
    alone, some_measured = distances_alone(found, extra), bool(set(MEASURED) & set(found))
    if alone:
        points = "of each stop from three or more fixed points (multilateration), and write them as measured_x_mm .."
        allowed = f"all three coordinates of each reading: compute them from the distances {points}"
        problems.add("distances", column=", ".join(alone), value="distances, which are not read", allowed=allowed)
    for ours, theirs in wanted.items():
        if alone and ours in MEASURED:
            continue
        if ours not in found and ((ours in REQUIRED and not (only_drives and ours in COMMAND)) or ours in spec.columns):
            why = _ALL_COORDINATES if ours in MEASURED and some_measured else ""
            allowed = f"a column {theirs}{why}{_advice(ours, _nearest(theirs, extra))}; the file has {listed}"
            problems.add("missing column", column=theirs, value="no such column", allowed=allowed)
    for group in (tuple(drives), *_GROUPS):
        given, lacking = [found[name] for name in group if name in found], [name for name in group if name not in found]
        if given and lacking:
            part = "a part of the noise" if group is NOISE else "a part of an orientation"
            allowed = f"all of {', '.join(group)}, or none"
            if group == tuple(drives):
                part = f"some {drive_name(mechanism)}, but not {', '.join(lacking)}"
                allowed = f"all of {', '.join(group)}{'' if only_drives else ', or none'}"
            problems.add("missing column", column=", ".join(given), value=part, allowed=allowed)
    if spec.extra_columns == "refuse":
        unused = [ours for ours in wanted if ours not in found]
        if spare:
            pairs = ", ".join(f'{ours}: "{theirs}"' for ours, theirs in spare.items())
            unit = f" and angle_unit: {angle_unit}" if angle_unit and angle_unit != spec.angle_unit else ""
            value, allowed = "columns that look like the drives' values", f"columns: {{{pairs}}}{unit}"
            problems.add("drives", column=", ".join(spare.values()), value=value, allowed=allowed)
        undeclared = [name for name in dict.fromkeys(extra) if not (meant.get(name) in spare or name in alone)]
        for name in undeclared:
            shown = name or f"(no name, column {names.index(name) + 1}; pandas writes its index so)"
            advice = _advice(_nearest(name, unused), name)
            known = f"; known: {', '.join(wanted)}" if name == undeclared[0] else ""
            allowed = f"extra_columns: ignore, which leaves it out{advice}{known}"
            problems.add("unknown column", column=shown, value="an undeclared column", allowed=allowed)
    return found, extra


def distances_alone(found: Mapping[str, str], extra: Iterable[str]) -> list[str]:
    """Names of columns that hold distances, of a file's undeclared ones, where no measured coordinate was found."""
    if set(MEASURED) & set(found):
        return []
    return [name for name in extra if _DISTANCES & set(re.split(r"[\W_]+", name.casefold()))]


def convert(
    spec: IngestSpec, mechanism: Robot, found: Mapping[str, str], file: Cells, problems: Problems
) -> pd.DataFrame:
    """Frame of our columns in mm and rad, indexed by the row numbers (n,); NaN, or "" as a name, where a cell is noted.

    found: {ours: theirs} as of `resolve`; file: its Cells. An optional column without any value is left out.
    """
    cells, rows = file.cells, file.rows
    measured = [found[name] for name in MEASURED if name in found]
    missed = np.array([bool(measured) and all(_blank(cells[name][i]) for name in measured) for i in range(len(rows))])
    for row in np.asarray(rows)[missed]:
        allowed = "three numbers: drop the row of a point that was not measured"
        problems.add("missed point", row=row, column=", ".join(measured), value="blank", allowed=allowed)
    needed = [*REQUIRED, "target"]
    filled = {ours for ours, theirs in found.items() if ours in needed or not all(map(_blank, cells[theirs]))}
    drives = {drive.column: drive.unit for drive in mechanism.parts.drives}
    filled |= set(drives) if filled & set(drives) else set()
    factor = dict.fromkeys((*COMMAND, *MEASURED, *NOISE), MM[spec.unit])
    factor |= {name: MM[spec.unit_of_drives] if unit == "mm" else RAD[spec.angle_unit] for name, unit in drives.items()}
    factor |= {ours: file.factors[theirs] for ours, theirs in found.items() if theirs in file.factors}
    frame = pd.DataFrame(index=pd.Index(rows))
    blank = _blank_groups(found, cells, len(rows))
    for ours, theirs in found.items():
        if ours in _TEXT:
            names = _names(ours, cells[theirs], rows, theirs, problems)
            frame[ours] = pd.Series(names, index=frame.index, dtype=object)
        elif ours == "time_s" and ours in filled and is_clock(cells[theirs], spec.time_format):
            frame[ours] = seconds(cells[theirs], rows, theirs, spec.time_format, problems)
        elif ours in filled and ours != "name":
            skipped = missed & (ours in MEASURED) | blank.get(ours, False)
            scale = factor.get(ours, 1.0) * file.spreads.get(theirs, 1.0)
            numbers = _numbers(cells[theirs], rows, theirs, skipped, problems, theirs in file.commas)
            frame[ours] = scale * numbers
    _check_limits(frame, found, problems)
    return check_orientations(frame, found, problems)


def _blank_groups(found: Mapping[str, str], cells: Mapping[str, Sequence[Cell]], count: int) -> dict[str, np.ndarray]:
    """By column of an orientation or of the noise whether rows (n,) have none: all cells of the group are blank."""
    result: dict[str, np.ndarray] = {}
    for group in _GROUPS:
        if set(group) <= set(found):
            empty = [all(_blank(cells[found[name]][i]) for name in group) for i in range(count)]
            result |= dict.fromkeys(group, np.array(empty))
    return result


def _check_limits(frame: pd.DataFrame, found: Mapping[str, str], problems: Problems) -> None:
    """Note numbers beyond their limits and put NaN in their place."""
    for name, (holds, allowed) in _LIMITS.items():
        if name not in frame:
            continue
        beyond = frame[name].notna() & ~holds(frame[name])
        for row, value in frame.loc[beyond, name].items():
            problems.add(f"range of {name}", row=row, column=found[name], value=f"{value:g}", allowed=allowed)
        frame.loc[beyond, name] = np.nan


def _numbers(
    cells: Sequence[Cell], rows: Sequence[int], theirs: str, skip: np.ndarray, problems: Problems, comma: bool
) -> np.ndarray:
    """Column (n,) of floats, NaN where a cell is skipped or is no number, which is noted.

    skip (n,): rows to skip; comma: whether texts have decimal commas.
    """
    values = np.full(len(cells), np.nan)
    for i in np.flatnonzero(~skip).tolist():
        number = _number(cells[i], comma)
        if isinstance(number, str):
            problems.add(f"no number in {theirs}", row=rows[i], column=theirs, value=_shown(cells[i]), allowed=number)
        else:
            values[i] = number
    return values


def _number(cell: Cell, comma: bool) -> float | str:
    """A cell's number, or for a cell without a finite one a text: what is allowed there."""
    if cell is None or _blank(cell):
        return f"a number{_OR_NO_ROW}"
    number = np.inf
    if isinstance(cell, str):
        text = cell.strip()
        if comma and "." in text and _NUMBER.fullmatch(text):
            return "a number with a decimal comma, as the format says, not a point"
        if not comma and _DECIMAL_COMMA.fullmatch(text):
            return "a number with a decimal point, not a comma"
        text = text.replace(",", ".") if comma else text
        if _NUMBER.fullmatch(text):
            number = float(text)
    elif isinstance(cell, (int, float, Decimal)) and not isinstance(cell, bool):
        number = float(cell)
    return number if abs(number) < _MAX_NUMBER else f"a finite number{_OR_NO_ROW}"


def _names(ours: str, cells: Sequence[Cell], rows: Sequence[int], theirs: str, problems: Problems) -> list[str]:
    """Names of trajectories or reflectors as text, "" where a cell is noted."""
    names = ["" if _blank(cell) else str(cell).strip() for cell in cells]
    for row, cell, name in zip(rows, cells, names, strict=True):
        if not name or not isinstance(cell, (str, int)):
            whose = "trajectory" if ours == "trajectory" else "reflector"
            problems.add(ours, row=row, column=theirs, value=_shown(cell), allowed=f"the {whose}'s name")
    return names


def _blank(cell: Cell) -> bool:
    """Whether a cell is empty."""
    return cell is None or (isinstance(cell, str) and not cell.strip())


def _shown(cell: Cell) -> str:
    """A cell as it stands in the file, text in quotes."""
    return "blank" if _blank(cell) else repr(cell) if isinstance(cell, str) else str(cell)


def _nearest(name: str, candidates: Iterable[str]) -> str | None:
    """The candidate that looks most like a name, or None."""
    lowered = {candidate.lower(): candidate for candidate in candidates if candidate}
    near = difflib.get_close_matches(name.lower(), lowered, n=1, cutoff=0.75)
    return lowered[near[0]] if near else None


def _advice(ours: str | None, theirs: str | None) -> str:
    """The `columns` entry that maps the file's name to ours."""
    return f'; if {theirs!r} is meant as {ours}: columns: {{{ours}: "{theirs}"}}' if ours and theirs else ""
