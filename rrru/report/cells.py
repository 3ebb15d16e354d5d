"""Frames as tables of a page: words in the head, numbers short, what each column means as a hint."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from rrru.store.schema import Table

# units that the names of columns end in, as they are read
_UNITS = {unit: unit for unit in ("mm", "rad", "deg", "s", "kg", "nats")}
_UNITS |= {"mm_s": "mm/s", "percent": "%", "um": "µm", "um_per_mm": "µm/mm", "px": "pixel"}
_UNIT = re.compile(rf"_({'|'.join(sorted(_UNITS, key=len, reverse=True))})$")
# what names of columns end in that are ends of intervals
_END = re.compile(r"_?(low|high)(?:_95)?$")
_DIGITS = 4
# letters of a text that needs a wide column, and a wider one
_LONG, _LONGER = 40, 150
MINUS = "\N{MINUS SIGN}"


@dataclass(frozen=True)
class Column:
    """A column's head: name in the file, words, hint, and its look: "n" for numbers, "w" and "x" for long texts."""

    name: str
    words: str
    hint: str
    look: str


@dataclass(frozen=True)
class Grid:
    """A table of a page: an identifier, title, what a row is, where its file lies, Columns, and rows of text."""

    key: str
    title: str
    about: str
    path: str
    columns: list[Column]
    rows: list[list[str]]


def words(name: str) -> str:
    """A column's or an effect's name as words, its unit in parentheses."""
    found = _UNIT.search(name)
    stem = name[: found.start()] if found else name
    return stem.replace("_", " ") + (f" ({_UNITS[found[1]]})" if found else "")


def head(name: str, meaning: str = "") -> str:
    """A column's name as words; of an end of a 95 % interval, as its meaning says, with the interval."""
    if name == "random_95":
        return "random part, 95 %: ±"
    found = _END.search(name)
    if not (found and "95 %" in meaning):
        return words(name)
    end = {"low": "from", "high": "to"}[found[1]]
    return ", ".join(part for part in (words(name[: found.start()]), f"95 % {end}") if part)


def text(value: Any) -> str:
    """A cell's text: numbers to four digits, yes and no, a dash for nothing."""
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if value is None or value is pd.NA or (isinstance(value, float | np.floating) and np.isnan(value)):
        return "–"
    if isinstance(value, float | np.floating):
        return short(float(value))
    return str(value).replace("-", MINUS) if isinstance(value, int | np.integer) else str(value)


def short(value: float) -> str:
    """A number to four digits; an exponent only where there are many zeros."""
    if not np.isfinite(value):
        return "∞" if value > 0.0 else f"{MINUS}∞"
    if value == 0.0:
        return "0"
    size = int(np.floor(np.log10(abs(value))))
    shown = f"{value:.{_DIGITS - 1}e}" if size < -5 or size > 8 else f"{value:.{max(_DIGITS - 1 - size, 0)}f}"
    if "." in shown and "e" not in shown:
        shown = shown.rstrip("0").rstrip(".")
    return shown.replace("-", MINUS)


def grid(
    frame: pd.DataFrame,
    key: str,
    title: str,
    table: Table | None = None,
    path: str = "",
    heads: Mapping[str, str] | None = None,
) -> Grid:
    """A Grid of a frame.

    table: the Table whose columns it has, for what they mean, None where there is none; heads: words of single columns.
    """
    meaning = {column.name: column.description for column in table.columns} if table else {}
    heads = {name: head(name, meaning.get(name, "")) for name in frame} | dict(heads or {})
    rows = [[text(value) for value in row] for row in frame.itertuples(index=False)]
    longest = [max(map(len, cells), default=0) for cells in zip(*rows, strict=True)] or [0] * len(frame.columns)
    looks = [
        "n" if pd.api.types.is_numeric_dtype(frame[n]) else "x" if size > _LONGER else "w" * (size > _LONG)
        for n, size in zip(frame, longest, strict=True)
    ]
    columns = [Column(n, heads[n], meaning.get(n, ""), look) for n, look in zip(frame, looks, strict=True)]
    return Grid(key, title, table.description if table else "", path, columns, rows)
