"""The schema of every result table: what `results/README.md` prints and `rrru.report.tables` checks."""

from rrru.report.schemas import calibrate, campaign, delta, gap, genetic, methods, printers, ptt, reproduce, withheld, withheld_parts
from rrru.report.schemas.base import Column, Table

_ROOMS = (campaign, calibrate, genetic, reproduce, gap, withheld, withheld_parts, printers, delta, ptt, methods)
TABLES = {table.name: table for room in _ROOMS for table in room.TABLES}

__all__ = ["TABLES", "Column", "Table"]
