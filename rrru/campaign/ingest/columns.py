"""From the cells of a measurement file to columns under our names, in mm and rad; every cell that is not what it should
be is noted.
"""

import difflib
import re
from decimal import Decimal

import numpy as np
import pandas as pd
import pandera.pandas as pa
from pandera.errors import SchemaErrors

from rrru.campaign.measurements import actuator_columns

AXES = ("x", "y", "z")
COMMAND = tuple(f"command_{axis}_mm" for axis in AXES)
MEASURED = tuple(f"measured_{axis}_mm" for axis in AXES)
# columns of the commanded actuator values by their unit: drive angles or slider positions
DRIVES = {unit: tuple(actuator_columns(unit)) for unit in ("rad", "mm")}
REQUIRED = ("trajectory", *COMMAND, *MEASURED)
OPTIONAL = ("run", "point", "time_s", *DRIVES["rad"], *DRIVES["mm"], "speed_mm_s", "payload_kg")
KNOWN = (*REQUIRED, *OPTIONAL)
MM = {"mm": 1.0, "m": 1000.0, "inch": 25.4}
RAD = {"rad": 1.0, "deg": np.pi / 180.0}

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?", re.ASCII)
_LARGEST = 1e12
_MISSED = "three numbers: drop the row of a point that was not measured"


# ASSUME what a parallel robot of about a metre can carry and how fast it can go, and campaigns of less than 12 days:
# clock times show.
_LIMITS = {
    "run": (lambda v: (v >= 1) & (v <= 1e9) & (v == v.round()), "a whole number: 1, 2, 3, ..."),
    "point": (lambda v: (v >= 1) & (v <= 1e9) & (v == v.round()), "a whole number: 1, 2, 3, ..."),
    "time_s": (lambda v: (v >= 0) & (v <= 1e6), "0 to 1e6 s since the campaign's start"),
    "speed_mm_s": (lambda v: (v > 0) & (v <= 2e4), "above 0 and up to 20000 mm/s"),
    "payload_kg": (lambda v: (v >= 0) & (v <= 1e3), "0 to 1000 kg"),
}
_SCHEMA = pa.DataFrameSchema(
    {
        name: pa.Column(float, pa.Check(test, error=allowed), nullable=True, required=False)
        for name, (test, allowed) in _LIMITS.items()
    }
)


def resolve(spec, names, drives, problems):
    """Which of the file's columns stands for which of ours: {our name: the file's name}, and the file's columns that
    nobody declared.

    drives: names of the three columns of actuator values that the robot has. Missing columns, repeated ones and, unless
    `extra_columns` is "ignore", undeclared ones are noted.
    """
    known = [name for name in KNOWN if name in drives or name not in (*DRIVES["rad"], *DRIVES["mm"])]
    for name in sorted({name for name in names if names.count(name) > 1}):
        problems.add(
            "repeated column", column=name, value=f"{names.count(name)} columns of this name", allowed="each name once"
        )
    found = {ours: spec.columns.get(ours, ours) for ours in known if spec.columns.get(ours, ours) in names}
    extra = [name for name in names if name not in found.values()]
    for ours in known:
        theirs = spec.columns.get(ours, ours)
        if ours not in found and (ours in REQUIRED or ours in spec.columns):
            allowed = f"a column {theirs}{_advice(ours, _nearest(theirs, extra))}; the file has {', '.join(names)}"
            problems.add("missing column", column=theirs, value="no such column", allowed=allowed)
    given = [found[name] for name in drives if name in found]
    if len(given) in (1, 2):
        problems.add(
            "missing column",
            column=", ".join(given),
            value=f"some {drive_name(drives)}",
            allowed=f"all of {', '.join(drives)}, or none",
        )
    if spec.extra_columns == "refuse":
        unused = [ours for ours in known if ours not in found]
        for name in dict.fromkeys(extra):
            shown = name or f"(no name, column {names.index(name) + 1}; pandas writes its index so)"
            allowed = f"{', '.join(known)}{_advice(_nearest(name, unused), name)}; extra_columns: ignore leaves the others out"
            problems.add("unknown column", column=shown, value="a column that nobody declared", allowed=allowed)
    return found, extra


def drive_name(drives):
    """What the columns of actuator values hold."""
    return "drive angles" if drives == DRIVES["rad"] else "slider positions"


