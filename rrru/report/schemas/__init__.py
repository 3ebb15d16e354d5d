"""The schema of every result table: what `results/README.md` prints and `rrru.report.tables` checks."""

from rrru.report.schemas import calibrate, campaign, genetic, reproduce
from rrru.report.schemas.base import Column, Table

TABLES = {table.name: table for room in (campaign, calibrate, genetic, reproduce) for table in room.TABLES}

__all__ = ["TABLES", "Column", "Table"]
