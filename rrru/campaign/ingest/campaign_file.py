"""Ingest of a measured campaign: a CSV or parquet file that an instrument wrote becomes a measurement table, or is
refused with reasons.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow
import pyarrow.parquet as parquet

from rrru.campaign.ingest.checks import check_runs, check_speed, number_runs, path_length, resolution
from rrru.campaign.ingest.columns import (
    COMMAND,
    DRIVES,
    KNOWN,
    MEASURED,
    MM,
    RAD,
    REQUIRED,
    convert,
    drive_name,
    resolve,
)
from rrru.campaign.ingest.geometry import check_commands, check_measured, check_sizes, doubts, frame_limit
from rrru.campaign.ingest.outliers import flag_outliers, reproduced
from rrru.campaign.ingest.problems import Problems
from rrru.campaign.ingest.registration import Registration, register
from rrru.campaign.ingest.text import looks_like, text_cells
from rrru.errors import ConfigError, FitError

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

    def __post_init__(self):
        for key, allowed in _CHOICES.items():
            if getattr(self, key) not in allowed:
                raise ConfigError(
                    f"ingest of {self.path}: {key} is {getattr(self, key)!r}; allowed: {', '.join(allowed)}"
                )
        if unknown := [name for name in self.columns if name not in KNOWN]:
            raise ConfigError(f"ingest of {self.path}: columns has the key {unknown[0]!r}; allowed: {', '.join(KNOWN)}")
        theirs = [self.columns.get(name, name) for name in self.columns]
        if doubled := [name for name in theirs if theirs.count(name) > 1]:
            raise ConfigError(
                f"ingest of {self.path}: columns gives {doubled[0]!r} two meanings; allowed: one of our names per column"
            )
        if self.registration_points and self.frame != "register":
            raise ConfigError(
                f"ingest of {self.path}: registration_points with frame {self.frame!r}; allowed: frame register"
            )
        if not all(isinstance(pair, (tuple, list)) and len(pair) == 2 for pair in self.registration_points):
            raise ConfigError(
                f"ingest of {self.path}: registration_points {self.registration_points!r}; allowed: pairs (run, point)"
            )


@dataclass(frozen=True)
class Ingested:
    """Measurement table, what was computed or found missing on the way to it, and the registration where one was asked
    for.
    """

    measurements: pd.DataFrame
    notes: tuple[str, ...]
    registration: Registration | None


def ingest(spec, mechanism):
    """Measurement table of a file, for the robot that it was measured on.

    Positions are brought to mm and the robot frame, angles to rad; drive angles that the file lacks are those of the
    commanded positions; points that a broken beam spoilt get the status "outlier" and stay. Raises IngestError with
    every problem that the file has.
    """
    problems, notes = Problems(spec.path), []
    names, rows, cells = _read(Path(spec.path), problems)
    drives = DRIVES[mechanism.drive_unit]
    found, extra = resolve(spec, names, drives, problems)
    if extra:
        notes.append(f"left out, as nobody declared them: {', '.join(extra)}")
    frame = convert(spec, found, cells, rows, problems)
    if not set(REQUIRED) <= set(frame) or len(set(names)) < len(names):
        problems.refuse()
    frame, more = number_runs(frame)
    notes += more + _notes_on_columns(frame, found, spec, mechanism)
    digit_mm = MM[spec.unit] * resolution(frame[[*MEASURED]].to_numpy() / MM[spec.unit])
    check_runs(frame, found, len(mechanism.parameters), digit_mm, problems)
    if check_commands(frame, found, spec, mechanism, problems):
        check_speed(frame, found, problems)
        if check_sizes(frame, found, problems) and spec.frame == "robot":
            check_measured(frame, found, mechanism, problems)
    problems.refuse()
    registration = None
    if spec.frame == "register":
        registration = _register(frame, found, spec, mechanism, digit_mm, problems)
        frame[[*MEASURED]] = registration.apply(frame[[*MEASURED]])
        check_measured(frame, found, mechanism, problems)
        problems.refuse()
        notes.append(
            f"measured positions registered to the commanded ones at {registration.points} points: "
            f"residual {registration.rms_mm:.4g} mm rms, {registration.max_mm:.4g} mm at most; "
            "the part of the robot's errors that looks like a rigid motion is gone"
        )
    return Ingested(_table(frame, spec, mechanism, digit_mm, notes), tuple(notes), registration)


def _read(path, problems):
    """Names of the file's columns, numbers of its rows, and {name: cells (n,)}."""
    suffix = path.suffix.lower()
    try:
        if not path.exists():
            problems.refuse_now(value="no such file", allowed="an existing .csv or .parquet file")
        if not path.is_file():
            problems.refuse_now(
                value="a directory" if path.is_dir() else "no regular file", allowed="a .csv or .parquet file"
            )
        if suffix not in (".csv", ".parquet"):
            problems.refuse_now(
                value=f"the extension {path.suffix!r}", allowed=".csv or .parquet; a spreadsheet can be saved as .csv"
            )
        data = path.read_bytes()
    except OSError as error:
        problems.refuse_now(value=error.strerror or str(error), allowed="a file that can be read")
    if suffix == ".parquet":
        return _parquet_cells(data, problems)
    names, rows, cells = text_cells(data, problems)
    return names, rows, dict(zip(names, zip(*cells, strict=True), strict=True))


