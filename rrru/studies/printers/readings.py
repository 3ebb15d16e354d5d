"""Ingest of linear-delta printers: measurements of their owners, and saved answers of their firmware.

The file is JSON, a list of printers:

    {"id": "mine", "source": "where it is from",
     "radius_mm": 150.0,
     "towers": {"a": {"angle_deg": 210.0, "arm_mm": 315.0, "endstop_mm": 332.9,
                      "rotation_distance_mm": 40.0, "microsteps": 16, "full_steps": 200, "gear_ratio": null, "step_mm":
                      null},
                "b": {...}, "c": {...}},
     "heights": [{"z_mm": 17.4, "stable": [201936.8, 201995.2, 202106.2]}, ...],
     "distances": [{"mm": 65.1, "stable1": [...], "stable2": [...]}, ...]}

`radius_mm`, `angle_deg`, `arm_mm` and `endstop_mm` are the saved answer of the firmware, or the nominal numbers of a
printer without calibration. The calibration starts there. `stable`: microsteps of the three carriages down
from their endstops. `z_mm`: the nozzle's true height there. `mm`: caliper distance between the nozzle's places at two
such triples. One microstep is rotation_distance / (full_steps x microsteps), divided by gear ratios such as "3:1",
unless step_mm gives it. `source`, `distances`, `gear_ratio` and `step_mm` may be absent; so may
`program_height_rms_mm`, `program_distance_rms_mm` and `refit_max_difference`, which are not read.

"probe_offset_mm": [x, y], of a printer or of one height: offset of the probe from the nozzle; [0, 0] for a height that
the nozzle itself touched. "calibrated": false where the saved numbers are not stated to come from the readings.
"""

import json
import re
from pathlib import Path

import numpy as np

from rrru.campaign.ingest.problems import Problems
from rrru.errors import IngestError
from rrru.studies.printers.printer import Printer, Refused

_TOWERS = ("a", "b", "c")
_SIZES = ("angle_deg", "arm_mm", "endstop_mm")
_DRIVE = ("rotation_distance_mm", "microsteps", "full_steps")
_OPTIONAL = ("source", "distances", "probe_offset_mm", "calibrated")
_NOT_READ = ("program_height_rms_mm", "program_distance_rms_mm", "refit_max_difference")
_TEETH = r"\s*[1-9]\d*(\.\d+)?\s*:\s*[1-9]\d*(\.\d+)?\s*"
_GEARS = re.compile(f"{_TEETH}(,{_TEETH})*")
_MAX_NUMBER = 1e15  # a larger number is a typing error, and results from it may overflow
# numbers of the calibration: radius, two angles, three endstops; with distances also three arms
_NUMBERS = {"heights": 6, "distances": 9}


def read(path):
    """Printers of a file, a tuple; an invalid one is a `Refused` that names every field.

    Raises IngestError where the file has no list of printers, or no valid one.
    """
    problems = Problems(path)
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        problems.refuse_now(value=error.strerror or str(error), allowed="a file that can be read")
    except UnicodeDecodeError:
        problems.refuse_now(value="no text in UTF-8", allowed="JSON, a list of printers")
    except (ValueError, RecursionError) as error:
        problems.refuse_now(value=f"no JSON ({error})", allowed="JSON, a list of printers")
    if isinstance(content, dict):
        problems.refuse_now(value="one mapping", allowed="a list of printers: put the mapping in [ ]")
    if not (isinstance(content, list) and content and all(isinstance(entry, dict) for entry in content)):
        problems.refuse_now(value="something else", allowed="a list of at least one printer, each a mapping")
    names = [str(entry.get("id", f"number {k}")) for k, entry in enumerate(content, start=1)]
    for name in sorted({name for name in names if names.count(name) > 1}):
        problems.add("id", column=name, value="an id of several printers", allowed="a different id for each printer")
    problems.refuse()
    printers = tuple(printer_of(path, name, entry) for name, entry in zip(names, content, strict=True))
    if all(isinstance(printer, Refused) for printer in printers):
        raise IngestError([problem for printer in printers for problem in printer.problems])
    return printers


