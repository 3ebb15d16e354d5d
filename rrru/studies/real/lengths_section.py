"""Validated access to a section of `real: sets:` of a machine with measured lengths, and to its columns."""

import numpy as np
import pandas as pd

from rrru.campaign.ingest.problems import Problems
from rrru.errors import ConfigError

MM = {"mm": 1.0, "m": 1000.0, "inch": 25.4}
RAD = {"rad": 1.0, "deg": np.pi / 180.0}
_LARGEST = 1e9


class Section:
    """The mapping of one set; every method raises ConfigError with set and key for an invalid value."""

    def __init__(self, section, name, needed, optional):
        self.name = name
        self._values = self._of_kind(section, dict, f"real.sets.{name}", "a mapping")
        for key in needed:
            if key not in section:
                raise ConfigError(f"real.sets.{name}: got no {key!r}; allowed: {', '.join(needed)} in every such set")
        for key in section:
            if key not in (*needed, *optional):
                known = ", ".join((*needed, *optional))
                raise ConfigError(f"real.sets.{name}: got an unknown key {key!r}; allowed: {known}")

    def _of_kind(self, value, kind, place, allowed):
        if not isinstance(value, kind) or not value:
            raise ConfigError(f"{place}: got {value!r}; allowed: {allowed}")
        return value

    def refuse(self, key, value, allowed):
        """Raise ConfigError for a value at a key."""
        raise ConfigError(f"real.sets.{self.name}.{key}: got {value!r}; allowed: {allowed}")

    def mapping(self, key):
        """A mapping that is not empty."""
        return self._of_kind(self._values[key], dict, f"real.sets.{self.name}.{key}", "a mapping with entries")

    def texts(self, key):
        """A list of different texts."""
        values = self._of_kind(self._values[key], list, f"real.sets.{self.name}.{key}", "a list of names")
        if not all(isinstance(value, str) and value for value in values) or len(set(values)) < len(values):
            self.refuse(key, values, "different names")
        return values

    def number(self, key, value, low=-_LARGEST):
        """A finite number not below a lower limit."""
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not low <= value <= _LARGEST:
            self.refuse(key, value, f"a number from {low:g} to {_LARGEST:g}")
        return float(value)

    def choice(self, key, default, allowed):
        """One of the allowed values."""
        value = self._values.get(key, default)
        if value not in allowed:
            self.refuse(key, value, ", ".join(map(str, allowed)))
        return value

    def heights(self, key, names):
        """Numbers (n,) from 0 on for some of the names, 0 for the others."""
        given = self.mapping(key) if self._values.get(key) else {}
        for name in given:
            if name not in names:
                self.refuse(key, name, f"one of {', '.join(names)}")
        return np.array([self.number(f"{key}.{name}", given.get(name, 0.0), low=0.0) for name in names])

    def given(self, key, default=None):
        """The raw value of a key."""
        return self._values.get(key, default)


def numbers(frame, columns, name, least_rows, above=None):
    """Columns (n, c) of a frame as floats; raises IngestError with every fault by row, column and value.

    name: of the file in messages; rows are counted from 1; above: exclusive lower limit of every number.
    """
    problems = Problems(name)
    if not isinstance(frame, pd.DataFrame):
        problems.refuse_now(value=f"a {type(frame).__name__}", allowed="a table with one row per measured place")
    repeated = sorted({str(column) for column in columns if (frame.columns == column).sum() > 1})
    for column in repeated:
        problems.add("repeated", column=column, value="several columns of this name", allowed="each name once")
    for column in dict.fromkeys(columns):
        if column not in frame.columns:
            allowed = f"one of {', '.join(map(str, frame.columns))}"
            problems.add("missing", column=str(column), value="no such column", allowed=allowed)
    if len(frame) < least_rows:
        allowed = f"at least {least_rows}: fewer do not determine the machine's parameters"
        problems.add("rows", value=f"{len(frame)} rows", allowed=allowed)
    problems.refuse()
    values = np.column_stack(
        [pd.to_numeric(frame[column], errors="coerce").to_numpy(dtype=float) for column in columns]
    )
    wanted = "a finite number" if above is None else f"a finite number above {above:g}"
    fault = ~(np.abs(values) < _LARGEST) | (values <= (-np.inf if above is None else above))
    for row, place in np.argwhere(fault):
        shown = repr(frame[columns[place]].tolist()[row])
        problems.add("number", row=row + 1, column=str(columns[place]), value=shown, allowed=wanted)
    problems.refuse()
    return values


def row_numbers(frame, section, default="row"):
    """The rows' numbers (n,): of the column that the key `row` names, or of a column `row`, otherwise from 1.

    Raises IngestError for repeated or missing numbers.
    """
    column = section.given("row", default)
    if column not in frame.columns:
        if section.given("row") is not None:
            section.refuse("row", column, f"one of {', '.join(map(str, frame.columns))}")
        return np.arange(1, len(frame) + 1)
    found, problems = pd.to_numeric(frame[column], errors="coerce"), Problems(section.given("files"))
    for row in np.flatnonzero((found.isna() | (found % 1 != 0) | found.duplicated()).to_numpy()):
        shown = repr(frame[column].tolist()[row])
        problems.add("number", row=row + 1, column=column, value=shown, allowed="whole numbers, each once")
    problems.refuse()
    return found.to_numpy(dtype=int)


def held_out(frame, section):
    """Flags (n,) of the held-out rows from the column `held_out`; None without the column, or if all flags are equal.

    Raises IngestError for a flag that is neither 0 nor 1.
    """
    if "held_out" not in frame.columns:
        return None
    flags = pd.to_numeric(frame["held_out"], errors="coerce").to_numpy(dtype=float)
    problems = Problems(section.given("files"))
    for row in np.flatnonzero(~np.isin(flags, (0.0, 1.0))):
        shown = repr(frame["held_out"].tolist()[row])
        problems.add("number", row=row + 1, column="held_out", value=shown, allowed="0 or 1")
    problems.refuse()
    return flags == 1.0 if 0 < flags.sum() < len(flags) else None
