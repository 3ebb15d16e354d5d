"""From the cells of a measurement file to columns under our names, in mm and rad; every cell that is not what it should be is noted."""

import difflib
import re
from datetime import date, datetime, time, timedelta
from decimal import Decimal

import numpy as np
import pandas as pd

AXES = ("x", "y", "z")
COMMAND = tuple(f"command_{axis}_mm" for axis in AXES)
MEASURED = tuple(f"measured_{axis}_mm" for axis in AXES)
THETA = tuple(f"theta{k}_rad" for k in (1, 2, 3))
REQUIRED = ("trajectory", *COMMAND, *MEASURED)
OPTIONAL = ("run", "point", "time_s", *THETA, "speed_mm_s", "payload_kg")
KNOWN = (*REQUIRED, *OPTIONAL)
MM = {"mm": 1.0, "m": 1000.0, "inch": 25.4}
RAD = {"rad": 1.0, "deg": np.pi / 180.0}

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?", re.ASCII)
_MISSED = "three numbers: drop the row of a point that was not measured"


def resolve(spec, names, problems):
    """Which of the file's columns stands for which of ours: {our name: the file's name}; notes columns that are missing or nobody declared."""
    here = f"the file has {', '.join(names)}"
    for name in sorted({name for name in names if names.count(name) > 1}):
        problems.add("repeated column", column=name, value=f"{names.count(name)} columns of this name", allowed="each name once")
    found = {}
    for ours in KNOWN:
        theirs = spec.columns.get(ours, ours)
        if theirs in names:
            found[ours] = theirs
        elif ours in REQUIRED or ours in spec.columns:
            free = [name for name in names if name not in KNOWN and name not in spec.columns.values()]
            near = _nearest(theirs, free)
            advice = f'; if {near!r} is meant: columns: {{{ours}: "{near}"}}' if near else ""
            problems.add("missing column", column=theirs, value="no such column", allowed=f"a column {theirs}{advice}; {here}")
    if len(given := [name for name in THETA if name in found]) in (1, 2):
        problems.add("missing column", column=", ".join(given), value="some drive angles", allowed=f"all of {', '.join(THETA)}, or none")
    extra = [name for name in names if name not in found.values()]
    if spec.extra_columns == "refuse":
        for place, name in enumerate(names, start=1):
            if name in extra:
                near = _nearest(name, [ours for ours in KNOWN if ours not in found])
                advice = f'; if {near} is meant: columns: {{{near}: "{name}"}}' if near else ""
                shown = name or f"(no name, column {place}; pandas writes its index so)"
                allowed = f"{', '.join(KNOWN)}{advice}; extra_columns: ignore leaves other columns out"
                problems.add("unknown column", column=shown, value="a column that nobody declared", allowed=allowed)
    return found, extra


def numbers(cells, rows, ours, theirs, problems):
    """Column (n,) of floats from cells that are text, numbers or None; NaN where a cell is noted as no number."""
    values = np.full(len(cells), np.nan)
    for i, cell in enumerate(cells):
        value, fault = _number(cell)
        if fault is None:
            values[i] = value
        else:
            problems.add(f"no number in {theirs}", row=rows[i], column=theirs, value=_shown(cell), allowed=fault)
    return values


def whole_numbers(cells, rows, ours, theirs, problems):
    """Column (n,) of whole numbers from 1, as floats; NaN where a cell is noted."""
    values = numbers(cells, rows, ours, theirs, problems)
    for i in np.flatnonzero(np.isfinite(values) & ((values < 1.0) | (values > 1e9) | (values != np.round(values)))):
        problems.add(f"no number in {theirs}", row=rows[i], column=theirs, value=_shown(cells[i]), allowed="a whole number: 1, 2, 3, ...")
        values[i] = np.nan
    return values
