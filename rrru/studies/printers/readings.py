"""Ingest of linear-delta printers: what their owners measured, and what their firmware made of it.

The file is JSON, a list of printers:

    {"id": "mine", "source": "where it is from",
     "radius_mm": 150.0,
     "towers": {"a": {"angle_deg": 210.0, "arm_mm": 315.0, "endstop_mm": 332.9,
                      "rotation_distance_mm": 40.0, "microsteps": 16, "full_steps": 200, "gear_ratio": null, "step_mm":
                      null},
                "b": {...}, "c": {...}},
     "heights": [{"z_mm": 17.4, "stable": [201936.8, 201995.2, 202106.2]}, ...],
     "distances": [{"mm": 65.1, "stable1": [...], "stable2": [...]}, ...]}

`radius_mm`, `angle_deg`, `arm_mm` and `endstop_mm` are the answer that the firmware has saved, or for a printer that
was never calibrated the nominal numbers: calibration starts there. `stable`: microsteps of the three carriages down
from their endstops. `z_mm`: the nozzle's true height there. `mm`: caliper distance between the nozzle's places at two
such triples. One microstep is rotation_distance / (full_steps x microsteps), divided by gear ratios such as "3:1",
unless step_mm gives it. `source`, `distances`, `gear_ratio` and `step_mm` may be absent; so may
`program_height_rms_mm`, `program_distance_rms_mm` and `refit_max_difference`, which are not read.
"""

import json
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rrru.campaign.ingest.problems import Problems
from rrru.robots.linear_delta import linear_delta

_TOWERS = ("a", "b", "c")
_SIZES = ("angle_deg", "arm_mm", "endstop_mm")
_DRIVE = ("rotation_distance_mm", "microsteps", "full_steps")
_NOT_READ = ("program_height_rms_mm", "program_distance_rms_mm", "refit_max_difference")
_TEETH = r"\s*[1-9]\d*(\.\d+)?\s*:\s*[1-9]\d*(\.\d+)?\s*"
_GEARS = re.compile(f"{_TEETH}(,{_TEETH})*")
# numbers of the calibration: radius, two angles, three endstops; with distances also three arms
_NUMBERS = {"heights": 6, "distances": 9}


@dataclass(frozen=True)
class Printer:
    """One printer: numbers as saved per tower a, b, c, readings, and carriages' ways down from the endstops in mm.

    angle_deg, arm_mm, endstop_mm, step_mm: (3,). height_mm: (n,), height_drop_mm: (n, 3). distance_mm: (m,),
    distance_drop_mm: (m, 2, 3).
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

    @property
    def parameter_set(self):
        """Which numbers its readings calibrate: "distances" where there are any, else "heights"."""
        return "distances" if len(self.distance_mm) else "heights"

    def mechanism(self, parameter_set=None):
        """The printer with its saved numbers as nominal ones; by default with the parameters that it calibrates."""
        saved = self.radius_mm, np.radians(self.angle_deg), self.arm_mm, self.endstop_mm
        return linear_delta(*saved, parameter_set or self.parameter_set)


def read(path):
    """Printers of a file, a tuple; raises IngestError with every problem that it has, naming printer and field."""
    problems = Problems(path)
    try:
        content = json.loads(Path(path).read_text())
    except OSError as error:
        problems.refuse_now(value=error.strerror or str(error), allowed="a file that can be read")
    except ValueError as error:
        problems.refuse_now(value=f"no JSON ({error})", allowed="JSON, a list of printers")
    if not (isinstance(content, list) and content and all(isinstance(entry, dict) for entry in content)):
        problems.refuse_now(value="something else", allowed="a list of at least one printer, each a mapping")
    names = [str(entry.get("id", f"number {k}")) for k, entry in enumerate(content, start=1)]
    for name in sorted({name for name in names if names.count(name) > 1}):
        problems.add("id", column=name, value="an id that several printers have", allowed="an id per printer")
    printers = tuple(_Reader(name, problems).printer(entry) for name, entry in zip(names, content, strict=True))
    problems.refuse()
    for printer in printers:
        _check_reach(printer, problems)
    problems.refuse()
    return printers


def _check_reach(printer, problems):
    """Note readings at which the saved printer's arms do not meet."""
    robot, lost = printer.mechanism(), "a place that the saved printer cannot take"
    for field, drops in (("heights", printer.height_drop_mm[:, None]), ("distances", printer.distance_drop_mm)):
        for number, drop in enumerate(drops, start=1):
            if np.isnan(robot.forward(-drop)).any():
                where = f"{printer.name}: {field}, number {number}"
                problems.add("reach", column=where, value=lost, allowed="its own readings")


