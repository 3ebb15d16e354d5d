"""Seconds since a campaign's start from dates and times of day."""

from collections.abc import Iterable, Sequence
from datetime import datetime

import numpy as np

from rrru.campaign.ingest.cells import Cell
from rrru.campaign.ingest.problems import Problems

_ISO = "a date and a time of day, 2026-03-04 10:11:12.345"


def is_clock(cells: Iterable[Cell], pattern: str | None) -> bool:
    """Whether a column of cells holds times of day, not seconds; pattern: as it is declared, None where it is not."""
    first = next((cell for cell in cells if cell is not None and cell != ""), None)
    return pattern is not None or isinstance(first, datetime) or (isinstance(first, str) and ":" in first)


def seconds(
    cells: Sequence[Cell], rows: Sequence[int], theirs: str, pattern: str | None, problems: Problems
) -> np.ndarray:
    """Seconds (n,) since the earliest of n cells, NaN where one is noted.

    pattern: of strptime, such as "%d.%m.%Y %H:%M:%S"; None takes ISO 8601 alone, as no other order of day and month
    is unambiguous. Local times are used as they are: a clock that is put back shows as time that runs backwards.
    """
    times: list[datetime | None] = []
    allowed = f"{_ISO}; other forms are stated: time_format: '%d.%m.%Y %H:%M:%S'"
    if pattern:
        allowed = f"a time as time_format says: {pattern}"
    for row, cell in zip(rows, cells, strict=True):
        times.append(parsed(cell, pattern))
        if times[-1] is None:
            value = "blank" if cell is None or cell == "" else repr(cell) if isinstance(cell, str) else str(cell)
            problems.add("time", row=row, column=theirs, value=value, allowed=allowed)
    known = [time for time in times if time is not None]
    zoned = {time.tzinfo is not None for time in known}
    if len(zoned) > 1:
        problems.add("time", column=theirs, value="times with and without a zone", allowed="all of one kind")
        return np.full(len(times), np.nan)
    if not known:
        return np.full(len(times), np.nan)
    start = min(known)
    return np.array([np.nan if time is None else (time - start).total_seconds() for time in times])


def parsed(cell: Cell, pattern: str | None) -> datetime | None:
    """A cell as a time by a pattern of strptime, or by ISO 8601 without one; None where it is no time."""
    if isinstance(cell, datetime):
        return cell
    text = str(cell).strip()
    try:
        # "/" between day and month is no ISO 8601
        return datetime.strptime(text, pattern) if pattern else datetime.fromisoformat(text)
    except ValueError:
        return None
