"""A linear-delta printer: its saved numbers, and the measurements of its owner."""

from dataclasses import dataclass

import numpy as np

from rrru.errors import IngestError
from rrru.robots.linear_delta import linear_delta


@dataclass(frozen=True)
class Printer:
    """One printer: saved numbers per tower a, b, c, readings, and carriage displacements down from the endstops in mm.

    angle_deg, arm_mm, endstop_mm, step_mm: (3,). height_mm: (n,), height_drop_mm: (n, 3). distance_mm: (m,),
    distance_drop_mm: (m, 2, 3). probe_mm: (n, 2), offset of the probe from the nozzle in x and y; 0 where the nozzle
    itself touched, NaN where not stated. calibrated: whether the saved numbers are stated to be from these readings.
    """

    name: str
    source: str
    radius_mm: float
    angle_deg: np.ndarray
    arm_mm: np.ndarray
    endstop_mm: np.ndarray
    step_mm: np.ndarray
    height_mm: np.ndarray
    height_drop_mm: np.ndarray
    distance_mm: np.ndarray
    distance_drop_mm: np.ndarray
    probe_mm: np.ndarray
    calibrated: bool = True

    @property
    def parameter_set(self):
        """The parameters that its readings calibrate: "distances" where there are any, otherwise "heights"."""
        return "distances" if len(self.distance_mm) else "heights"

    @property
    def by_hand(self):
        """Flags (n,) of the heights that the nozzle itself touched."""
        return (self.probe_mm == 0.0).all(axis=1)

    def mechanism(self, parameter_set=None):
        """The printer with its saved numbers as nominal ones; by default with the parameters that it calibrates."""
        saved = self.radius_mm, np.radians(self.angle_deg), self.arm_mm, self.endstop_mm
        return linear_delta(*saved, parameter_set or self.parameter_set)


@dataclass(frozen=True)
class Refused:
    """A printer that cannot be read, by name; problems: as those of IngestError."""

    name: str
    source: str
    problems: tuple

    @property
    def reason(self):
        """Its problems in one line."""
        return str(IngestError(self.problems)).replace("\n", "; ")
