"""Keys of a campaign's section as options of the command `rrru`: remedies for a user who came by the command."""

import re
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

# options of their own; every other key is stated by --set
_OPTIONS = {"frame": "--frame", "noise_mm": "--noise", "noise_rad": "--noise-rad"}
_OF_ROBOT = {"tip": "--tip", "base": "--base", "platform": "--platform"}
_PLACES = {"tool_mm": "--tool", "up": "--up"}
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
# such a key in a message, with its value as YAML writes it in a line
_STATED = re.compile(rf"\b({'|'.join(_KEYS)}): (\{{[^{{}}]*\}}|\[[^\[\]]*\]|[\w.]+)")
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
    """Options for the keys that a message says to write, in their order.

    >>> options_in("far off; allowed: frame: register turns another frame in")
    ['--frame register']
    """
    found = (f"{key}={value}" for key, value in _STATED.findall(message))
    stated = dict.fromkeys(found)
    tools = (f"--tool {place.replace(' ', '')}" for place in _TOOL.findall(message))
    return [*(as_option(*one.split("=", 1)) for one in stated), *dict.fromkeys(tools)]


def as_command(section: Mapping[str, Any], entry: Mapping[str, Any]) -> str:
    """The command that diagnoses a campaign's section, "" where it has no options for the robot's entry."""
    file = entry.get("urdf") or entry.get("mjcf")
    robot = [f"--robot {shlex.quote(str(file or section['robot']))}"]
    if file:
        if set(entry) - {"urdf", "mjcf", *_PLACES, *_OF_ROBOT}:
            return ""
        robot += [f"{option} {shlex.quote(entry[key])}" for key, option in _OF_ROBOT.items() if key in entry]
        places = {option: entry[key] for key, option in _PLACES.items() if key in entry}
        robot += [f"{option} {','.join(f'{size:g}' for size in place)}" for option, place in places.items()]
    keys = [as_option(key, value) for key, value in section.items() if key not in ("robot", "ingest")]
    return " ".join(["rrru diagnose", shlex.quote(str(section["ingest"])), *robot, *keys])


def _in_a_line(value: Any) -> str:
    """A value as YAML in one line."""
    text = yaml.safe_dump(value, default_flow_style=True, sort_keys=False, allow_unicode=True, width=10**6)
    return str(text.removesuffix("\n").removesuffix("\n..."))
