"""The tables' schemas by name."""

from rrru.store import tables
from rrru.studies import glossary

TABLES = glossary.tables()


def check(name, frame):
    """The frame, checked as the named table."""
    return tables.check(TABLES[name], frame)
