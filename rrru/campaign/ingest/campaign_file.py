"""Ingest of a measured campaign: an instrument's CSV or parquet file becomes a measurement table or is refused."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from rrru.campaign.ingest.checks import check_runs, check_speed, number_runs, resolution, stale
from rrru.campaign.ingest.columns import REQUIRED, convert, known_columns, resolve
from rrru.campaign.ingest.commands import check_end_effectors, with_commands, with_sent
from rrru.campaign.ingest.contradictions import find_contradiction
from rrru.campaign.ingest.formats import read_cells
from rrru.campaign.ingest.geometry import (
    beyond_ranges,
    check_commands,
    check_measured,
    check_sizes,
    frame_limit,
    plausibility_notes,
)
from rrru.campaign.ingest.gross_errors import GrossError, find_gross_error, frame_advice
from rrru.campaign.ingest.gross_file import ORDINARY_SHARE, GrossFile
from rrru.campaign.ingest.guess import guess_columns, guess_units
from rrru.campaign.ingest.outliers import jumps, outliers, turned_outliers
from rrru.campaign.ingest.problems import Problems
from rrru.campaign.ingest.registration import Registration, register
from rrru.campaign.ingest.sheet import COMMAND, MEASURED, NOISE, TARGET, TURNS, Sheet, rows_text
from rrru.campaign.ingest.spec import MM, IngestSpec
from rrru.campaign.ingest.target_placement import TargetPlacement, check_turned, places_instead, target_placement
from rrru.campaign.measurements import command, measured, turn_columns, turns, vector_columns
from rrru.errors import ConfigError, FitError, GrossFileError, MistakeError
from rrru.kinematics.readings import Readings
from rrru.kinematics.robot import Robot

# names of columns of drive values, which end in an angle's unit
_OF_DRIVES = re.compile(r"(_|\b)(rad|deg|degrees?)\W*$", re.IGNORECASE)


@dataclass(frozen=True)
class Ingested:
    """Measurement table, what was computed or found missing on the way, the registration where one was asked for."""

    measurements: pd.DataFrame
    notes: tuple[str, ...]
    registration: Registration | None


def ingest(spec: IngestSpec, mechanism: Robot) -> Ingested:
    """Measurement table of a file, for the robot that it was measured on.

    Positions are brought to mm and the robot frame, angles to rad; drive angles that the file lacks are those of the
    commanded positions; points that a broken beam spoilt get the status "outlier", stale readings "stale", and stay.
    Raises IngestError with every problem that the file has.
    """
    sheet, notes = _read(spec, mechanism)
    digit_mm = MM[spec.unit] * resolution(measured(sheet.frame) / MM[spec.unit])
    repeated = stale(sheet, digit_mm)
    check_runs(sheet, repeated)
    if not check_commands(sheet):
        sheet.problems.refuse()
    check_speed(sheet)
    mounted = target_placement(sheet) if not sheet.problems else None
    # where reflectors sit is looked at in a file without problems only: without their offsets nothing can be compared
    placed = mounted is not None or "target" not in sheet.frame
    same = placed and check_sizes(sheet, mounted.offset_mm if mounted else 0.0)
    if same and spec.frame == "robot":
        check_measured(_at_tool(sheet, mounted), lambda: frame_advice(_gross_file(sheet)))
        check_turned(sheet)
    sheet.problems.refuse()
    registration = _register_sheet(sheet, mounted, digit_mm) if spec.frame == "register" else None
    if registration:
        moved = vector_columns("measured", registration.apply(measured(sheet.frame)))
        sheet = replace(sheet, frame=sheet.frame.assign(**moved))
        check_measured(_at_tool(sheet, mounted), lambda: "rows that belong to each other")
        sheet.problems.refuse()
        zeros = " and with the zeros of the drives that were found" if mounted and mounted.zeros_lost else ""
        left = f"{registration.rms_mm:.4g} mm rms, {registration.max_mm:.4g} mm at most"
        notes += [
            f"measured positions registered to the commanded ones at {registration.points} points: distance in space "
            f"after registration{zeros} {left}, errors of the robot's geometry included, which the calibration "
            "fits with the remaining rigid motion"
        ]
    if not (mounted and mounted.zeros_lost):
        notes += _large_error_notes(sheet)
    table, more = _table(sheet, mounted, registration, digit_mm)
    if len(repeated):
        table.loc[sheet.frame.index.isin(repeated.index), "status"] = "stale"
        which = f"equal to an earlier one in every digit, left out: {rows_text(repeated.index)}"
        more = [*more, f"{len(repeated)} stale readings, {which}"]
    return Ingested(table, (*notes, *more, *(mounted.notes if mounted else ())), registration)


def _read(spec: IngestSpec, mechanism: Robot) -> tuple[Sheet, list[str]]:
    """The file as a sheet with numbered runs and points, and what the user should know about its columns."""
    known = known_columns(mechanism)
    for key in spec.columns:
        if key not in known:
            raise ConfigError(f"ingest of {spec.path}: columns has the key {key!r}; allowed: {', '.join(known)}")
    problems = Problems(spec.path)
    cells = with_commands(spec, read_cells(Path(spec.path), spec.format, problems), problems)
    guessed = guess_columns(cells, mechanism, spec.columns)
    angle_unit = guess_units(cells, guessed, mechanism).get("angle_unit")
    found, extra = resolve(spec, cells, mechanism, problems, guessed, angle_unit)
    notes = list(cells.notes)
    if extra:
        notes.append(f"undeclared columns left out: {', '.join(extra)}")
    drives = [*mechanism.parts.columns]
    if not set(drives) & set(found) and (others := [name for name in extra if _OF_DRIVES.search(name)]):
        own = " to ".join(dict.fromkeys((drives[0], drives[-1])))
        notes.append(
            f"{', '.join(others)} may be drive values of another robot, those of {mechanism.name} are {own}: see that "
            "`robot` is right"
        )
    spec.check_drives(drives)
    frame = spec.as_meant(convert(spec, mechanism, found, cells, problems), drives)
    if spec.targets and "target" not in frame:
        frame, said = _one_target(frame, spec, problems)
        notes += said
    if not set(REQUIRED) - set(COMMAND) <= set(frame) or len(set(cells.names)) < len(cells.names):
        problems.refuse()
    if not problems:
        sheet = Sheet(spec, mechanism, problems, found, frame)
        notes += _refuse_gross_error(sheet, any(found[name] in cells.factors for name in MEASURED))
    if not set(COMMAND) <= set(frame):
        problems.refuse()
        frame, said = with_sent(frame, mechanism, problems)
        notes += said
    else:
        check_end_effectors(frame, mechanism, problems)
    frame, more = number_runs(frame, spec.motion is not None and spec.motion.stops)
    sheet = Sheet(spec, mechanism, problems, found, frame)
    return sheet, notes + more + _notes_on_columns(sheet)


def _one_target(frame: pd.DataFrame, spec: IngestSpec, problems: Problems) -> tuple[pd.DataFrame, list[str]]:
    """The frame with the only stated target in every row, and a note; with several the file has to name each row's."""
    if len(spec.targets) == 1:
        (name,) = spec.targets
        return frame.assign(target=name), [f"no column target: every reading is of {name}"]
    allowed = f"a column with each row's one of {', '.join(spec.targets)}"
    problems.add("missing column", column="target", value="no such column", allowed=allowed)
    return frame, []


