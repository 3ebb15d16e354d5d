"""Keys of a campaign's section of the configuration, written as options of the command `rrru`.

Messages name keys of the configuration; users of the command get the options that set them.
"""

import re
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

# keys that have an option of their own; every other key is set by --set
_OPTIONS = {"frame": "--frame", "noise_mm": "--noise", "noise_rad": "--noise-rad"}
# keys of a `robots:` entry: names, and places of three numbers
_ROBOT_NAMES = {"tip": "--tip", "base": "--base", "platform": "--platform"}
_ROBOT_VECTORS = {"tool_mm": "--tool", "up": "--up"}
# keys that messages propose
_KEYS = (
    "frame",
    "unit",
    "angle_unit",
    "drive_unit",
    "signs",
    "order",
    "columns",
    "extra_columns",
    "time_format",
    "targets",
)
# one of _KEYS in a message, with its value as YAML writes it in a line; a word before a colon is no value
_STATED = re.compile(rf"\b({'|'.join(_KEYS)}): (\{{[^{{}}]*\}}|\[[^\[\]]*\]|[\w.]+\b(?!:))")
# the message on a tool that is elsewhere states its place, which is a key of the robot
_TOOL = re.compile(r"\ba tool at \(([^()]*)\) mm")


def as_option(key: str, value: Any) -> str:
    """A key of a campaign's section with its value as an option.

    >>> as_option("frame", "register")
    '--frame register'
    >>> as_option("signs", {"q4_rad": -1})
    "--set 'signs={q4_rad: -1}'"
    """
    if key == "commands" and isinstance(value, str | Path):
        return f"--commands {shlex.quote(str(value))}"
    text = value if isinstance(value, str) else _in_a_line(value)
    return f"{_OPTIONS[key]} {text}" if key in _OPTIONS else f"--set {shlex.quote(f'{key}={text}')}"


def options_in(message: str) -> list[str]:
    """Options for the keys that a message says to write, in their order; alternatives of a line in one text.

    >>> options_in("far off; allowed: frame: register turns another frame in")
    ['--frame register']
    >>> options_in("allowed: unit: m and drive_unit: mm or unit: inch, which leaves 0.2 mm")
    ['--set unit=m --set drive_unit=mm or --set unit=inch']
    """
    result: dict[str, None] = {}
    for line in message.splitlines():
        alternatives: list[str] = []
        end = 0
        for found in sorted((*_STATED.finditer(line), *_TOOL.finditer(line)), key=lambda one: one.start()):
            option = as_option(*found.groups()) if found.re is _STATED else f"--tool {found[1].replace(' ', '')}"
            if not alternatives or " or " in line[end : found.start()]:
                alternatives.append(option)
            elif option not in alternatives[-1]:
                alternatives[-1] += f" {option}"
            end = found.end()
        if alternatives:
            result[" or ".join(dict.fromkeys(alternatives))] = None
    return [*result]


def as_command(section: Mapping[str, Any], entry: Mapping[str, Any]) -> str:
    """The command that diagnoses a campaign's section, "" where it has no options for the robot's entry."""
    if {"dh", "module"} & set(entry):
        return ""
    file = entry.get("urdf") or entry.get("mjcf")
    robot = [f"--robot {shlex.quote(str(file or section['robot']))}"]
    if file:
        if set(entry) - {"urdf", "mjcf", *_ROBOT_VECTORS, *_ROBOT_NAMES}:
            return ""
        robot += [f"{option} {shlex.quote(entry[key])}" for key, option in _ROBOT_NAMES.items() if key in entry]
        vectors = {option: entry[key] for key, option in _ROBOT_VECTORS.items() if key in entry}
        robot += [f"{option} {','.join(f'{number:g}' for number in vector)}" for option, vector in vectors.items()]
    keys = [as_option(key, value) for key, value in section.items() if key not in ("robot", "ingest")]
    return " ".join(["rrru diagnose", shlex.quote(str(section["ingest"])), *robot, *keys])


def _in_a_line(value: Any) -> str:
    """A value as YAML in one line."""
    text = yaml.safe_dump(value, default_flow_style=True, sort_keys=False, allow_unicode=True, width=10**6)
    return str(text.removesuffix("\n").removesuffix("\n..."))
