"""The tables' schemas by name."""

from rrru.campaign.schemas import measurement_table
from rrru.store import tables
from rrru.studies import glossary

TABLES = glossary.tables()


def check(name, frame):
    """The frame, checked as the named table."""
    return tables.check(TABLES[name], frame)


def check_measurements(robot, frame):
    """The frame, checked as the measurement table of a robot."""
    return tables.check(measurement_table(robot, frame.columns), frame)
