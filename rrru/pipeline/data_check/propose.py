"""Missing keys of a campaign's section, found by trial, for the user to accept."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.campaign.driven_path import passes_points, stops
from rrru.campaign.ingest.campaign_file import Ingested, ingest
from rrru.campaign.ingest.cells import Cells
from rrru.campaign.ingest.columns import convert, known_columns, resolve
from rrru.campaign.ingest.commands import with_commands
from rrru.campaign.ingest.formats import read_cells
from rrru.campaign.ingest.geometry import frame_limit
from rrru.campaign.ingest.guess import guess_clock, guess_columns, guess_format, guess_units
from rrru.campaign.ingest.problems import Problems
from rrru.campaign.ingest.sheet import COMMAND
from rrru.campaign.ingest.spec import MM, RAD, IngestSpec
from rrru.campaign.stated_motion import STOP_AND_GO
from rrru.errors import GrossFileError, IngestError, MistakeError, Problem, RrruError
from rrru.kinematics.robot import Robot
from rrru.pipeline import config as parts
from rrru.pipeline import setup

STEPS = ("columns", "units and frame", "motion")
# number of points for the test whether a file is of a robot
_PROBES = 20
# least share of them that a robot has to reach
_MIN_REACHED = 0.9


# a campaign's section, to which keys are added
Section: TypeAlias = dict[str, Any]


@dataclass(frozen=True)
class Proposal:
    """A proposal for a campaign's section.

    section: with the found keys; cells: of the file; mechanism: the robot; result: of ingest, None where it is refused;
    refused: its problems.
    """

    section: Section
    cells: Cells
    mechanism: Robot
    result: Ingested | None
    refused: tuple[Problem, ...]


def propose(
    section: Section, config: Mapping[str, Any], begin: Callable[[str], object] = lambda step: None
) -> Proposal:
    """The Proposal for a section that names file and robot; raises IngestError for a file that cannot be read.

    begin: called with each of `STEPS` as it begins.
    """
    columns, fit, motion = STEPS
    begin(columns)
    mechanism = setup.mechanism(parts.robot(config, section))
    found = _as_stated(section, mechanism) if "columns" in section else None
    if found is None:
        cells, section = _with_columns(_with_formats(section), mechanism)
        begin(fit)
        found = _fitting(section, cells, mechanism)
    begin(motion)
    return _with_motion(found)


def _as_stated(section: Section, mechanism: Robot) -> Proposal | None:
    """The Proposal of a section that states its columns and is accepted as it is, None for any other."""
    try:
        spec = IngestSpec.from_config(section)
        cells = with_commands(spec, read_cells(Path(spec.path), spec.format, Problems(spec.path)), Problems(spec.path))
        return Proposal(section, cells, mechanism, ingest(spec, mechanism), ())
    except RrruError:
        return None


def _with_motion(found: Proposal) -> Proposal:
    """The Proposal with a `motion` where none is stated: stop and go where several targets were read at a stop, or the
    points follow no path.
    """
    if found.result is None or "motion" in found.section:
        return found
    table = found.result.measurements
    if not (np.bincount(stops(table)) > 1).any() and passes_points(table):
        return found
    section = found.section | {"motion": STOP_AND_GO}
    return replace(found, section=section, result=ingest(IngestSpec.from_config(section), found.mechanism))


def fitting_robots(section: Section, config: Mapping[str, Any]) -> list[str]:
    """Names of the configuration's robots that fit the file of a section; the named one alone if it fits.

    A robot fits if its actuator positions give the commanded positions, or if it reaches these where the file has no
    actuator positions.
    """
    section = _with_formats(section)
    machines = {name: setup.mechanism(parts.robot(config, {"robot": name})) for name in config["robots"]}
    drives = {column for machine in machines.values() for column in machine.parts.columns}
    named = machines.get(section["robot"])
    if named is not None and _belongs(section, named, drives):
        return [section["robot"]]
    return [name for name, machine in machines.items() if _belongs(section, machine, drives)]


def _with_formats(section: Section) -> Section:
    """The section with the formats of the measured file and that of the commands, where they need one."""
    for key, name in (("format", "ingest"), ("commands", "commands")):
        section = _with_format(section, key, name)
    return section


def _with_format(section: Section, key: str, name: str) -> Section:
    """The section with the format of the measured file, or that of the commands, if it needs one."""
    given = section.get(name)
    if given is None or (key in section and key == "format") or isinstance(given, dict):
        return section
    path = Path(given)
    try:
        found = guess_format(path, Problems(path))
    except OSError:
        return section
    if found is None:
        return section
    return section | ({"format": found} if key == "format" else {"commands": {"file": given, "format": found}})


def _with_columns(section: Section, mechanism: Robot) -> tuple[Cells, Section]:
    """Cells of the file, and the section with the guessed columns."""
    spec = IngestSpec.from_config(section)
    problems = Problems(spec.path)
    cells = read_cells(Path(spec.path), spec.format, problems)
    files = [cells]
    if spec.commands:
        files.append(read_cells(Path(spec.commands), spec.commands_format, Problems(spec.commands)))
    columns = dict(section.get("columns", {}))
    for one in files:
        columns |= guess_columns(one, mechanism, columns)
    section = section | ({"columns": columns} if columns else {})
    clock = columns.get("time_s", cells.means.get("time_s", "time_s"))
    pattern = next(filter(None, (guess_clock(one, clock) for one in files)), None)
    if pattern and "time_format" not in section:
        section = section | {"time_format": pattern}
    spec = IngestSpec.from_config(section)
    cells = with_commands(spec, cells, Problems(spec.path))
    _, extra = resolve(replace(spec, extra_columns="ignore"), cells, mechanism, Problems(spec.path))
    return cells, section | ({"extra_columns": "ignore"} if extra else {})


def _found(section: Section, cells: Cells, mechanism: Robot) -> tuple[dict[str, str], IngestSpec]:
    """{our name: the file's} of the columns of a section's file, and the section's IngestSpec."""
    spec = replace(IngestSpec.from_config(section), extra_columns="ignore")
    return resolve(spec, cells, mechanism, Problems(spec.path))[0], spec


def _fitting(section: Section, cells: Cells, mechanism: Robot) -> Proposal:
    """The Proposal with the first units and frame for which ingest accepts the file.

    Stated units and frame stay; those in the file's header are tried first. Where none fits, the section has those of
    the first attempt with the fewest problems of whole columns; a unit does not affect problems of single rows, or a
    mistake of another kind.
    """
    choices = {"frame": ("robot", "register"), "unit": tuple(MM), "angle_unit": tuple(RAD)}
    usual = {key: values[0] for key, values in choices.items()}
    guessed = guess_units(cells, _found(section, cells, mechanism)[0], mechanism)
    choices |= {key: tuple(dict.fromkeys((unit, *choices[key]))) for key, unit in guessed.items()}
    open_choices = [((section[key],) if key in section else values) for key, values in choices.items()]
    attempts: list[Proposal] = []
    # units in which a file is refused whatever its frame is
    refused = set()
    for frame, *units in product(*open_choices):
        if tuple(units) in refused:
            continue
        values = frame, *units
        chosen = dict(zip(choices, values, strict=True))
        stated = section | {key: value for key, value in chosen.items() if key in section or value != usual[key]}
        try:
            return Proposal(stated, cells, mechanism, ingest(IngestSpec.from_config(stated), mechanism), ())
        except IngestError as error:
            attempts.append(Proposal(stated, cells, mechanism, None, error.problems))
            if isinstance(error, GrossFileError):
                refused.add(tuple(units))
            if isinstance(error, MistakeError) or all(problem["row"] is not None for problem in error.problems):
                break
    return min(attempts, key=lambda attempt: _of_all_rows(attempt.refused))


def _of_all_rows(problems: Iterable[Problem]) -> int:
    """Number of problems of whole columns: another unit or frame, not single cells."""
    return sum(problem["row"] is None and problem["column"] is not None for problem in problems)


def _belongs(section: Section, mechanism: Robot, drives: set[str]) -> bool:
    """Whether a file may be of a robot, from some of its rows; drives: names of the columns of all robots."""
    try:
        cells, section = _with_columns(_of_robot(section, mechanism), mechanism)
        found, spec = _found(section, cells, mechanism)
        every = max(len(cells.rows) // _PROBES, 1)
        few = replace(
            cells, rows=cells.rows[::every], cells={name: values[::every] for name, values in cells.cells.items()}
        )
        frame = convert(spec, mechanism, found, few, Problems(spec.path))
    except RrruError:
        return False
    if not set(COMMAND) <= set(frame):
        return set(mechanism.parts.columns) <= set(frame)
    stated = section.get("unit"), section.get("angle_unit")
    units = [MM[unit] / MM[spec.unit] for unit in ((stated[0],) if stated[0] else MM)]
    angles = [RAD[unit] / RAD[spec.angle_unit] for unit in ((stated[1],) if stated[1] else RAD)]
    if set(mechanism.parts.columns) <= set(frame):
        return any(_driven_there(frame, mechanism, unit, angle) for unit, angle in product(units, angles))
    if mechanism.orients or drives & set(cells.names):
        return False
    reached = (np.isfinite(mechanism.inverse(unit * rows.command(frame))).all(axis=1).mean() for unit in units)
    return any(share > _MIN_REACHED for share in reached)


def _driven_there(frame: pd.DataFrame, mechanism: Robot, unit: float, angle: float) -> bool:
    """Whether actuator positions give the commanded positions, angles and lengths times factors."""
    factors = [angle if one == "rad" else unit for one in mechanism.parts.units]
    command = unit * rows.command(frame)
    driven = mechanism.forward(frame[[*mechanism.parts.columns]].to_numpy() * factors, guess_mm=command)
    return bool((np.linalg.norm(driven - command, axis=1) <= frame_limit(mechanism)).mean() > 0.5)


def _of_robot(section: Section, mechanism: Robot) -> Section:
    """The section with only those columns that a robot may have."""
    if "columns" not in section:
        return section
    known = known_columns(mechanism)
    return section | {"columns": {ours: theirs for ours, theirs in section["columns"].items() if ours in known}}
