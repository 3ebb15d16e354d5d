"""Errors of a measurement file, collected until every check is done."""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NoReturn

from rrru.errors import IngestError, Problem

LISTED = 20
_MAX_TEXT_LENGTH = 500


class Problems:
    """Problems of one file by kind; each kind lists the first 20 and counts all."""

    def __init__(self, file: str | Path) -> None:
        self._file = str(file)
        self._by_kind: dict[str, list[Problem]] = defaultdict(list)
        self._elsewhere: dict[str, tuple[str, Mapping[int, int]]] = {}

    def __bool__(self) -> bool:
        return bool(self._by_kind)

    def add(self, kind: str, *, value: str, allowed: str, row: int | None = None, column: str | None = None) -> None:
        """Note a problem: the value that is wrong, what is allowed, and where.

        row: number as an editor shows it; column: of the file; None where the problem has none.
        """
        file, row = self._file, None if row is None else int(row)
        if column is not None and column.partition(", ")[0] in self._elsewhere:
            file, rows = self._elsewhere[column.partition(", ")[0]]
            row = None if row is None else rows.get(row)
        short_column = None if column is None else _short(column)
        problem = Problem(file=file, row=row, column=short_column, value=_short(value), allowed=_short(allowed))
        self._by_kind[kind].append(problem)

    def elsewhere(self, file: str, columns: Iterable[str], rows: Mapping[int, int]) -> None:
        """State that columns are in another file; rows: row of this file to row of that one."""
        self._elsewhere |= dict.fromkeys(columns, (str(file), rows))

    def refuse(self) -> None:
        """Raise IngestError if there is any problem."""
        if listed := self._listed():
            raise IngestError(listed)

    def _listed(self) -> list[Problem]:
        """The first problems of each kind, and after them how many there are."""
        listed: list[Problem] = []
        for problems in self._by_kind.values():
            listed += problems[:LISTED]
            if len(problems) > LISTED:
                more = f"{len(problems)} problems of this kind, of which the first {LISTED} are listed"
                listed.append(problems[LISTED] | {"row": None, "column": None, "value": more})
        return listed

    def refuse_now(
        self,
        *,
        value: str,
        allowed: str,
        row: int | None = None,
        column: str | None = None,
        error: type[IngestError] = IngestError,
    ) -> NoReturn:
        """Raise the error, an IngestError, for a problem after which no further check is possible."""
        self.add("file", row=row, column=column, value=value, allowed=allowed)
        raise error(self._listed())


def _short(text: str) -> str:
    """Text that fits into a message; a broken file can make one cell of everything below it."""
    return text if len(text) <= _MAX_TEXT_LENGTH else f"{text[:_MAX_TEXT_LENGTH]}... ({len(text)} characters)"