def _refuse_gross_error(sheet: Sheet, unit_stated: bool) -> list[str]:
    """Raise IngestError where a mistake in the file explains its distance from the robot, or it is of another robot.

    unit_stated: whether the file's header states the unit of what was measured. Returns a note where commanded
    positions and drive values do not agree, whatever is changed.
    """
    robot, driven = sheet.mechanism, set(sheet.drives) <= set(sheet.frame)
    contradiction = find_contradiction(sheet.frame, sheet.spec, robot, sheet.found)
    agree = driven and set(COMMAND) <= set(sheet.frame) and contradiction is None
    gross = find_gross_error(sheet.frame, sheet.spec, robot, sheet.found, unit_stated, agree)
    if gross is not None:
        _refuse(sheet, gross, driven)
    if contradiction is None:
        return []
    if not np.isfinite(contradiction.off_mm):
        return [f"the nominal robot has too few poses at the {sheet.drive_name} to compare the commanded positions"]
    off = f"commanded positions {contradiction.off_mm:.3g} mm in the median from those of the nominal robot at the "
    off += sheet.drive_name
    if contradiction.refused:
        sheet.refuse_now(COMMAND, off, f"at most {contradiction.tolerance_mm:.3g} mm; {contradiction.advice}")
    return [f"{off}, which are used{'; they would agree with: ' * bool(contradiction.advice)}{contradiction.advice}"]


