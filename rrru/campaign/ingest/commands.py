"""Commanded positions that a file lacks: from a second file, or computed from drive values. Lengths in mm.

Point lists of trackers hold measured positions alone: their commands come from a second file. The rows of both files
are joined by the points' names where both have them, else by their order. Names that occur once in every trajectory, as
in the groups of a point list, are distinguished by the trajectory.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
import pandas as pd

from rrru.campaign.ingest.cells import Cell, Cells
from rrru.campaign.ingest.formats import read_cells
from rrru.campaign.ingest.guess import names_trajectories
from rrru.campaign.ingest.problems import Problems
from rrru.campaign.ingest.sheet import COMMAND, position_text, rows_text
from rrru.campaign.ingest.spec import IngestSpec
from rrru.campaign.measurements import vector_columns
from rrru.kinematics.robot import Robot

_ONE = "all"

# with more rows without a pose something is wrong with all of them
_MOST_LOST = 0.1
# names of the points of the measured file and of the commands
_Keys: TypeAlias = tuple[list[str], list[str]]

# the same end effector's position within rounding
_SAME_MM = 1e-6


def with_commands(spec: IngestSpec, measured: Cells, problems: Problems) -> Cells:
    """The Cells of a file with the columns of `spec.commands` in addition to its own.

    A file without names of trajectories is one trajectory. Raises IngestError where the files do not belong
    together.
    """
    if spec.commands is not None:
        problems_of_commands = Problems(spec.commands)
        commanded = read_cells(Path(spec.commands), spec.commands_format, problems_of_commands)
        problems_of_commands.refuse()
        measured = _joined(spec, spec.commands, measured, commanded, problems)
    name = spec.columns.get("trajectory", measured.means.get("trajectory", "trajectory"))
    absent = name not in measured.names and "trajectory" not in spec.columns
    if absent and (measured.means or not names_trajectories(measured.names)):
        notes = (*measured.notes, f"no column trajectory: all points count as one, {_ONE}")
        cells = {**measured.cells, "trajectory": [_ONE] * len(measured.rows)}
        names = [*measured.names, "trajectory"]
        return replace(measured, names=names, cells=cells, added=("trajectory",), notes=notes)
    return measured


def _joined(spec: IngestSpec, file: str, measured: Cells, commanded: Cells, problems: Problems) -> Cells:
    """Cells of both, a row per measured one, with the commands of a file.

    The commands' names of trajectories count before those of a list.
    """
    keys, added = _keys(spec, measured, commanded)
    for name in added:
        if name in measured.names:
            value = f"a column of this name here and in {file}"
            problems.add("repeated column", column=name, value=value, allowed="each name in one of the files")
    problems.refuse()
    at, note = _places(file, keys, measured, commanded, problems)
    problems.refuse()
    rows = {row: commanded.rows[i] for row, i in zip(measured.rows, at, strict=True)}
    problems.elsewhere(file, added, rows)
    group = measured.means.get("trajectory") if _column(spec, commanded, "trajectory") else None
    means = {ours: theirs for ours, theirs in measured.means.items() if theirs != group}
    return replace(
        measured,
        names=[*measured.names, *added],
        cells={**measured.cells, **{name: [commanded.cells[name][i] for i in at] for name in added}},
        means={**commanded.means, **means},
        factors={**commanded.factors, **measured.factors},
        spreads={**commanded.spreads, **measured.spreads},
        commas=measured.commas | commanded.commas,
        unused=(*measured.unused, *commanded.unused, *((group,) if group else ())),
        notes=(*measured.notes, *commanded.notes, note),
    )


def _column(spec: IngestSpec, cells: Cells, ours: str) -> str | None:
    """The file's name of a column of ours, None where it has none."""
    declared = (name for name in (spec.columns.get(ours), ours) if name in cells.cells)
    return next(declared, cells.means.get(ours))


def _keys(spec: IngestSpec, measured: Cells, commanded: Cells) -> tuple[_Keys | None, list[str]]:
    """Names of the points of both files, None where one has none, and the commands' columns that are added."""
    files = (measured, commanded)
    column, of_commands = (_column(spec, cells, "name") for cells in files)
    added = [name for name in commanded.names if name != of_commands]
    if column is None or of_commands is None:
        return None, added
    names, known = _texts(measured.cells[column]), _texts(commanded.cells[of_commands])
    path, path_of_commands = (_column(spec, cells, "trajectory") for cells in files)
    if len(set(known)) < len(known) and path is not None and path_of_commands is not None:
        names = _below(measured.cells[path], names)
        known = _below(commanded.cells[path_of_commands], known)
    return (names, known), added


def _texts(cells: Sequence[Cell]) -> list[str]:
    """Cells as names."""
    return [str(cell).strip() for cell in cells]


def _below(paths: Sequence[Cell], names: list[str]) -> list[str]:
    """Names of points behind those of their trajectories."""
    return [f"{path} {name}" for path, name in zip(_texts(paths), names, strict=True)]


