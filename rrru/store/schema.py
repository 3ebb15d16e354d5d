"""Parts of a schema, and how it is read from rows of text."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

_KINDS = {"int": "int64", "float": "float64", "str": "str", "bool": "bool"}
# name, kind, description, {allowed values}
_ROW = re.compile(r"(\S+) +(int|float|str|bool)(\??) +(.*?)(?: +\{([^}]*,[^}]*)\})?$")
# characters of which each makes a column
_EACH = re.compile(r"\{(\w+)\}")


@dataclass(frozen=True)
class Column:
    """One column: name with its unit, kind (int64, float64, str, bool), meaning, and the values of a closed set."""

    name: str
    kind: str
    description: str
    nullable: bool = False
    allowed: tuple[str, ...] = ()


@dataclass(frozen=True)
class Table:
    """One table: its path below results/, the meaning of a row, its columns and the columns that name a row."""

    name: str
    path: str
    description: str
    columns: tuple[Column, ...]
    key: tuple[str, ...]

    @property
    def names(self) -> list[str]:
        """The columns' names in order."""
        return [column.name for column in self.columns]

    def pandera(self) -> Any:
        """Pandera schema: exactly these columns, typed, null only where allowed, key unique."""
        import pandera.pandas as pa

        def checked(column: Column) -> Any:
            values = pa.Check.isin(column.allowed) if column.allowed else None
            return pa.Column(column.kind, checks=values, nullable=column.nullable)

        columns = {column.name: checked(column) for column in self.columns}
        return pa.DataFrameSchema(columns, strict=True, coerce=True, unique=list(self.key) or None)


def read_tables(text: str) -> tuple[Table, ...]:
    """Tables out of rows of text, in blocks that blank lines separate.

    A block that begins with "## name | path | key" is a table: lines that describe it, "--", then its columns. A column
    is "name kind description {allowed, values}", continued on indented lines, its kind int, float, str or bool, with ?
    where it may be null; {xyz} in its name makes one for each axis, {123} one for each number, which {123} in the
    description is too. A block without a heading has columns that tables share: in a table a line of their names
    represents them.
    """
    shared: dict[str, tuple[Column, ...]] = {}
    tables = []
    for block in text.strip().split("\n\n"):
        if not block.startswith("## "):
            shared |= {line.split()[0]: tuple(_columns(line, {})) for line in _lines(block)}
            continue
        heading, _, body = block.removeprefix("## ").partition("\n")
        name, path, key = (part.strip() for part in heading.split("|"))
        description, _, rows = body.partition("\n--\n")
        columns = tuple(_columns(rows, shared))
        tables.append(Table(name, path, " ".join(description.split()), columns, tuple(key.split())))
    return tuple(tables)


def _columns(text: str, shared: dict[str, tuple[Column, ...]]) -> Iterator[Column]:
    """Columns of the lines of a block."""
    for line in _lines(text):
        row = _ROW.match(line)
        if not row:
            yield from (column for name in line.split() for column in shared[name])
            continue
        name, kind, null, description, allowed = row.groups()
        values = tuple(value.strip() for value in allowed.split(",")) if allowed else ()
        column = Column(name, _KINDS[kind], description, bool(null), values)
        each = _EACH.search(name)
        if not each:
            yield column
            continue
        suffix = ", {xyz}" if each[1] == "xyz" else ""
        for one in each[1]:
            yield replace(
                column, name=name.replace(each[0], one), description=(description + suffix).replace(each[0], one)
            )


def _lines(text: str) -> list[str]:
    """Lines of a block, those that are continued in one."""
    return re.sub(r"\n {2,}", " ", text).splitlines()