def _refuse(sheet: Sheet, gross: GrossError, driven: bool) -> None:
    """Raise IngestError for a GrossError; driven: whether the file has drive values."""
    robot = sheet.mechanism
    model = "a nominal robot that is" if driven else "measured positions that are"
    where = "" if driven else " the commanded ones"
    value = f"{model} off{' from' * bool(where)}{where} by {gross.rms_mm:.3g} mm rms however the instrument stands"
    if not np.isfinite(gross.rms_mm):
        value = "values far outside of the drives' ranges, or at which the nominal robot has "
        value += "no pose in more than a tenth of the rows"
    allowed = f"{gross.advice}, which leaves {gross.rms_without_mm:.3g} mm rms (probability above 0.99)"
    if gross.limit_mm is not None:
        value += f", and by {gross.rms_without_mm:.3g} mm rms at best{gross.advice}" * bool(gross.advice)
        allowed = (
            f"at most {gross.limit_mm:.3g} mm rms: the file does not fit the robot {robot.name}; see that `robot`, "
        )
        allowed += "its description, the columns of its drives (`columns`) and the measured rows belong to each other"
    concerned = sheet.drives if driven and not gross.mistakes.of_readings else MEASURED
    concerned = concerned if gross.mistakes.count or gross.limit_mm is not None else ("target",)
    # other units have been tried along with all other mistakes, and the instrument's frame is registered
    explained = gross.limit_mm is None and not gross.mistakes.of_units
    sheet.refuse_now(concerned, value, allowed, MistakeError if explained else GrossFileError)


def _at_tool(sheet: Sheet, mounted: TargetPlacement | None) -> Sheet:
    """The sheet with the positions of reflectors carried to the tool, NaN where that is none, in the robot's frame."""
    if mounted is None:
        return sheet
    carried = np.where(mounted.strays[:, None], np.nan, measured(sheet.frame) - mounted.offset_mm)
    moved = vector_columns("measured", carried)
    return replace(sheet, frame=sheet.frame.assign(**moved))


def _register_sheet(sheet: Sheet, mounted: TargetPlacement | None, digit_mm: float) -> Registration:
    """Registration from the chosen points, without those that a first registration shows to be outliers."""
    frame = sheet.frame
    offset = mounted.offset_mm if mounted else 0.0
    seen, target = measured(frame), command(frame) + offset
    pairs = list(zip(frame["run"], frame["point"], strict=True))
    wanted = {tuple(pair) for pair in sheet.spec.registration_points}
    for run, point in sorted(wanted - set(pairs), key=str):
        value = f"registration point (run {run}, point {point}), which the file lacks"
        sheet.note("registration", None, value, f"points of the file: runs 1 to {frame['run'].max():g}")
    sheet.problems.refuse()
    chosen = np.array([not wanted or pair in wanted for pair in pairs])
    if mounted:
        chosen &= mounted.framing
    try:
        first = register(seen[chosen], target[chosen])
        moved = frame.assign(**vector_columns("measured", first.apply(seen) - offset))
        chosen &= ~outliers(moved, digit_mm, partial(_jacobian, sheet))
        result = register(seen[chosen], target[chosen])
    except FitError as error:
        value, _, allowed = str(error).partition("; allowed: ")
        sheet.refuse_now(None, f"registration points: {value}", allowed)
    if mirrored := _off_as_mirrored(seen[chosen], target[chosen]):
        value = (
            f"positions in a left-handed frame ({mirrored:.6g} mm rms off when registered, a fifth of that if mirrored)"
        )
        sheet.refuse_now(MEASURED, value, "a right-handed frame: reverse the sign of one axis")
    if result.rms_mm > (limit := frame_limit(sheet.mechanism)):
        value = f"distances in space of {result.rms_mm:.6g} mm rms after registration at {result.points} points"
        sheet.refuse_now(MEASURED, value, f"at most {limit:g} mm rms: the same points in both frames")
    return result


def _jacobian(sheet: Sheet) -> np.ndarray:
    """Derivative (n, 3, p) of the commanded positions by the errors of the nominal robot's geometry."""
    position = command(sheet.frame)
    return sheet.mechanism.parameter_jacobian(position, sheet.actuators(position))


def _turn_jacobian(sheet: Sheet, length_mm: float) -> np.ndarray:
    """The same of the commanded orientations, an angle as the way in mm of a point at a length."""
    position, robot = command(sheet.frame), sheet.mechanism
    actuators = sheet.actuators(position)
    poses = robot.solve(actuators, position)
    readings = Readings(position, turn=poses.turn, characteristic_length_mm=length_mm)
    columns = np.full((len(position), 3, robot.directions.shape[-1]), np.nan)
    known = np.isfinite(poses.turn).all(axis=(1, 2))
    columns[known] = robot.map(actuators, poses, readings=readings).columns(robot.directions)[len(position) :]
    return columns


def _off_as_mirrored(seen: np.ndarray, target: np.ndarray) -> float:
    """Residual in mm rms of measured positions (n, 3) that fit far better with one axis reversed, else 0."""
    try:
        straight, mirrored = (register(seen * [1.0, 1.0, sign], target).rms_mm for sign in (1.0, -1.0))
    except FitError:
        return 0.0
    return straight if straight > 1.0 and mirrored < 0.2 * straight else 0.0


def _gross_file(sheet: Sheet) -> GrossFile | None:
    """The columns of a sheet in the form in which gross mistakes are searched."""
    return GrossFile.of(sheet.frame, sheet.spec, sheet.mechanism, sheet.found, unit_stated=True)


