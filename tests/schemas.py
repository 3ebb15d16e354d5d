"""The tables' schemas by name, and made-up tables from them."""

import pandas as pd

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


_MADE_UP = {"str": "", "float64": 1.0, "int64": 1, "bool": True}


def filled(name, rows, generator=None):
    """The named table of rows, checked. What they lack is made up: 1, true, empty, or small random numbers."""
    frame = pd.DataFrame(rows)
    for column in TABLES[name].columns:
        if column.name not in frame:
            made_up = 0.05 * generator.standard_normal(len(frame)) if generator else _MADE_UP[column.kind]
            frame[column.name] = made_up
    return check(name, frame)