class _Reader:
    """Reads one printer and notes what is wrong with it under its name."""

    def __init__(self, name, problems):
        self._name, self._problems, self._sound = name, problems, True

    def _refuse(self, field, value, allowed):
        self._sound = False
        self._problems.add("printer", column=f"{self._name}: {field}", value=value, allowed=allowed)

    def printer(self, entry):
        """The printer of an entry, None where something is wrong with it."""
        self._keys("", entry, ("id", "radius_mm", "towers", "heights"), ("source", "distances", *_NOT_READ))
        towers = self._of_kind(entry, "towers", dict)
        self._keys("towers", towers, _TOWERS)
        towers = {name: self._of_kind(towers, name, dict, "towers.") for name in _TOWERS}
        for name, tower in towers.items():
            self._keys(f"towers.{name}", tower, _SIZES, ("step_mm", "gear_ratio", *_DRIVE))
        angle, arm, endstop = (
            np.array(
                [
                    self._number(f"towers.{name}.{size}", tower.get(size), size == "arm_mm")
                    for name, tower in towers.items()
                ]
            )
            for size in _SIZES
        )
        step = np.array([self._step(f"towers.{name}", tower) for name, tower in towers.items()])
        height, height_steps = self._readings(entry, "heights", "z_mm", ("stable",))
        distance, distance_steps = self._readings(entry, "distances", "mm", ("stable1", "stable2"))
        radius = self._number("radius_mm", entry.get("radius_mm"), positive=True)
        self._counts(len(height), len(distance))
        if self._sound and not (arm > radius).all():
            self._refuse("towers", f"an arm of {arm.min():g} mm", f"arms longer than radius_mm, {radius:g} mm")
        if not self._sound:
            return None
        saved = str(entry.get("source", "")), radius, angle, arm, endstop, step
        return Printer(self._name, *saved, height, height_steps[:, 0] * step, distance, distance_steps * step)

    def _keys(self, place, mapping, needed, optional=()):
        """Note keys that are missing and keys that nobody knows."""
        known = (*needed, *optional)
        told = [(key, "nothing", "this field") for key in needed if key not in mapping]
        told += [(key, "an unknown field", ", ".join(known)) for key in mapping if key not in known]
        for key, value, allowed in told:
            self._refuse(".".join(filter(None, (place, str(key)))), value, allowed)

    def _of_kind(self, mapping, key, kind, place=""):
        """mapping[key] if it is of the kind, else an empty one."""
        value = mapping.get(key, kind())
        if isinstance(value, kind):
            return value
        self._refuse(f"{place}{key}", repr(value), "a list" if kind is list else "a mapping")
        return kind()

    def _number(self, field, value, positive=False):
        """A number as float, NaN where it is none; that there is nothing is noted elsewhere."""
        if value is None:
            return np.nan
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if number and np.isfinite(value) and (value > 0.0 or not positive):
            return float(value)
        self._refuse(field, repr(value), "a positive number" if positive else "a finite number")
        return np.nan

    def _step(self, place, tower):
        """Length of one microstep of a tower's drive in mm."""
        if tower.get("step_mm") is not None:
            return self._number(f"{place}.step_mm", tower["step_mm"], positive=True)
        for key in _DRIVE:
            if tower and tower.get(key) is None:
                self._refuse(f"{place}.{key}", "nothing", "a positive number, or step_mm")
        around, parts, full = (self._number(f"{place}.{key}", tower.get(key), positive=True) for key in _DRIVE)
        gears = tower.get("gear_ratio") or "1:1"
        if not (isinstance(gears, str) and _GEARS.fullmatch(gears)):
            self._refuse(f"{place}.gear_ratio", repr(gears), 'null or ratios such as "3:1" or "57:11, 2:1"')
            return np.nan
        ratios = [[float(teeth) for teeth in pair.split(":")] for pair in gears.split(",")]
        return around / (full * parts) / np.prod([driven / driving for driven, driving in ratios])

    def _readings(self, entry, field, size, places):
        """Sizes (n,) and steps (n, places, 3) of one kind of reading."""
        sizes, steps = [], []
        for number, reading in enumerate(self._of_kind(entry, field, list), start=1):
            where = f"{field}, number {number}"
            if not isinstance(reading, dict):
                self._refuse(where, repr(reading), "a mapping")
                continue
            self._keys(where, reading, (size, *places))
            sizes.append(self._number(f"{where}, {size}", reading.get(size), positive=size == "mm"))
            steps.append([self._triple(f"{where}, {place}", reading.get(place)) for place in places])
        return np.array(sizes), np.array(steps).reshape(-1, len(places), 3)

    def _triple(self, field, value):
        """Microsteps of the three carriages."""
        if isinstance(value, list) and len(value) == 3:
            return [self._number(field, "null" if number is None else number) for number in value]
        if value is not None:
            self._refuse(field, repr(value), "three numbers, microsteps down from the endstops")
        return [np.nan] * 3

    def _counts(self, heights, distances):
        """Note too few readings: one more than numbers to fit, else nothing tells how good they are."""
        few, least = _NUMBERS["heights"], _NUMBERS["distances" if distances else "heights"]
        if heights + distances <= least or heights < few:
            allowed = f"at least {few} heights and {least + 1} readings for {least} numbers"
            self._refuse("heights", f"{heights} heights and {distances} distances", allowed)
