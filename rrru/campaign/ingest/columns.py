"""From a file's cells to columns under our names, in mm and rad; every cell that is not what it should be is noted."""

import difflib
import re
from decimal import Decimal

import numpy as np
import pandas as pd

from rrru.campaign.ingest.orientations import check_orientations
from rrru.campaign.ingest.sheet import COMMAND, MEASURED, QUATERNIONS, TURNS, drive_name

REQUIRED = ("trajectory", *COMMAND, *MEASURED)
_GROUPS = (*TURNS.values(), *QUATERNIONS.values())
_MORE = ("target", "temperature_c", *(name for group in _GROUPS for name in group))
_TEXT = ("trajectory", "target")
_BEFORE_DRIVES, _AFTER_DRIVES = ("run", "point", "time_s"), ("speed_mm_s", "payload_kg")
MM = {"mm": 1.0, "m": 1000.0, "inch": 25.4}
RAD = {"rad": 1.0, "deg": np.pi / 180.0}

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?", re.ASCII)
_LARGEST = 1e12
_COUNTED = (lambda v: (v >= 1) & (v <= 1e9) & (v == v.round()), "a whole number: 1, 2, 3, ...")
# ASSUME what a parallel robot of about a metre can carry and how fast it can go, and campaigns of less than 12 days:
# clock times show.
_LIMITS = {
    "run": _COUNTED,
    "point": _COUNTED,
    "time_s": (lambda v: (v >= 0) & (v <= 1e6), "0 to 1e6 s since the campaign's start"),
    "speed_mm_s": (lambda v: (v > 0) & (v <= 2e4), "above 0 and up to 20000 mm/s"),
    "payload_kg": (lambda v: (v >= 0) & (v <= 1e3), "0 to 1000 kg"),
    "temperature_c": (lambda v: (v >= -50) & (v <= 100), "-50 to 100 degrees Celsius"),
}


def known_columns(mechanism):
    """Our names of all columns that a robot's file may have."""
    return (*REQUIRED, *_BEFORE_DRIVES, *mechanism.parts.columns, *_AFTER_DRIVES, *_MORE)


def resolve(spec, names, mechanism, problems):
    """{our name: the file's name} of the columns that the file has, and its columns that nobody declared.

    Missing columns, repeated ones and, unless `extra_columns` is "ignore", undeclared ones are noted.
    """
    drives = mechanism.parts.columns
    for name in sorted({name for name in names if names.count(name) > 1}):
        value = f"{names.count(name)} columns of this name"
        problems.add("repeated column", column=name, value=value, allowed="each name once")
    wanted = {ours: spec.columns.get(ours, ours) for ours in known_columns(mechanism)}
    found = {ours: theirs for ours, theirs in wanted.items() if theirs in names}
    extra = [name for name in names if name not in found.values()]
    # drive values tell where the robot was sent as well
    sent = set(drives) <= set(found) and not set(COMMAND) & set(found)
    for ours, theirs in wanted.items():
        if ours not in found and ((ours in REQUIRED and not (sent and ours in COMMAND)) or ours in spec.columns):
            allowed = f"a column {theirs}{_advice(ours, _nearest(theirs, extra))}; the file has {', '.join(names)}"
            problems.add("missing column", column=theirs, value="no such column", allowed=allowed)
    given = ", ".join(found[name] for name in drives if name in found)
    if 0 < sum(name in found for name in drives) < len(drives):
        allowed = f"all of {', '.join(drives)}, or none"
        problems.add("missing column", column=given, value=f"some {drive_name(mechanism)}", allowed=allowed)
    for group in _GROUPS:
        given = ", ".join(found[name] for name in group if name in found)
        if 0 < sum(name in found for name in group) < len(group):
            allowed = f"all of {', '.join(group)}, or none"
            problems.add("missing column", column=given, value="a part of an orientation", allowed=allowed)
    if spec.extra_columns == "refuse":
        unused = [ours for ours in wanted if ours not in found]
        for name in dict.fromkeys(extra):
            shown = name or f"(no name, column {names.index(name) + 1}; pandas writes its index so)"
            advice = f"{_advice(_nearest(name, unused), name)}; extra_columns: ignore leaves the others out"
            allowed = f"{', '.join(wanted)}{advice}"
            problems.add("unknown column", column=shown, value="a column that nobody declared", allowed=allowed)
    return found, extra


