"""Errors for the user; each message states what is wrong, where, the value and what is allowed."""

from collections.abc import Iterable
from pathlib import Path
from typing import TypedDict


class RrruError(Exception):
    """Base of every error that rrru raises on purpose."""


class ConfigError(RrruError):
    """The configuration asks for something that does not exist or does not fit together."""


class Problem(TypedDict):
    """A problem of a measurement file.

    `row` is the number that an editor shows, of the line of a text or the row of a sheet; of parquet files, which have
    no header line, it is counted from 1. It is None where the whole file or column is meant.
    """

    file: str
    row: int | None
    column: str | None
    value: str
    allowed: str


class IngestError(RrruError):
    """A measurement file is refused; `problems` is a tuple of each `Problem`."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(_problem_text(p) for p in self.problems))


class GrossFileError(IngestError):
    """A measurement file is refused in any frame of the instrument: its units are wrong, or it is of another robot."""


class MistakeError(GrossFileError):
    """A measurement file is refused for a mistake that explains it in any units and any frame of the instrument."""


class UnreachableError(RrruError):
    """A commanded pose lies outside the reachable workspace."""


class FitError(RrruError):
    """A fit failed; `result` has its last state."""

    def __init__(self, message: str, result: object = None) -> None:
        super().__init__(message)
        self.result = result


class SimulationError(RrruError):
    """An independent simulator did not reach a pose that may be recorded."""


class TableError(RrruError):
    """A result table does not fit its schema."""


class WriteError(RrruError):
    """A file of results cannot be written."""


def why_unreadable(error: Exception) -> str:
    """Why a text file could not be read, in words, from the error of reading it."""
    for kind, words in _UNREADABLE.items():
        if isinstance(error, kind):
            return words
    return " ".join(str(error).split())


def not_a_file(path: str | Path) -> str:
    """Why a path is no file, in words, "" where it is one."""
    path = Path(path)
    return "" if path.is_file() else "is a folder" if path.is_dir() else _UNREADABLE[FileNotFoundError]


_UNREADABLE = {
    FileNotFoundError: "there is no such file",
    IsADirectoryError: "is a folder",
    PermissionError: "may not be read",
    UnicodeDecodeError: "is no text in UTF-8",
}


def _problem_text(problem: Problem) -> str:
    """One line: file, row, column, value, allowed."""
    where = [str(problem["file"])]
    if problem.get("row") is not None:
        where.append(f"row {problem['row']}")
    if problem.get("column") is not None:
        where.append(f"column {problem['column']}")
    return f"{', '.join(where)}: got {problem['value']}; allowed: {problem['allowed']}"