def convert(spec, found, cells, rows, problems):
    """Frame of the columns under our names, indexed by the row numbers (n,), in mm and rad; NaN, or "" as a name, where
    a cell is noted.

    found: {our name: the file's name}; cells: {the file's name: cells (n,) that are text, numbers or None}. An optional
    column without any value is left out.
    """
    missed = np.all(
        [[_blank(cell) for cell in cells[found[name]]] for name in MEASURED if name in found] or [[False] * len(rows)],
        axis=0,
    )
    for row in np.asarray(rows)[missed]:
        problems.add(
            "missed point",
            row=row,
            column=", ".join(found[name] for name in MEASURED if name in found),
            value="blank",
            allowed=_MISSED,
        )
    filled = {ours for ours, theirs in found.items() if ours in REQUIRED or not all(map(_blank, cells[theirs]))}
    for drives in DRIVES.values():
        if filled & set(drives):
            filled |= set(drives)
    frame = pd.DataFrame(index=pd.Index(rows))
    for ours, theirs in found.items():
        if ours == "trajectory":
            frame[ours] = pd.Series(_names(cells[theirs], rows, theirs, problems), index=frame.index, dtype=object)
        elif ours in filled:
            skip = missed if ours in MEASURED else np.zeros(len(rows), dtype=bool)
            factor = (
                MM[spec.unit]
                if ours in COMMAND + MEASURED + DRIVES["mm"]
                else RAD[spec.angle_unit]
                if ours in DRIVES["rad"]
                else 1.0
            )
            frame[ours] = factor * _numbers(cells[theirs], rows, theirs, skip, problems)
    try:
        _SCHEMA.validate(frame, lazy=True)
    except SchemaErrors as error:
        for case in error.failure_cases.itertuples():
            problems.add(
                f"range of {case.column}",
                row=case.index,
                column=found[case.column],
                value=f"{case.failure_case:g}",
                allowed=case.check,
            )
            frame.loc[case.index, case.column] = np.nan
    return frame


def _numbers(cells, rows, theirs, skip, problems):
    """Column (n,) of floats; NaN where a cell is skipped or noted as no number."""
    values = np.full(len(cells), np.nan)
    for i in np.flatnonzero(~skip):
        values[i], fault = _number(cells[i])
        if fault:
            problems.add(f"no number in {theirs}", row=rows[i], column=theirs, value=_shown(cells[i]), allowed=fault)
    return values


def _number(cell):
    """Value of a cell and None, or NaN and what is allowed."""
    if _blank(cell):
        return np.nan, "a number; drop a row that lacks one"
    if isinstance(cell, str):
        if not _NUMBER.fullmatch(cell.strip()):
            return np.nan, "a number with a decimal point, not a comma" if _DECIMAL_COMMA.fullmatch(
                cell.strip()
            ) else "a finite number"
    elif isinstance(cell, bool) or not isinstance(cell, (int, float, Decimal)):
        return np.nan, "a finite number"
    value = float(cell)
    return (value, None) if abs(value) < _LARGEST else (np.nan, "a finite number")


def _names(cells, rows, theirs, problems):
    """Names of the trajectories as text, "" where a cell is noted."""
    names = []
    for row, cell in zip(rows, cells, strict=True):
        name = "" if _blank(cell) else str(cell).strip()
        if not name or not isinstance(cell, (str, int)):
            problems.add("trajectory", row=row, column=theirs, value=_shown(cell), allowed="the trajectory's name")
        names.append(name)
    return names


def _blank(cell):
    """Whether a cell holds nothing."""
    return cell is None or (isinstance(cell, str) and not cell.strip())


def _shown(cell):
    """A cell as it stands in the file, text in quotes."""
    return "blank" if _blank(cell) else repr(cell) if isinstance(cell, str) else str(cell)


def _nearest(name, candidates):
    """The candidate that looks most like a name, or None."""
    lowered = {candidate.lower(): candidate for candidate in candidates if candidate}
    near = difflib.get_close_matches(name.lower(), lowered, n=1, cutoff=0.75)
    return lowered[near[0]] if near else None


def _advice(ours, theirs):
    """How to say that the file's name stands for ours."""
    return f'; if {theirs!r} is meant as {ours}: columns: {{{ours}: "{theirs}"}}' if ours and theirs else ""