def _places(
    file: str, keys: _Keys | None, measured: Cells, commanded: Cells, problems: Problems
) -> tuple[Sequence[int], str]:
    """Place of each measured row's command among the commanded ones, and what was done to find it."""
    rows = len(measured.rows)
    if keys is None:
        if rows != len(commanded.rows):
            value = f"{rows} measured rows and {len(commanded.rows)} commands in {file}, joined by their order"
            problems.refuse_now(value=value, allowed="as many rows in both, or a column `name` of the points in both")
        return range(rows), f"commands of {file} joined by their order: no names of points in both files"
    names, known = keys
    if names == known:
        return range(rows), f"commands of {file} joined by name and order"
    for name in (name for name, count in Counter(known).items() if count > 1):
        value, allowed = f"the point {name!r} twice in {file}", "each name once, or the same names in the same order"
        problems.add("commands", column="name", value=value, allowed=allowed)
    place = {name: i for i, name in enumerate(known)}
    for row, name in zip(measured.rows, names, strict=True):
        if name not in place:
            allowed = f"a point of {file}: {', '.join(known[:5])}, ..."
            problems.add("commands", row=row, column="name", value=repr(name), allowed=allowed)
    left = len(set(known) - set(names))
    more = f"; {left} of its points were not measured" if left else ""
    return [place.get(name, 0) for name in names], f"commands of {file} joined by the points' names{more}"


def with_sent(frame: pd.DataFrame, mechanism: Robot, problems: Problems) -> tuple[pd.DataFrame, list[str]]:
    """The frame with the nominal robot's positions at its drive values as commanded ones, and notes on them.

    frame: columns of the file under our names, in mm and rad. A few rows at whose values the nominal robot has no pose
    are left out; more are noted in problems. Raises IngestError where a row does not name the end effector that was
    measured, for a robot with several.
    """
    drives = [*mechanism.parts.columns]
    check_end_effectors(frame, mechanism, problems)
    problems.refuse()
    values = frame[drives].to_numpy(dtype=float)
    position = mechanism.forward(values, guess_mm=mechanism.guess(values, frame.get("target")))
    notes = [f"no commanded positions: computed from {drives[0]} to {drives[-1]} ({mechanism.name}, nominal)"]
    frame = frame.assign(**vector_columns("command", position))
    # blank drive values are a problem of their own
    lost = np.isnan(position).any(axis=1) & np.isfinite(values).all(axis=1)
    if lost.mean() > _MOST_LOST:
        for i in np.flatnonzero(lost):
            value = ", ".join(f"{one:.6g}" for one in values[i])
            allowed = "values at which the nominal robot closes near its home pose, or commanded positions besides them"
            problems.add("no pose", row=frame.index[i], column=", ".join(drives), value=value, allowed=allowed)
    elif lost.any():
        why = "the nominal robot has no pose near its home pose at their drive values"
        notes.append(f"left out, since {why}: {lost.sum()} of {len(frame)} rows, {rows_text(frame.index[lost])}")
        frame = frame[~lost]
    return frame, notes


def check_end_effectors(frame: pd.DataFrame, mechanism: Robot, problems: Problems) -> None:
    """Refuse rows that do not name a target on one of the end effectors, for a robot with several.

    A pose belongs to the end effector nearest to the commanded position, so that this has to be the named one's.
    """
    carried = [target for targets in mechanism.legs.end_effectors for target in targets]
    if not carried:
        return
    if "target" not in frame:
        problems.add("missing column", column="target", value="no such column", allowed=", ".join(carried))
    if "target" in frame:
        for i in np.flatnonzero(~frame["target"].isin(carried)):
            value, allowed = frame["target"].iloc[i], f"a target on an end effector: {', '.join(carried)}"
            problems.add("reflectors", row=frame.index[i], column="target", value=value, allowed=allowed)
    drives = [*mechanism.parts.columns]
    if not set(drives) <= set(frame):
        allowed = "a column for each drive: commanded positions do not determine those of several end effectors"
        problems.add("missing column", column=", ".join(drives), value="no such columns", allowed=allowed)
    problems.refuse()
    if set(COMMAND) <= set(frame):
        values, command = frame[drives].to_numpy(dtype=float), frame[[*COMMAND]].to_numpy(dtype=float)
        stated, nearest = mechanism.guess(values, frame["target"]), mechanism.forward(values, guess_mm=command)
        for i in np.flatnonzero(np.linalg.norm(stated - nearest, axis=1) > _SAME_MM):
            target = frame["target"].iloc[i]
            value = f"{position_text(command[i])}, nearest to another end effector than that of {target}"
            allowed = f"its tool's position, {position_text(stated[i])}; or no commanded columns, these are computed"
            problems.add("end effector", row=frame.index[i], column=", ".join(COMMAND), value=value, allowed=allowed)
    problems.refuse()