def _parquet_cells(data, problems):
    """As `_read` for a parquet file's bytes; the columns that pandas adds for its index are left out."""
    if not data.startswith(b"PAR1"):
        seen = looks_like(data) or (f"text or other data ({data[:30]!r})" if data else "an empty file")
        problems.refuse_now(value=seen, allowed="a parquet file; comma-separated text has the extension .csv")
    try:
        table = parquet.ParquetFile(pyarrow.BufferReader(data)).read()
        names = [name for name in table.column_names if not re.fullmatch(r"__index_level_\d+__", name)]
        cells = {
            name: column.to_pylist()
            for name, column in zip(table.column_names, table.columns, strict=True)
            if name in names
        }
    except (pyarrow.ArrowException, OSError, ValueError) as error:
        cause = str(error).strip().splitlines()[0]
        problems.refuse_now(
            value=f"a damaged or truncated parquet file of {len(data)} bytes ({cause})", allowed="a whole parquet file"
        )
    if not table.num_rows:
        problems.refuse_now(value=f"columns ({', '.join(names)}) and no row", allowed="one row per measured point")
    return names, list(range(1, table.num_rows + 1)), cells


def _notes_on_columns(frame, found, spec, mechanism):
    """What the user should know about columns that are not there or hold nothing."""
    notes = []
    for name in ("time_s", "speed_mm_s", "payload_kg"):
        if name not in frame:
            notes.append(
                f"column {found[name]} is blank: {name} is unknown"
                if name in found
                else f"no column {name}: it is unknown"
            )
    drives = DRIVES[mechanism.drive_unit]
    if not set(drives) <= set(frame):
        notes.append(
            f"no {drive_name(drives)}: {drives[0]} to {drives[2]} computed from the commanded positions "
            f"({mechanism.name}, nominal, elbow {spec.elbow})"
        )
    if np.array_equal(frame[[*MEASURED]], frame[[*COMMAND]]):
        notes.append("every measured position equals the commanded one: no instrument gives that")
    return notes


def _register(frame, found, spec, mechanism, digit_mm, problems):
    """Registration from the chosen points, without those that a first registration shows to be outliers."""
    measured, command = frame[[*MEASURED]].to_numpy(), frame[[*COMMAND]].to_numpy()
    pairs = list(zip(frame["run"], frame["point"], strict=True))
    wanted = {tuple(pair) for pair in spec.registration_points}
    for run, point in sorted(wanted - set(pairs), key=str):
        problems.add(
            "registration",
            value=f"registration point (run {run}, point {point}), which the file lacks",
            allowed=f"points of the file: runs 1 to {frame['run'].max():g}",
        )
    problems.refuse()
    chosen = np.array([not wanted or pair in wanted for pair in pairs])
    try:
        first = register(measured[chosen], command[chosen])
        chosen &= ~_outliers(frame.assign(**dict(zip(MEASURED, first.apply(measured).T, strict=True))), digit_mm)
        result = register(measured[chosen], command[chosen])
    except FitError as error:
        value, _, allowed = str(error).partition("; allowed: ")
        problems.refuse_now(value=f"registration points: {value}", allowed=allowed)
    column, limit = ", ".join(found[name] for name in MEASURED), frame_limit(mechanism)
    if mirrored_off := _off_as_mirrored(measured, command):
        problems.refuse_now(
            column=column,
            value=f"positions in a left-handed frame ({mirrored_off:.6g} mm rms off when registered, a fifth of that if mirrored)",
            allowed="a right-handed frame: turn the sign of one axis round",
        )
    if result.rms_mm > limit:
        value = f"a residual of {result.rms_mm:.6g} mm rms after registration at {result.points} points"
        problems.refuse_now(
            column=column, value=value, allowed=f"at most {limit:g} mm rms: the same points in both frames"
        )
    return result


def _off_as_mirrored(measured, command):
    """Residual in mm rms of measured positions (n, 3) if they fit the commanded ones far better with an axis turned
    round, else 0.
    """
    try:
        straight, mirrored = (register(measured * [1.0, 1.0, sign], command).rms_mm for sign in (1.0, -1.0))
    except FitError:
        return 0.0
    return straight if straight > 1.0 and mirrored < 0.2 * straight else 0.0


def _outliers(frame, digit_mm):
    """Rows (n,) that a broken beam spoilt, measured positions being in the robot frame; `digit_mm` is the last digit of
    the file.
    """
    command, run = frame[[*COMMAND]].to_numpy(), frame["run"].to_numpy()
    deviation = frame[[*MEASURED]].to_numpy() - command
    marked = flag_outliers(deviation, run, noise_mm=digit_mm, place=path_length(command))
    return marked & ~reproduced(marked, deviation, command, run)


def _table(frame, spec, mechanism, digit_mm, notes):
    """Frame in the form of the schema of measurements; adds doubts and how many outliers were marked to the notes."""
    drives = DRIVES[mechanism.drive_unit]
    if not set(drives) <= set(frame):
        frame[[*drives]] = mechanism.inverse(frame[[*COMMAND]].to_numpy(), elbow=spec.elbow)
    notes += doubts(frame, mechanism)
    outlier = _outliers(frame, digit_mm)
    frame["status"] = np.where(outlier, "outlier", "ok")
    if outlier.any():
        where = ", ".join(
            f"run {run:g} point {point:g}" for run, point in frame.loc[outlier, ["run", "point"]].to_numpy()[:10]
        )
        notes.append(
            f"{outlier.sum()} points marked as outliers, kept and left out of fits: {where}{', ...' if outlier.sum() > 10 else ''}"
        )
    columns = (
        "run",
        "trajectory",
        "point",
        "time_s",
        *COMMAND,
        *drives,
        *MEASURED,
        "speed_mm_s",
        "payload_kg",
        "status",
    )
    frame = frame.reindex(columns=columns).reset_index(drop=True)
    return frame.astype({"run": "int64", "point": "int64", "trajectory": "str", "status": "str"})
