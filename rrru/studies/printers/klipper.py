"""Klipper's printer.cfg as the printers' JSON form: the owner's settings and the block that SAVE_CONFIG wrote.

A setting above the block overrides the saved one, as in Klipper. Absent settings have Klipper's defaults: 200 full
steps per turn, towers at 210, 330 and 90 degrees, arm and endstop of tower a for the others. Files from before 2021
have `step_distance` instead of rotation distance and microsteps. `[include ..]` is followed where the file exists. One
of an absolute path that does not exist is the printer's: its path and its name are tried in printer.cfg's folder.
"""

import configparser
from pathlib import Path

from rrru.errors import IngestError

_ANGLES = {"a": 210.0, "b": 330.0, "c": 90.0}
_BLOCK, _MAX_READINGS = "#*#", 1000
# sections of probes; each may be followed by a name
_PROBES = ("probe", "bltouch", "smart_effector", "probe_eddy_current", "load_cell_probe", "dockable_probe")
_PROBES += ("scanner", "beacon", "cartographer", "klicky")


def entry(path, name):
    """The printer of a printer.cfg as an entry of the JSON form; raises IngestError with all its problems."""
    settings = _Settings(path)
    if settings.text("printer", "kinematics") not in (None, "delta"):
        settings.refuse("printer: kinematics", settings.text("printer", "kinematics"), "delta")
    towers = {tower: _tower(settings, tower) for tower in _ANGLES}
    radius = settings.number("printer", "delta_radius")
    offset = _probe_offset(settings)
    heights = _heights(settings, "height", None if offset is None else offset[:2])
    if offset is not None and offset[2] != 0.0:
        # Klipper saves the probe's z_offset for every probed height, and 0 where the nozzle itself touched
        heights = [one | ({"probe_offset_mm": [0.0, 0.0]} if one["z_mm"] == 0.0 else {}) for one in heights]
    # entered by DELTA_ANALYZE MANUAL_HEIGHT; Klipper places them before the probed ones
    heights = _heights(settings, "manual_height", [0.0, 0.0]) + heights
    if not heights:
        allowed = "the heights that DELTA_CALIBRATE probes and SAVE_CONFIG saves"
        settings.refuse("delta_calibrate: height0", "nothing", allowed)
    settings.finish()
    saved = {"id": name, "source": str(path), "radius_mm": radius, "towers": towers}
    return saved | {"heights": heights, "distances": _distances(settings)}


def _tower(settings, tower):
    """Angle, arm, endstop and drive of a tower."""
    section, first = f"stepper_{tower}", "stepper_a"
    result = {"angle_deg": settings.number(section, "angle", _ANGLES[tower])}
    for field, option in (("arm_mm", "arm_length"), ("endstop_mm", "position_endstop")):
        otherwise = settings.number(first, option) if tower != "a" else None
        result[field] = settings.number(section, option, otherwise)
    if settings.text(section, "rotation_distance") is None and settings.text(section, "step_distance") is not None:
        return result | {"step_mm": settings.number(section, "step_distance")}
    return result | {
        "rotation_distance_mm": settings.number(section, "rotation_distance"),
        "microsteps": settings.number(section, "microsteps"),
        "full_steps": settings.number(section, "full_steps_per_rotation", 200.0),
        "gear_ratio": settings.text(section, "gear_ratio"),
    }


def _probe_offset(settings):
    """Offset of the probe from the nozzle in x, y and z, None without a probe."""
    section = next((name for name in settings.sections if name.split()[0] in _PROBES), None)
    return section and [settings.number(section, f"{axis}_offset", 0.0) for axis in "xyz"]


def _heights(settings, option, offset):
    """Heights of one kind."""
    heights = []
    for _, height, (place,) in settings.readings(option, ("pos",)):
        heights.append({"z_mm": height, "stable": place} | ({} if offset is None else {"probe_offset_mm": offset}))
    return heights


def _distances(settings):
    """Distances between places."""
    readings = settings.readings("distance", ("pos1", "pos2"))
    return [{"mm": length, "stable1": first, "stable2": second} for _, length, (first, second) in readings]


