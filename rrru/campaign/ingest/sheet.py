"""A measurement file on its way to a measurement table: what its columns mean and what is wrong with it so far."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NoReturn

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.campaign.ingest.problems import Problems
from rrru.errors import IngestError
from rrru.kinematics.chain import Poses
from rrru.kinematics.robot import Robot

if TYPE_CHECKING:
    # whose readers of files import the names below
    from rrru.campaign.ingest.spec import IngestSpec

AXES = ("x", "y", "z")
COMMAND = tuple(f"command_{axis}_mm" for axis in AXES)
# orientations, commanded and measured: rotation vectors, and quaternions that replace them
TURNS = {name: tuple(f"{name}_r{axis}_rad" for axis in AXES) for name in ("command", "measured")}
QUATERNIONS = {name: tuple(f"{name}_q{part}" for part in "xyzw") for name in TURNS}
_DRIVE_NAMES = {frozenset({"rad"}): "drive angles", frozenset({"mm"}): "slider positions"}
MEASURED: tuple[str, ...] = tuple(f"measured_{axis}_mm" for axis in AXES)
NOISE: tuple[str, ...] = tuple(f"noise_{axis}_mm" for axis in AXES)
TARGET = tuple(f"target_{axis}_mm" for axis in AXES)

# rows that a note lists
_SHOWN_ROWS = 10


@dataclass(frozen=True)
class Sheet:
    """Columns under our names, in mm and rad, and their origin.

    spec, mechanism: as `ingest` takes them; problems: those of the file; found: {our name: the file's name}; frame:
    indexed by the row number, NaN where a cell has been noted.
    """

    spec: "IngestSpec"
    mechanism: Robot
    problems: Problems
    found: dict[str, str]
    frame: pd.DataFrame

    @property
    def drives(self) -> tuple[str, ...]:
        """Names of the columns of actuator values."""
        return tuple(self.mechanism.parts.columns)

    @property
    def poses(self) -> Poses:
        """Nominal poses (n) at the actuator values, or where these are not stated at the commanded positions."""
        command = rows.command(self.frame)
        return self.mechanism.solve(self.actuators(command), command)

    def actuators(self, command: np.ndarray) -> np.ndarray:
        """Actuator values (n, K): those of the file, else those that the commanded poses need."""
        if set(self.drives) <= set(self.frame):
            return np.asarray(self.frame[[*self.drives]].to_numpy(dtype=float))
        return self.needed(self.frame, command)

    def needed(self, frame: pd.DataFrame, command: np.ndarray) -> np.ndarray:
        """Actuator values (n, K) that commanded positions (n, 3) need, with the orientations of their rows if any."""
        turned = {}
        if self.mechanism.orients and set(TURNS["command"]) <= set(frame):
            turned["turn"] = rows.turns(frame, "command")
        return self.mechanism.inverse(command, elbow=self.spec.elbow, **turned)

    @property
    def drive_name(self) -> str:
        """Quantity in the columns of actuator values."""
        return drive_name(self.mechanism)

    def note(
        self, kind: str, ours: str | Sequence[str] | None, value: str, allowed: str, row: int | None = None
    ) -> None:
        """Note a problem in columns of ours, one name or several, or None."""
        self.problems.add(kind, row=row, column=self._column(ours), value=value, allowed=allowed)

    def refuse_now(
        self, ours: str | Sequence[str] | None, value: str, allowed: str, error: type[IngestError] = IngestError
    ) -> NoReturn:
        """Raise an IngestError, of a class, for a problem in columns of ours that leaves nothing more to look at."""
        self.problems.refuse_now(column=self._column(ours), value=value, allowed=allowed, error=error)

    def _column(self, ours: str | Sequence[str] | None) -> str | None:
        """The file's names of columns of ours."""
        ours = (ours,) if isinstance(ours, str) else ours
        for name, turns in TURNS.items():
            # rotation vectors that were made from quaternions are in no file
            if ours == turns and set(QUATERNIONS[name]) <= set(self.found):
                ours = QUATERNIONS[name]
        return ", ".join(self.found.get(name, name) for name in ours) if ours else None


def drive_name(mechanism: Robot) -> str:
    """Quantity in a robot's columns of actuator values."""
    return _DRIVE_NAMES.get(frozenset(mechanism.parts.units), "actuator values")


def rows_text(numbers: Sequence[int] | pd.Index) -> str:
    """Rows by number in words, the first ten of them."""
    return ", ".join(f"row {number}" for number in numbers[:_SHOWN_ROWS]) + ", ..." * (len(numbers) > _SHOWN_ROWS)


def position_text(position: Iterable[float]) -> str:
    """A position in mm for a message; what is below a nanometre is rounding."""
    return f"({', '.join(f'{round(value, 6) + 0.0:.6g}' for value in position)}) mm"
