"""Check of a file of measurements: its contents, used columns, missing data and their effects, and an overlay to paste.

The command `rrru check` prints it.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from rrru.campaign import measurements as rows
from rrru.campaign.ingest.cells import Cells
from rrru.campaign.ingest.columns import REQUIRED, distances_alone, resolve
from rrru.campaign.ingest.guess import axis_triples
from rrru.campaign.ingest.problems import Problems
from rrru.campaign.ingest.sheet import COMMAND, MEASURED, position_text
from rrru.campaign.ingest.spec import IngestSpec
from rrru.campaign.stated_motion import STOP_AND_GO
from rrru.errors import ConfigError, IngestError, Problem
from rrru.kinematics.robot import Robot
from rrru.pipeline.config import own_robot
from rrru.pipeline.data_check.costs import costs, enough_poses, without_times
from rrru.pipeline.data_check.propose import STEPS, fitting_robots, propose
from rrru.pipeline.option_text import as_command, options_in
from rrru.pipeline.progress import Progress, shown

_LAST_STEP = "what it determines"
_SHOWN = 8
# longest line of the overlay
_WIDE = 110
_UNFINISHED = (
    "NOT ACCEPTED YET: a run refuses the file for the problems above. Correct these first; so far the overlay is:"
)
# values that only the user knows, with an example
_UNREADABLE = {
    "noise_mm": "0.02  # of the instrument, 1 sigma per axis; without it, it is read from the file or estimated",
    "noise_rad": "1.0e-4  # of measured orientations, 1 sigma per axis, in rad; without it, it is estimated",
    "platform_mass_kg": "3.0  # mass of platform or tool, without payload_kg",
}
# motion of a robot that stops, which only the user knows
_BETWEEN = (
    "motion: {kind: stop_and_go, between: drives}  # it moves from stop to stop joint by joint (PTP); "
    "tool: in straight lines (LIN)"
)
_WHAT_MOTION_MEANS = (
    "stop_and_go alone: the side from which a drive came to a stop is known only where PTP and LIN give the same one;",
    "  backlash and friction_windup, which need that side, are not tested where it is known at too few points",
    "how to decide: look at the robot's program; moves between the points by PTP or MoveJ: between: drives;",
    "  by LIN or MoveL: between: tool; by both or unknown: leave it out; measured without a stop: motion: continuous",
    "as an option: --set 'motion={kind: stop_and_go, between: drives}'",
    "read_before_rest needs a robot that stops, servo_lag is zero where it does",
)
_OPTIONAL = ("time_s", "speed_mm_s", "payload_kg")


@dataclass(frozen=True)
class Check:
    """The result for a file.

    section: the proposed section of the campaign; lines: the report; refused: the remaining problems, empty where
    ingest accepts the file; turned: whether it has measured orientations.
    """

    section: dict[str, Any]
    lines: tuple[str, ...]
    refused: tuple[Problem, ...] = ()
    turned: bool = False

    @property
    def overlay(self) -> dict[str, Any]:
        """The overlay to paste."""
        return {"campaigns": {self.name: self.section}}

    @property
    def name(self) -> str:
        """A name for the campaign."""
        return "".join(sign if sign.isalnum() or sign in "_-" else "_" for sign in Path(self.section["ingest"]).stem)


def check_file(
    file: str | Path,
    config: Mapping[str, Any],
    robot: str | None = None,
    commands: str | Path | None = None,
    progress: bool | Progress = False,
) -> Check:
    """The Check of a file for a robot of the configuration.

    A campaign of the configuration with this file is used unchanged, with proposals for its missing keys. progress:
    True for a bar, or a function of each step, its number and the number of steps. Raises IngestError for a file that
    cannot be read and ConfigError for an unknown robot.
    """
    with shown(progress, (*STEPS, _LAST_STEP)) as begin:
        return _check(file, config, robot, commands, begin or (lambda step: None))


def _check(
    file: str | Path,
    config: Mapping[str, Any],
    robot: str | None,
    commands: str | Path | None,
    begin: Callable[[str], object],
) -> Check:
    """The Check of a file, see `check_file`; begin: called with each step as it begins."""
    section: dict[str, Any] = next((one for one in config["campaigns"].values() if one.get("ingest") == str(file)), {})
    arguments = {key: value for key, value in (("robot", robot), ("commands", commands)) if value}
    given = {"robot": None, "ingest": str(file)} | section | arguments
    if given["robot"] not in config["robots"]:
        named = f"robot is {given['robot']!r}" if given["robot"] else "say which robot: --robot .."
        known = f"allowed: {', '.join(config['robots'])}, or a URDF or MJCF file, or one of a --config file"
        fitting = fitting_robots(given, config)
        raise ConfigError(f"{named}; {known}" + (f"; this file fits {' and '.join(fitting)}" if fitting else ""))
    found = propose(given, config, begin)
    begin(_LAST_STEP)
    section, cells, mechanism, result = found.section, found.cells, found.mechanism, found.result
    lines = [_content(section, cells), *_used(section, cells, mechanism)]
    if result is None:
        if lines[-1].startswith("missing:") and "time_s" in lines[-1]:
            lines += [f"cost: {one}" for one in without_times(config, mechanism)]
        lines.append(f"cost: {enough_poses(mechanism)}")
        fitting = fitting_robots(given, config)
        if fitting and given["robot"] not in fitting:
            lines.append(f"wrong robot? {given['robot']} does not fit this file, {' and '.join(fitting)} would")
    else:
        lines += [f"note: {_proposed(note) if 'motion' not in given else note}" for note in result.notes]
        lines += [f"cost: {one}" for one in costs(result.measurements, config, section)]
    turned = result is not None and rows.has_turns(result.measurements)
    return Check(section, tuple(lines), found.refused, turned)


def _proposed(note: str) -> str:
    """A note that says of a proposed `motion` that it is proposed, not stated."""
    why = "proposed, since several reflectors are read at a stop or the points follow no path; see that it is right"
    return note.replace(", as stated", f": {why}") if note.startswith("motion: ") else note


def _content(section: Mapping[str, Any], cells: Cells) -> str:
    """The file, its size and its format."""
    kind = section.get("format") or "as its ending says"
    more = f", commands from {section['commands']}" if "commands" in section else ""
    columns = len(cells.names) - len(_added(cells))
    return f"{section['ingest']}: {len(cells.rows)} rows, {columns} columns, format {kind}{more}"


def _added(cells: Cells) -> set[str]:
    """Columns of the cells that the file itself does not have."""
    return {"trajectory"} if any(note.startswith("no column trajectory") for note in cells.notes) else set()


def _used(section: Mapping[str, Any], cells: Cells, mechanism: Robot) -> Iterator[str]:
    """The used, unused and missing columns."""
    spec = replace(IngestSpec.from_config(section), extra_columns="ignore")
    found, extra = resolve(spec, cells, mechanism, Problems(spec.path))
    same = [ours for ours, theirs in found.items() if ours == theirs and ours not in _added(cells)]
    if same:
        yield f"used: {', '.join(same)}"
    yield from (f"used: {theirs!r} as {ours}" for ours, theirs in found.items() if ours != theirs)
    left = [*cells.unused, *extra]
    if left:
        yield f"left out: {', '.join(left)}"
    drives = set(mechanism.parts.columns) <= set(found)
    missing = [ours for ours in REQUIRED if ours not in found and not (drives and ours.startswith("command"))]
    if missing:
        yield f"missing, and needed: {', '.join(missing)}"
    if set(MEASURED) <= set(missing) and not distances_alone(found, left):
        for axes in axis_triples(left):
            pairs = ", ".join(f"measured_{axis}_mm: '{axes[axis]}'" for axis in "xyz")
            yield f'measured? if {axes["x"]!r} .. are the measured positions: --set "columns={{{pairs}}}"'
    if any(name.startswith("command") for name in missing):
        other = f"the drives' values ({', '.join(mechanism.parts.columns)})"
        yield f"no column has the commanded positions: give a second file with --commands, or {other}"
    yield from _meant(found, mechanism)
    optional = [ours for ours in _OPTIONAL if ours not in found]
    if optional:
        yield f"missing: {', '.join(optional)}"


def _meant(found: Mapping[str, str], mechanism: Robot) -> Iterator[str]:
    """Reference points of commanded positions and payloads."""
    tool = f"the tool, {position_text(mechanism.tool_mm)} on the platform"
    others = ", whatever target a row is of" if "target" in found else ""
    commands = "commanded positions" if set(COMMAND) <= set(found) else "command_*_mm, computed from the drive values,"
    yield f"meant: {commands} are of {tool}{others}"
    yield f"meant: payload_kg{'' if 'payload_kg' in found else ', where you add it,'} hangs at {tool}"


def print_check(
    file: str | Path,
    config: Mapping[str, Any],
    robot: str | None = None,
    commands: str | Path | None = None,
    overlays: Sequence[str | Path] = (),
    progress: bool | Progress = False,
) -> bool:
    """Print the check of a file; returns whether ingest accepts it. Arguments and errors as for `check_file`.

    overlays: files of the configuration, for the command that is proposed.
    """
    found = check_file(file, config, robot, commands, progress)
    print("\n".join(found.lines))
    for problem in found.refused[:_SHOWN]:
        print(f"refused: {IngestError([problem])}")
    if len(found.refused) > _SHOWN:
        # of each kind only the first ones are known here
        print("refused: and more, which a run lists")
    print(f"\n{_UNFINISHED if found.refused else 'overlay to paste:'}\n")
    name = found.section["robot"]
    own = {name: config["robots"][name]} if own_robot(config["robots"][name]) and not overlays else {}
    print(_pasted(found, own))
    if not found.refused:
        # no file of the configuration, which it would replace
        stated = [str(overlay) for overlay in overlays]
        new = next(name for name in ("mine.yaml", f"{found.name}.yaml", "proposed.yaml") if name not in stated)
        files = " ".join([*stated, new])
        print(f"# saved as {new}: rrru diagnose {found.name} --config {files}")
        if not overlays and (command := as_command(found.section, config["robots"][name])):
            print(f"# or without a file: {command}")
    elif not overlays and (options := options_in("\n".join(str(IngestError([one])) for one in found.refused))):
        print(f"# keys that the problems name, as options of the command: {' '.join(options)}")
    return not found.refused


def _pasted(found: Check, robots: Mapping[str, Any]) -> str:
    """The overlay as text, with the values that no file has as comments; robots: entries that it needs as well."""
    lines = yaml.safe_dump({"robots": robots}, sort_keys=False).splitlines() if robots else []
    lines += ["campaigns:", f"  {yaml.safe_dump(found.name).splitlines()[0]}:"]
    for key, value in found.section.items():
        short, long = (
            yaml.safe_dump({key: value}, sort_keys=False, allow_unicode=True, default_flow_style=flow, width=1000)
            for flow in (None if isinstance(value, dict | list) else False, False)
        )
        lines += [f"    {line}" for line in (short if len(short) < _WIDE else long).splitlines()]
    open_keys = [key for key in _UNREADABLE if key not in found.section and (key != "noise_rad" or found.turned)]
    lines += [f"    # {key}: {_UNREADABLE[key]}" for key in open_keys]
    if found.section.get("motion") == STOP_AND_GO:
        lines += [f"    # {_BETWEEN}", *(f"    # {line}" for line in _WHAT_MOTION_MEANS)]
    return "\n".join(lines)