class _Settings:
    """Settings of a printer.cfg by section and option, and their problems."""

    def __init__(self, path):
        self._path, self._problems = path, []
        owner, block = [], []
        for line in _lines(Path(path), set()):
            (block if line.startswith(_BLOCK) else owner).append(line)
        saved = [line.removeprefix(_BLOCK).removeprefix(" ") for line in block]
        while saved and not saved[0].startswith("["):
            saved.pop(0)
        self.sections = self._parsed(saved)
        for section, options in self._parsed([line.split("#")[0] for line in owner]).items():
            self.sections[section] = self.sections.get(section, {}) | options

    def _parsed(self, lines):
        """Options by section of the text of one part of the file."""
        parser = configparser.RawConfigParser(strict=False, inline_comment_prefixes=(";", "#"), default_section="")
        try:
            parser.read_string("\n".join(lines), source=str(self._path))
        except configparser.Error as error:
            reason = str(error).replace("\n", " ")
            self.refuse(None, f"no printer.cfg ({reason})", "sections of options, as Klipper reads them")
            self.finish()
        return {section: dict(parser[section]) for section in parser.sections()}

    def refuse(self, column, value, allowed):
        """Note a problem with a setting."""
        problem = {"file": str(self._path), "row": None, "column": column, "value": value, "allowed": allowed}
        self._problems += [problem] if problem not in self._problems else []

    def finish(self):
        """Raise IngestError if there is any problem."""
        if self._problems:
            raise IngestError(self._problems)

    def text(self, section, option):
        """The text of a setting, None for a missing one."""
        return self.sections.get(section, {}).get(option)

    def number(self, section, option, otherwise=None):
        """A setting as a number; a missing one has the default `otherwise`, without which it is noted as missing."""
        text = self.text(section, option)
        if text is None:
            if otherwise is None:
                self.refuse(f"{section}: {option}", "nothing", "this setting")
            return otherwise
        try:
            return float(text)
        except ValueError:
            self.refuse(f"{section}: {option}", repr(text), "a number")
            return None

    def readings(self, option, places):
        """Number, size and places of every reading of one kind in [delta_calibrate], up to the first missing number."""
        section = "delta_calibrate"
        for number in range(_MAX_READINGS):
            name = f"{option}{number}"
            if self.text(section, name) is None:
                return
            yield number, self.number(section, name), [self._place(section, f"{name}_{place}") for place in places]

    def _place(self, section, option):
        """Steps of the three carriages."""
        text = self.text(section, option) or ""
        try:
            steps = [float(part) for part in text.split(",")]
        except ValueError:
            steps = []
        if len(steps) != 3:
            self.refuse(f"{section}: {option}", repr(text), "three numbers with commas, microsteps from the endstops")
        return steps


def _lines(path, seen):
    """Lines of a file and of the files that it includes."""
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise _unread(path, None, error.strerror or str(error), "a file that can be read") from None
    seen.add(path.resolve())
    for line in text.splitlines():
        if not line.startswith("[include "):
            yield line
            continue
        pattern = line[len("[include ") :].split("]")[0].strip()
        try:
            others = _included(path.parent, pattern)
        except (ValueError, OSError) as error:
            raise _unread(path, line, f"{pattern!r} ({error})", "the name of a file, or a pattern of names") from None
        for other in others:
            if other.is_file() and other.resolve() not in seen:
                yield from _lines(other, seen)


def _included(folder, pattern):
    """Files of the pattern of an include, sorted; see the module for absolute ones."""
    if not pattern.startswith("/"):
        return sorted(folder.glob(pattern))
    # not `**`, which would search the whole disk
    if found := sorted(Path("/").glob(pattern.replace("**", "*").lstrip("/"))):
        return found
    return sorted(folder.glob(pattern.lstrip("/"))) or sorted(folder.glob(Path(pattern).name))


def _unread(path, column, value, allowed):
    """The IngestError of a file, or of a line in it, that cannot be read."""
    return IngestError([{"file": str(path), "row": None, "column": column, "value": value, "allowed": allowed}])
