"""Commands and answers of RepRapFirmware as the printers' JSON form: M665 and M666, a list of G30, the heights.

    M665 L288.140 R136.2 H201.1 X0.1 Y-0.2 Z0      rods (one, or three with colons), radius, homed height, angles
    M666 X-1.36 Y1.11 Z0.25                        endstops, added to the homed height
    G31 X0 Y20 Z1.2                                offset of the probe from the nozzle, its trigger height
    G30 P0 X0 Y125 Z-99999                         places, in order of P; the list may be in a separate file
    G32 bed probe heights: 0.018 0.014 ..          the answer of G30 with S-1

All are in one file; of a repeated letter the last one counts. Towers X, Y and Z are at 210, 330 and 90 degrees. The
numbers were active during probing and come from other readings.
"""

import re
from pathlib import Path

import numpy as np

from rrru.errors import ConfigError, IngestError
from rrru.robots.linear_delta import linear_delta

_ANGLES = {"a": 210.0, "b": 330.0, "c": 90.0}
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)"
_LETTER = re.compile(rf"([A-Z])\s*({_NUMBER}(?::{_NUMBER})*)")
_HEIGHTS = re.compile(rf"bed probe heights:\s*({_NUMBER}(?:[\s,]+{_NUMBER})*)", re.IGNORECASE)


def belongs(path):
    """Whether a file is of this form."""
    try:
        text = Path(path).read_text(encoding="utf-8", errors="replace")
    except OSError:
        return False
    return re.search(r"^\s*M665\b", text, re.MULTILINE) is not None


def entry(path, name):
    """The printer of a file as an entry of the JSON form; raises IngestError with what is missing."""
    text = Path(path).read_text(encoding="utf-8", errors="replace")
    commands = _commands(text)
    found = _HEIGHTS.findall(text)
    heights = [float(number) for number in re.findall(_NUMBER, found[-1])] if found else []
    places = [[letters["X"][0], letters["Y"][0]] for _, letters in sorted(commands["G30"].items())]
    if len(heights) != len(places) or not heights:
        _refuse(
            path, "G30", f"{len(heights)} heights of {len(places)} places", "a height for every place, as G30 S-1 lists"
        )
    x, y, trigger = (commands["G31"].get(axis, [0.0])[0] for axis in "XYZ")
    towers, radius = _towers(path, commands["M665"], commands["M666"])
    # the command is for the probe; the nozzle is at its offset from it
    nozzle = np.column_stack([np.array(places) - [x, y], np.array(heights) + trigger])
    drops = -_robot(path, radius, towers).inverse(nozzle)
    readings = [{"z_mm": trigger, "stable": drop.tolist()} for drop in drops]
    saved = {"id": name, "source": str(path), "radius_mm": radius, "towers": towers, "calibrated": False}
    return saved | {"heights": readings, "probe_offset_mm": [x, y]}


def _towers(path, sizes, endstops):
    """Towers in the JSON form, and the radius."""
    for letter in set("LRH") - set(sizes):
        _refuse(path, f"M665 {letter}", "nothing", "rods L, radius R and homed height H in mm")
    rods = sizes["L"] if len(sizes["L"]) == 3 else sizes["L"][:1] * 3
    towers = {}
    for (tower, angle), axis, rod in zip(_ANGLES.items(), "XYZ", rods, strict=True):
        endstop = sizes["H"][0] + endstops.get(axis, [0.0])[0]
        numbers = {"angle_deg": angle + sizes.get(axis, [0.0])[0], "arm_mm": rod, "endstop_mm": endstop}
        towers[tower] = numbers | {"rotation_distance_mm": None, "microsteps": None, "full_steps": None, "step_mm": 1.0}
    return towers, sizes["R"][0]


def _robot(path, radius, towers):
    """The machine in the firmware's model."""
    angles, arms, endstops = (
        [tower[size] for tower in towers.values()] for size in ("angle_deg", "arm_mm", "endstop_mm")
    )
    try:
        return linear_delta(radius, np.radians(angles), arms, endstops, "heights")
    except ConfigError:
        _refuse(path, "M665", f"L {min(arms):g}", f"longer than R, {radius:g} mm")


def _refuse(path, column, value, allowed):
    """Raise IngestError for a command."""
    raise IngestError([{"file": str(path), "column": column, "value": value, "allowed": allowed}])


def _commands(text):
    """Letters and their numbers of the last M665, M666 and G31, and of every G30 by its P."""
    result = {"M665": {}, "M666": {}, "G31": {}, "G30": {}}
    for line in text.splitlines():
        words = line.split(";")[0].strip().upper()
        command = words.split(" ")[0]
        if command not in result:
            continue
        letters = {
            key: [float(one) for one in value.split(":")] for key, value in _LETTER.findall(words[len(command) :])
        }
        if command != "G30":
            result[command] |= letters
        elif {"P", "X", "Y"} <= set(letters):
            result["G30"][int(letters["P"][0])] = letters
    return result