def _large_error_notes(sheet: Sheet) -> Iterator[str]:
    """A note where the nominal robot's error is larger than usual part errors make it, after registration."""
    file, size = _gross_file(sheet), sheet.mechanism.size_mm
    rms_mm = 0.0 if file is None or not len(file) else file.hypothesis(file.given).rms_mm
    if ORDINARY_SHARE * size < rms_mm < np.inf:
        share = f"{rms_mm:.3g} mm rms, {100.0 * rms_mm / size:.1f} % of the robot's size of {size:.4g} mm"
        usual = f"errors of its parts are usually below {100.0 * ORDINARY_SHARE:g} %"
        yield f"the nominal robot has an error of {share}, {usual}: see that `robot` is right"


def _notes_on_columns(sheet: Sheet) -> list[str]:
    """Notes on columns that are missing or blank."""
    notes, frame, found = [], sheet.frame, sheet.found
    for name in ("time_s", "speed_mm_s", "payload_kg"):
        blank = f"column {found.get(name)} is blank: {name} is unknown"
        if name not in frame:
            notes.append(blank if name in found else f"no column {name}: it is unknown")
    if not set(sheet.drives) <= set(frame):
        which = f"{sheet.mechanism.name}, nominal, elbow {sheet.spec.elbow}"
        names = f"{sheet.drives[0]} to {sheet.drives[-1]}"
        upright = sheet.mechanism.orients and not set(TURNS["command"]) <= set(frame)
        held = "; nor orientations: it is taken to be turned as at home all the time" if upright else ""
        notes.append(f"no {sheet.drive_name}: {names} computed from the commanded positions ({which}){held}")
    if sheet.spec.motion:
        notes.append(f"motion: {sheet.spec.motion.words}, as stated")
    if np.array_equal(frame[[*MEASURED]], frame[[*COMMAND]]):
        notes.append("every measured position equals the commanded one: no instrument gives that")
    return notes


def _table(
    sheet: Sheet, mounted: TargetPlacement | None, registration: Registration | None, digit_mm: float
) -> tuple[pd.DataFrame, list[str]]:
    """Frame in the form of the schema of measurements, and notes on implausible values and on outliers."""
    seen, drives = _at_tool(sheet, mounted).frame, sheet.drives
    values, turned = sheet.actuators(command(seen)), set(TURNS["measured"]) <= set(seen)
    wrong = mounted.strays if mounted else np.zeros(len(seen), dtype=bool)
    places = partial(places_instead, sheet)
    notes = [*plausibility_notes(seen[~wrong], sheet.mechanism, places), *beyond_ranges(values, sheet.mechanism)]
    outlier = outliers(seen, digit_mm, partial(_jacobian, sheet)) | wrong
    computed = dict(zip(drives, values.T, strict=True))
    if turned or mounted or sheet.mechanism.orients:
        computed |= turn_columns("command", sheet.poses.turn)
    if turned and registration and not mounted:
        computed |= turn_columns("measured", registration.rotation @ turns(seen, "measured"))
    if mounted:
        computed |= mounted.columns(seen, registration.rotation if registration else np.eye(3))
    if sheet.spec.motion:
        computed |= sheet.spec.motion.columns()
    frame = sheet.frame.assign(**computed)
    if turned:
        length_mm = sheet.mechanism.characteristic_length_mm
        outlier |= turned_outliers(frame, length_mm, partial(_turn_jacobian, sheet, length_mm))
    frame = frame.assign(status=np.where(outlier, "outlier", "ok"))
    if outlier.any():
        count = int(outlier.sum())
        points = "1 point marked as outlier" if count == 1 else f"{count} points marked as outliers"
        notes.append(f"{points}, in the table but not in fits: {rows_text(frame.index[outlier])}")
    if (jumping := jumps(seen, digit_mm) & ~outlier).any():
        where = rows_text(frame.index[jumping])
        notes.append(
            f"at least {jumping.sum()} points jump off their neighbours, in runs where more than a tenth do: {where}. "
            "A loose joint does that, so fits use them. If no joint is loose, the instrument is the cause: delete them"
        )
    moved = ("time_s", *COMMAND, *drives, *MEASURED, "speed_mm_s", "payload_kg")
    optional = (*TURNS["command"], *TURNS["measured"], *NOISE, "temperature_c", "target", *TARGET, "target_on")
    extra = [name for name in (*optional, "motion", "motion_between") if name in frame]
    frame = frame.reindex(columns=("run", "trajectory", "point", *moved, "status", *extra)).reset_index(drop=True)
    return frame.astype({"run": "int64", "point": "int64", "trajectory": "str", "status": "str"}), notes