def printer_of(path, name, entry):
    """The printer of an entry in the JSON's form, a Refused for an invalid one."""
    problems = Problems(path)
    printer = _Reader(name, problems).printer(entry)
    try:
        problems.refuse()
    except IngestError as error:
        return Refused(name, str(entry.get("source", "")), error.problems)
    return printer


class _Reader:
    """Reads one printer and notes its problems under its name."""

    def __init__(self, name, problems):
        self._name, self._problems, self._sound = name, problems, True

    def _refuse(self, field, value, allowed):
        self._sound = False
        self._problems.add("printer", column=f"{self._name}: {field}", value=value, allowed=allowed)

    def printer(self, entry):
        """The printer of an entry, None for an invalid one."""
        self._keys("", entry, ("id", "radius_mm", "towers", "heights"), (*_OPTIONAL, *_NOT_READ))
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
        probe = self._probe(entry)
        radius = self._number("radius_mm", entry.get("radius_mm"), positive=True)
        self._counts(len(height), len(distance))
        if self._sound and not (arm > radius).all():
            self._refuse("towers", f"an arm of {arm.min():g} mm", f"arms longer than radius_mm, {radius:g} mm")
        if not self._sound:
            return None
        saved = str(entry.get("source", "")), radius, angle, arm, endstop, step
        ways = height_steps[:, 0] * step, distance, distance_steps * step
        return Printer(self._name, *saved, height, *ways, probe, entry.get("calibrated", True) is True)

    def _probe(self, entry):
        """Offsets (n, 2) of the probe from the nozzle at the heights, NaN where not stated."""
        everywhere = self._offset("probe_offset_mm", entry.get("probe_offset_mm"), [np.nan, np.nan])
        heights = [height for height in self._of_kind(entry, "heights", list) if isinstance(height, dict)]
        return np.array(
            [
                self._offset(f"heights, number {number}, probe_offset_mm", height.get("probe_offset_mm"), everywhere)
                for number, height in enumerate(heights, start=1)
            ]
        ).reshape(-1, 2)

    def _offset(self, field, value, otherwise):
        """An offset in x and y."""
        if value is None:
            return otherwise
        if isinstance(value, list) and len(value) == 2:
            return [self._number(field, "null" if number is None else number) for number in value]
        self._refuse(field, repr(value), "two numbers, mm in x and y from the nozzle")
        return otherwise

    def _keys(self, place, mapping, needed, optional=()):
        """Note missing and unknown keys."""
        known = (*needed, *optional)
        problems = [(key, "nothing", "this field") for key in needed if key not in mapping]
        problems += [(key, "an unknown field", ", ".join(known)) for key in mapping if key not in known]
        for key, value, allowed in problems:
            self._refuse(".".join(filter(None, (place, str(key)))), value, allowed)

    def _of_kind(self, mapping, key, kind, place=""):
        """mapping[key] if it is of the kind, otherwise an empty one."""
        value = mapping.get(key, kind())
        if isinstance(value, kind):
            return value
        self._refuse(f"{place}{key}", repr(value), "a list" if kind is list else "a mapping")
        return kind()

    def _number(self, field, value, positive=False):
        """A number as float, NaN for anything else; missing values are noted elsewhere."""
        if value is None:
            return np.nan
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if number and abs(value) <= _MAX_NUMBER and (value > 0.0 or not positive):
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
            self._keys(where, reading, (size, *places), ("probe_offset_mm",) * (field == "heights"))
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
        """Note too few readings: at least one degree of freedom is needed for the noise."""
        few, least = _NUMBERS["heights"], _NUMBERS["distances" if distances else "heights"]
        if heights + distances <= least or heights < few:
            allowed = f"at least {few} heights and {least + 1} readings for {least} numbers"
            self._refuse("heights", f"{heights} heights and {distances} distances", allowed)