def convert(spec, mechanism, found, cells, rows, problems):
    """Frame of our columns in mm and rad, indexed by the row numbers (n,); NaN, or "" as a name, where a cell is noted.

    found: {our name: the file's name}; cells: {the file's name: cells (n,) that are text, numbers or None}. An optional
    column without any value is left out.
    """
    measured = [found[name] for name in MEASURED if name in found]
    missed = np.array([bool(measured) and all(_blank(cells[name][i]) for name in measured) for i in range(len(rows))])
    for row in np.asarray(rows)[missed]:
        allowed = "three numbers: drop the row of a point that was not measured"
        problems.add("missed point", row=row, column=", ".join(measured), value="blank", allowed=allowed)
    needed = [*REQUIRED, "target"]
    filled = {ours for ours, theirs in found.items() if ours in needed or not all(map(_blank, cells[theirs]))}
    drives = {drive.column: drive.unit for drive in mechanism.parts.drives}
    filled |= set(drives) if filled & set(drives) else set()
    factor = dict.fromkeys((*COMMAND, *MEASURED), MM[spec.unit])
    factor |= {name: MM[spec.unit] if unit == "mm" else RAD[spec.angle_unit] for name, unit in drives.items()}
    frame = pd.DataFrame(index=pd.Index(rows))
    blank = _blank_groups(found, cells, len(rows))
    for ours, theirs in found.items():
        if ours in _TEXT:
            names = _names(ours, cells[theirs], rows, theirs, problems)
            frame[ours] = pd.Series(names, index=frame.index, dtype=object)
        elif ours in filled:
            skipped = missed & (ours in MEASURED) | blank.get(ours, False)
            frame[ours] = factor.get(ours, 1.0) * _numbers(cells[theirs], rows, theirs, skipped, problems)
    _check_limits(frame, found, problems)
    return check_orientations(frame, found, problems)


def _blank_groups(found, cells, count):
    """By column of an orientation the rows (n,) that have none: all its cells are blank."""
    result = {}
    for group in _GROUPS:
        if set(group) <= set(found):
            empty = [all(_blank(cells[found[name]][i]) for name in group) for i in range(count)]
            result |= dict.fromkeys(group, np.array(empty))
    return result


def _check_limits(frame, found, problems):
    """Note numbers beyond their limits and put NaN in their place."""
    for name, (holds, allowed) in _LIMITS.items():
        if name not in frame:
            continue
        beyond = frame[name].notna() & ~holds(frame[name])
        for row, value in frame.loc[beyond, name].items():
            problems.add(f"range of {name}", row=row, column=found[name], value=f"{value:g}", allowed=allowed)
        frame.loc[beyond, name] = np.nan


def _numbers(cells, rows, theirs, skip, problems):
    """Column (n,) of floats; NaN where a cell is skipped or noted as no number."""
    values = np.full(len(cells), np.nan)
    for i in np.flatnonzero(~skip):
        if fault := _fault(cells[i]):
            problems.add(f"no number in {theirs}", row=rows[i], column=theirs, value=_shown(cells[i]), allowed=fault)
        else:
            values[i] = float(cells[i])
    return values


def _fault(cell):
    """What a cell should hold that does not hold a finite number, else None."""
    if _blank(cell):
        return "a number; drop a row that lacks one"
    if isinstance(cell, str):
        if _DECIMAL_COMMA.fullmatch(cell.strip()):
            return "a number with a decimal point, not a comma"
        number = _NUMBER.fullmatch(cell.strip())
    else:
        number = isinstance(cell, (int, float, Decimal)) and not isinstance(cell, bool)
    return None if number and abs(float(cell)) < _LARGEST else "a finite number"


def _names(ours, cells, rows, theirs, problems):
    """Names of trajectories or reflectors as text, "" where a cell is noted."""
    names = ["" if _blank(cell) else str(cell).strip() for cell in cells]
    for row, cell, name in zip(rows, cells, names, strict=True):
        if not name or not isinstance(cell, (str, int)):
            whose = "trajectory" if ours == "trajectory" else "reflector"
            problems.add(ours, row=row, column=theirs, value=_shown(cell), allowed=f"the {whose}'s name")
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
