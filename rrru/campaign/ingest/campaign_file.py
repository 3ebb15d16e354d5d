"""Ingest of a measured campaign: an instrument's CSV or parquet file becomes a measurement table or is refused."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
import pandas as pd

from rrru.campaign.ingest.cells import read_cells
from rrru.campaign.ingest.checks import check_runs, check_speed, number_runs, path_length, resolution
from rrru.campaign.ingest.columns import MM, RAD, REQUIRED, convert, known_columns, resolve
from rrru.campaign.ingest.geometry import check_commands, check_measured, check_sizes, doubts, frame_limit
from rrru.campaign.ingest.outliers import flag_outliers, reproduced
from rrru.campaign.ingest.problems import Problems
from rrru.campaign.ingest.registration import Registration, register
from rrru.campaign.ingest.sheet import COMMAND, MEASURED, Sheet
from rrru.campaign.measurements import command, measured, vector_columns
from rrru.errors import ConfigError, FitError
from rrru.robots.robot import Robot

_CHOICES = {
    "unit": tuple(MM),
    "angle_unit": tuple(RAD),
    "frame": ("robot", "register"),
    "extra_columns": ("refuse", "ignore"),
    "elbow": ("out", "in"),
}


@dataclass(frozen=True)
class IngestSpec:
    """How to read a measurement file; raises ConfigError for a setting that does not exist.

    columns: our name -> the file's column name, absent = the same name. unit: of the file's positions ("mm", "m",
    "inch"; speeds are mm/s, payloads kg). angle_unit: "rad" or "deg". frame: of the measured positions; "register"
    solves the six numbers between it and the robot frame from `registration_points`, pairs (run, point), none for all.
    extra_columns: "refuse" or "ignore" what nobody declared. elbow: assembly of the legs, "out" or "in".
    """

    path: str
    columns: Mapping[str, str] = field(default_factory=dict)
    unit: str = "mm"
    angle_unit: str = "rad"
    frame: str = "robot"
    registration_points: tuple = ()
    extra_columns: str = "refuse"
    elbow: str = "out"

    def __post_init__(self) -> None:
        theirs, points = [*self.columns.values()], self.registration_points
        given = {key: getattr(self, key) for key in _CHOICES}
        wrong = [f"{key} is {given[key]!r}; allowed: {', '.join(_CHOICES[key])}" for key in _CHOICES]
        wrong = [text for text, key in zip(wrong, _CHOICES, strict=True) if given[key] not in _CHOICES[key]]
        doubled = [name for name in theirs if theirs.count(name) > 1]
        wrong += [f"columns gives {name!r} two meanings; allowed: one of our names per column" for name in doubled]
        if points and self.frame != "register":
            wrong.append(f"registration_points with frame {self.frame!r}; allowed: frame register")
        if not all(isinstance(pair, (tuple, list)) and len(pair) == 2 for pair in points):
            wrong.append(f"registration_points {points!r}; allowed: pairs (run, point)")
        if wrong:
            raise ConfigError(f"ingest of {self.path}: {wrong[0]}")

    @classmethod
    def from_config(cls, section: Mapping[str, Any]) -> Self:
        """From a campaign's section of the configuration, whose key `ingest` is the path."""
        given = {entry.name: section[entry.name] for entry in fields(cls)[1:] if entry.name in section}
        points = tuple(tuple(pair) for pair in given.pop("registration_points", ()))
        return cls(section["ingest"], registration_points=points, **given)


@dataclass(frozen=True)
class Ingested:
    """Measurement table, what was computed or found missing on the way, the registration where one was asked for."""

    measurements: pd.DataFrame
    notes: tuple[str, ...]
    registration: Registration | None


def ingest(spec: IngestSpec, mechanism: Robot) -> Ingested:
    """Measurement table of a file, for the robot that it was measured on.

    Positions are brought to mm and the robot frame, angles to rad; drive angles that the file lacks are those of the
    commanded positions; points that a broken beam spoilt get the status "outlier" and stay. Raises IngestError with
    every problem that the file has.
    """
    sheet, notes = _read(spec, mechanism)
    digit_mm = MM[spec.unit] * resolution(measured(sheet.frame) / MM[spec.unit])
    check_runs(sheet, digit_mm)
    if check_commands(sheet):
        check_speed(sheet)
        if check_sizes(sheet) and spec.frame == "robot":
            check_measured(sheet)
    sheet.problems.refuse()
    registration = _register(sheet, digit_mm) if spec.frame == "register" else None
    if registration:
        moved = vector_columns("measured", registration.apply(measured(sheet.frame)))
        sheet = replace(sheet, frame=sheet.frame.assign(**moved))
        check_measured(sheet)
        sheet.problems.refuse()
        residual = f"residual {registration.rms_mm:.4g} mm rms, {registration.max_mm:.4g} mm at most"
        notes += [
            f"measured positions registered to the commanded ones at {registration.points} points: {residual}; "
            "the part of the robot's errors that looks like a rigid motion is gone"
        ]
    table, more = _table(sheet, digit_mm)
    return Ingested(table, (*notes, *more), registration)


