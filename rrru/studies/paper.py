"""Printed contents of a paper: its numbers compared with a study's, and its misprints as rows of an audit."""

import csv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from rrru.errors import ConfigError

_ABSENT, _NO_DRAWS = (np.nan, np.nan), (np.nan, np.nan, np.nan)


@dataclass(frozen=True)
class Number:
    """One printed number: item, place in the paper, unit and value, and a note."""

    item: str
    source: str
    unit: str
    value: float
    note: str = ""


def read_numbers(file):
    """Numbers of a CSV file by the column part, each a tuple in the file's order."""
    parts = {}
    for row in _rows(file):
        number = Number(row["item"], row["source"], row["unit"], float(row["value"]), row["note"])
        parts.setdefault(row["part"], []).append(number)
    return {part: tuple(numbers) for part, numbers in parts.items()}


def read_lost(file):
    """Lost parts of a scan from a CSV file: {where: (what, instead)}."""
    return {row["where"]: (row["what"], row["instead"]) for row in _rows(file)}


def _rows(file):
    """Rows of a CSV file as mappings of text."""
    with Path(file).open(encoding="utf-8", newline="") as lines:
        return list(csv.DictReader(lines))


@dataclass(frozen=True)
class Finding:
    """One misprint, contradiction or claim: place, printed text, correct text, and the deciding values.

    check: what is computed; it and `right` may hold fields such as {2:.2f} for the values. values: function without
    arguments that returns the value of the printed form, that of the correct form, and further deciding values. shows:
    from these values, whether the misprint or contradiction is confirmed. Without both the text alone decides.
    """

    where: str
    printed: str
    right: str
    check: str = "as printed"
    unit: str = ""
    values: Callable = lambda: _ABSENT
    shows: Callable = lambda *_: True

    def row(self):
        """Row of `audit` without `paper` and `kind`."""
        values = tuple(float(value) for value in self.values())
        return {
            "where": self.where,
            "printed": self.printed,
            "right": self.right.format(*values),
            "check": self.check.format(*values),
            "unit": self.unit,
            "value_printed": values[0],
            "value_right": values[1],
            "shown": bool(self.shows(*values)),
        }


def finding(where, printed, right, unit, shows):
    """Decorator: the Finding of a function, whose docstring states the computation; see Finding for the arguments."""

    def finding_of(values):
        check = " ".join(values.__doc__.split()).rstrip(".")
        return Finding(where, printed, right, check[0].lower() + check[1:], unit, values, shows)

    return finding_of


def published_rows(paper, numbers, here, spread=None, notes=None):
    """Rows of `published` for the numbers that a paper prints, null for absent ones.

    here, spread, notes: item to this study's number, to its (median, low, high) over other draws, and to an addition to
    the printed number's note. Raises ConfigError for an item of `here` that the paper does not print.
    """
    known = list(dict.fromkeys(number.item for number in numbers))
    if unknown := sorted(set(here) - set(known)):
        raise ConfigError(f"paper {paper} prints no {', '.join(unknown)}; known: {', '.join(known)}")
    spread, notes = spread or {}, notes or {}
    frame = pd.DataFrame(
        [
            {
                "paper": paper,
                "item": number.item,
                "source": number.source,
                "unit": number.unit,
                "published": number.value,
                "here": here.get(number.item, np.nan),
                "note": "; ".join(filter(None, (number.note, notes.get(number.item)))),
            }
            for number in numbers
        ]
    )
    median, low, high = np.array([spread.get(item, _NO_DRAWS) for item in frame["item"]]).T
    cases = {"no draws": np.isnan(low), "below": frame["published"] < low, "above": frame["published"] > high}
    inside = np.select(list(cases.values()), list(cases), "inside")
    ratio = frame["here"] / frame["published"].where(frame["published"] != 0.0)
    return frame.assign(ratio=ratio, here_median=median, here_low=low, here_high=high, inside=inside)


def audit_rows(paper, computed, as_printed=(), lost=None):
    """Rows of `audit`: Findings by computation, Findings as printed, and lost parts, {where: (what, instead)}."""
    absent = [
        Finding(where, f"lost: {what}", instead, "its replacement", shows=lambda *_: False)
        for where, (what, instead) in (lost or {}).items()
    ]
    parts = {"computed": computed, "as printed": as_printed, "lost": absent}
    return pd.DataFrame(
        [{"paper": paper, "kind": kind} | finding.row() for kind, findings in parts.items() for finding in findings]
    )
