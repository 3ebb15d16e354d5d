"""A measurement file on its way to a measurement table: what its columns mean and what is wrong with it so far."""

from dataclasses import dataclass
from typing import Any

import pandas as pd

from rrru.campaign.ingest.problems import Problems
from rrru.campaign.measurements import actuator_columns
from rrru.robots.mechanism import Mechanism

AXES = ("x", "y", "z")
COMMAND = tuple(f"command_{axis}_mm" for axis in AXES)
MEASURED = tuple(f"measured_{axis}_mm" for axis in AXES)
# columns of the commanded actuator values by their unit: drive angles or slider positions
DRIVES = {unit: tuple(actuator_columns(unit)) for unit in ("rad", "mm")}


@dataclass(frozen=True)
class Sheet:
    """Columns under our names, in mm and rad, and their origin.

    spec, mechanism: as `ingest` takes them; problems: those of the file; found: {our name: the file's name}; frame:
    indexed by the row number, NaN where a cell has been noted.
    """

    spec: Any
    mechanism: Mechanism
    problems: Problems
    found: dict
    frame: pd.DataFrame

    @property
    def drives(self):
        """Names of the three columns of actuator values."""
        return DRIVES[self.mechanism.drive_unit]

    @property
    def drive_name(self):
        """What the columns of actuator values hold."""
        return drive_name(self.drives)

    def note(self, kind, ours, value, allowed, row=None):
        """Note a problem in columns of ours, one name or several, or None."""
        ours = (ours,) if isinstance(ours, str) else ours
        column = ", ".join(self.found.get(name, name) for name in ours) if ours else None
        self.problems.add(kind, row=row, column=column, value=value, allowed=allowed)

    def refuse_now(self, ours, value, allowed):
        """Raise IngestError for a problem in columns of ours that leaves nothing more to look at."""
        self.note("file", ours, value, allowed)
        self.problems.refuse()


def drive_name(drives):
    """What columns of actuator values hold."""
    return "drive angles" if drives == DRIVES["rad"] else "slider positions"


def position_text(position):
    """A position in mm for a message."""
    return f"({', '.join(f'{value:.6g}' for value in position)}) mm"