def _read(spec: IngestSpec, mechanism: Robot) -> tuple[Sheet, list[str]]:
    """The file as a sheet with numbered runs and points, and what the user should know about its columns."""
    known = known_columns(mechanism)
    for key in spec.columns:
        if key not in known:
            raise ConfigError(f"ingest of {spec.path}: columns has the key {key!r}; allowed: {', '.join(known)}")
    problems, notes = Problems(spec.path), []
    names, rows, cells = read_cells(Path(spec.path), problems)
    found, extra = resolve(spec, names, mechanism, problems)
    if extra:
        notes.append(f"left out, as nobody declared them: {', '.join(extra)}")
    frame = convert(spec, mechanism, found, cells, rows, problems)
    if not set(REQUIRED) <= set(frame) or len(set(names)) < len(names):
        problems.refuse()
    frame, more = number_runs(frame)
    sheet = Sheet(spec, mechanism, problems, found, frame)
    return sheet, notes + more + _notes_on_columns(sheet)


def _notes_on_columns(sheet: Sheet) -> list[str]:
    """What the user should know about columns that are not there or hold nothing."""
    notes, frame, found = [], sheet.frame, sheet.found
    for name in ("time_s", "speed_mm_s", "payload_kg"):
        blank = f"column {found.get(name)} is blank: {name} is unknown"
        if name not in frame:
            notes.append(blank if name in found else f"no column {name}: it is unknown")
    if not set(sheet.drives) <= set(frame):
        which = f"{sheet.mechanism.name}, nominal, elbow {sheet.spec.elbow}"
        names = f"{sheet.drives[0]} to {sheet.drives[-1]}"
        notes.append(f"no {sheet.drive_name}: {names} computed from the commanded positions ({which})")
    if np.array_equal(frame[[*MEASURED]], frame[[*COMMAND]]):
        notes.append("every measured position equals the commanded one: no instrument gives that")
    return notes


def _register(sheet: Sheet, digit_mm: float) -> Registration:
    """Registration from the chosen points, without those that a first registration shows to be outliers."""
    frame = sheet.frame
    seen, target = measured(frame), command(frame)
    pairs = list(zip(frame["run"], frame["point"], strict=True))
    wanted = {tuple(pair) for pair in sheet.spec.registration_points}
    for run, point in sorted(wanted - set(pairs), key=str):
        value = f"registration point (run {run}, point {point}), which the file lacks"
        sheet.note("registration", None, value, f"points of the file: runs 1 to {frame['run'].max():g}")
    sheet.problems.refuse()
    chosen = np.array([not wanted or pair in wanted for pair in pairs])
    try:
        first = register(seen[chosen], target[chosen])
        chosen &= ~_outliers(frame.assign(**vector_columns("measured", first.apply(seen))), digit_mm)
        result = register(seen[chosen], target[chosen])
    except FitError as error:
        value, _, allowed = str(error).partition("; allowed: ")
        sheet.refuse_now(None, f"registration points: {value}", allowed)
    if mirrored := _off_as_mirrored(seen, target):
        value = (
            f"positions in a left-handed frame ({mirrored:.6g} mm rms off when registered, a fifth of that if mirrored)"
        )
        sheet.refuse_now(MEASURED, value, "a right-handed frame: turn the sign of one axis round")
    if result.rms_mm > (limit := frame_limit(sheet.mechanism)):
        value = f"a residual of {result.rms_mm:.6g} mm rms after registration at {result.points} points"
        sheet.refuse_now(MEASURED, value, f"at most {limit:g} mm rms: the same points in both frames")
    return result


def _off_as_mirrored(seen: np.ndarray, target: np.ndarray) -> float:
    """Residual in mm rms of measured positions (n, 3) that fit far better with an axis turned round, else 0."""
    try:
        straight, mirrored = (register(seen * [1.0, 1.0, sign], target).rms_mm for sign in (1.0, -1.0))
    except FitError:
        return 0.0
    return straight if straight > 1.0 and mirrored < 0.2 * straight else 0.0


def _outliers(frame: pd.DataFrame, digit_mm: float) -> np.ndarray:
    """Rows (n,) that a broken beam spoilt, positions being in the robot frame; digit_mm: last digit of the file."""
    target, run = command(frame), frame["run"].to_numpy()
    deviation = measured(frame) - target
    marked = flag_outliers(deviation, run, noise_mm=digit_mm, place=path_length(target))
    return marked & ~reproduced(marked, deviation, target, run)


def _table(sheet: Sheet, digit_mm: float) -> tuple[pd.DataFrame, list[str]]:
    """Frame in the form of the schema of measurements, and notes on what is strange and on outliers."""
    frame, drives = sheet.frame, sheet.drives
    if not set(drives) <= set(frame):
        values = sheet.mechanism.inverse(command(frame), elbow=sheet.spec.elbow)
        frame = frame.assign(**dict(zip(drives, values.T, strict=True)))
    notes, outlier = doubts(frame, sheet.mechanism), _outliers(frame, digit_mm)
    frame = frame.assign(status=np.where(outlier, "outlier", "ok"))
    if outlier.any():
        places = frame.loc[outlier, ["run", "point"]].to_numpy()
        where = ", ".join(f"run {run:g} point {point:g}" for run, point in places[:10])
        more = ", ..." if len(places) > 10 else ""
        notes.append(f"{len(places)} points marked as outliers, kept and left out of fits: {where}{more}")
    moved = ("time_s", *COMMAND, *drives, *MEASURED, "speed_mm_s", "payload_kg")
    frame = frame.reindex(columns=("run", "trajectory", "point", *moved, "status")).reset_index(drop=True)
    return frame.astype({"run": "int64", "point": "int64", "trajectory": "str", "status": "str"}), notes
