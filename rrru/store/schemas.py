"""The schema of every result table: what `results/README.md` prints and `rrru.store.tables` checks."""

from rrru.campaign import schemas as campaign
from rrru.fit import schemas as calibrate
from rrru.gap import schemas as gap
from rrru.genetic import schemas as genetic
from rrru.store.schema import Column, Table
from rrru.studies.delta import schemas as delta
from rrru.studies.methods import schemas as methods
from rrru.studies.printers import schemas as printers
from rrru.studies.ptt3 import schemas as ptt
from rrru.studies.rrru3 import schemas as reproduce
from rrru.studies.withheld import schemas as withheld
from rrru.studies.withheld import schemas_parts as withheld_parts

_ROOMS = (campaign, calibrate, genetic, reproduce, gap, withheld, withheld_parts, printers, delta, ptt, methods)
TABLES = {table.name: table for room in _ROOMS for table in room.TABLES}

__all__ = ["TABLES", "Column", "Table"]
