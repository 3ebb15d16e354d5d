"""A measurement file on its way to a measurement table: what its columns mean and what is wrong with it so far."""

from dataclasses import dataclass
from typing import Any

import pandas as pd

from rrru.campaign import measurements as rows
from rrru.campaign.ingest.problems import Problems
from rrru.kinematics.robot import Robot

AXES = ("x", "y", "z")
COMMAND = tuple(f"command_{axis}_mm" for axis in AXES)
# orientations, commanded and measured: rotation vectors, and quaternions that replace them
TURNS = {name: tuple(f"{name}_r{axis}_rad" for axis in AXES) for name in ("command", "measured")}
QUATERNIONS = {name: tuple(f"{name}_q{part}" for part in "xyzw") for name in TURNS}
_DRIVE_NAMES = {frozenset({"rad"}): "drive angles", frozenset({"mm"}): "slider positions"}
MEASURED = tuple(f"measured_{axis}_mm" for axis in AXES)
NOISE = tuple(f"noise_{axis}_mm" for axis in AXES)
TARGET = tuple(f"target_{axis}_mm" for axis in AXES)

# rows that a note lists
_SHOWN_ROWS = 10


@dataclass(frozen=True)
class Sheet:
    """Columns under our names, in mm and rad, and their origin.

    spec, mechanism: as `ingest` takes them; problems: those of the file; found: {our name: the file's name}; frame:
    indexed by the row number, NaN where a cell has been noted.
    """

    spec: Any
    mechanism: Robot
    problems: Problems
    found: dict
    frame: pd.DataFrame

    @property
    def drives(self):
        """Names of the columns of actuator values."""
        return tuple(self.mechanism.parts.columns)

    @property
    def poses(self):
        """Nominal poses (n) at the actuator values, or where these are not stated at the commanded positions."""
        command = self.frame[[*COMMAND]].to_numpy(dtype=float)
        return self.mechanism.solve(self.actuators(command), command)

    def actuators(self, command):
        """Actuator values (n, K): those of the file, else those that the commanded poses need."""
        if set(self.drives) <= set(self.frame):
            return self.frame[[*self.drives]].to_numpy(dtype=float)
        return self.needed(self.frame, command)

    def needed(self, frame, command):
        """Actuator values (n, K) that commanded positions (n, 3) need, with the orientations of their rows if any."""
        turned = {}
        if self.mechanism.orients and set(TURNS["command"]) <= set(frame):
            turned["turn"] = rows.turns(frame, "command")
        return self.mechanism.inverse(command, elbow=self.spec.elbow, **turned)

    @property
    def drive_name(self):
        """Quantity in the columns of actuator values."""
        return drive_name(self.mechanism)

    def note(self, kind, ours, value, allowed, row=None):
        """Note a problem in columns of ours, one name or several, or None."""
        ours = (ours,) if isinstance(ours, str) else ours
        column = ", ".join(self.found.get(name, name) for name in ours) if ours else None
        self.problems.add(kind, row=row, column=column, value=value, allowed=allowed)

    def refuse_now(self, ours, value, allowed):
        """Raise IngestError for a problem in columns of ours that leaves nothing more to look at."""
        self.note("file", ours, value, allowed)
        self.problems.refuse()


def drive_name(mechanism):
    """Quantity in a robot's columns of actuator values."""
    return _DRIVE_NAMES.get(frozenset(mechanism.parts.units), "actuator values")


def rows_text(numbers):
    """Rows by number in words, the first ten of them."""
    return ", ".join(f"row {number}" for number in numbers[:_SHOWN_ROWS]) + ", ..." * (len(numbers) > _SHOWN_ROWS)


def position_text(position):
    """A position in mm for a message."""
    return f"({', '.join(f'{value:.6g}' for value in position)}) mm"
