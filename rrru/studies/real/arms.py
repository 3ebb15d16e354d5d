"""One real series of an arm: ingested, calibrated and diagnosed on its training rows, evaluated on held-out rows.

Lengths in mm, angles in rad.
"""

import json
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.campaign.ingest.campaign_file import ingest
from rrru.campaign.ingest.spec import IngestSpec
from rrru.diagnosis.diagnose import Diagnosis, MeasuredRobot, diagnose, with_wide_bounds
from rrru.diagnosis.inference import with_characteristic_length
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.diagnosis.settings import GapSettings
from rrru.diagnosis.state import ModelState
from rrru.errors import ConfigError, FitError, IngestError
from rrru.kinematics.dynamics import Masses
from rrru.kinematics.robot import Robot
from rrru.pipeline import setup
from rrru.studies.real import chains
from rrru.studies.real.series import Series
from rrru.studies.real.sheets import HELD_OUT, in_file, in_series_terms, joint_columns, sheet, stated_noise
from rrru.studies.real.steps import Step, held_out_mm, library_effects, steps

# the masses of an arm are in its links
NO_MASSES = Masses(0.0, 0.0, 0.0)
# ASSUME the median orientation error of a calibrated arm is below this (rad); a wrong Euler sequence exceeds it
_MAX_ORIENTATION_RAD = 0.1


@dataclass(frozen=True)
class Studied:
    """A series with its results.

    rows: the sheet; measurements: of all its rows; robot: with the parameters that its training rows observe; plain:
    the problem of the plain models; steps: these models; diagnosis: of the training rows, None where they are too few;
    held_out_mm (n,): held-out residuals with the named causes, or with the geometry alone without a diagnosis.
    """

    series: Series
    rows: pd.DataFrame
    measurements: pd.DataFrame
    robot: Robot
    plain: DiagnosisProblem
    steps: tuple[Step, ...]
    diagnosis: Diagnosis | None
    held_out_mm: np.ndarray
    seconds: Mapping[str, float]
    notes: tuple[str, ...]

    def step(self, model: str) -> Step:
        """The step of a model by its letter."""
        return next(step for step in self.steps if step.model == model)

    @property
    def problem(self) -> DiagnosisProblem:
        """The problem of the diagnosis, or of the plain models without a diagnosis."""
        return self.diagnosis.inference.problem if self.diagnosis else self.plain

    @property
    def state(self) -> ModelState:
        """The ModelState of the corrected model, or of the calibrated one without a diagnosis."""
        return self.diagnosis.state if self.diagnosis else self.step("b").state


@dataclass(frozen=True)
class Prepared:
    """A series after reading and ingest; noise: as stated by the instrument, in mm and rad, None where not stated."""

    series: Series
    rows: pd.DataFrame
    measurements: pd.DataFrame
    robot: Robot
    noise: tuple[float | None, float | None]
    seconds: float
    notes: tuple[str, ...]


def prepared(series: Series, robots: Mapping[str, Any], sheet_file: Path) -> Prepared:
    """The series, ingested from a sheet that this function writes to a parquet file.

    robots: entries of the configuration's `robots:`. Raises ConfigError and IngestError for unusable data.
    """
    began = time.perf_counter()
    raw, nominal = series.read(), nominal_robot(series, robots)
    mechanism = setup.mechanism(nominal)
    _check_joints(series, joint_columns(series, raw), mechanism)
    table = sheet(series, raw)
    sheet_file.parent.mkdir(parents=True, exist_ok=True)
    table.to_parquet(sheet_file, index=False)
    seen = [name for name in series.section["readings"] if (table["target"] == name).any()]
    fixed = [name for name in series.section.get("world_targets", ()) if name in seen]
    if len(fixed) == len(seen):
        raise ConfigError(
            f"{series.file}: only world_targets were measured ({', '.join(seen)}); allowed: at least one on the robot"
        )
    spec = {"ingest": str(sheet_file), "frame": "register", "extra_columns": "ignore", "world_targets": fixed}
    try:
        ingested = ingest(IngestSpec.from_config(spec), mechanism)
    except IngestError as error:
        raise in_series_terms(error, series, table) from error
    measurements = rows.hold_out(ingested.measurements, table[HELD_OUT].to_numpy())
    robot, noise = setup.measured_robot(nominal, measurements), stated_noise(series, raw)
    unseen = tuple(f"{name} was never measured" for name in series.section["readings"] if name not in seen)
    notes = unseen + tuple(in_file(note, table) for note in ingested.notes)
    return Prepared(series, table, measurements, robot, noise, time.perf_counter() - began, notes)


def study(series: Series, robots: Mapping[str, Any], settings: GapSettings, sheet_file: Path) -> Studied:
    """The series, read and ingested by `prepared`, then studied."""
    return studied(prepared(series, robots, sheet_file), settings)


def studied(known: Prepared, settings: GapSettings) -> Studied:
    """A series with its plain models and its diagnosis; raises their ConfigError and FitError."""
    plain, made = _reference(known)
    seconds = {"ingest": known.seconds} | {step.model: step.seconds for step in made}
    began, notes = time.perf_counter(), known.notes
    measured = MeasuredRobot(known.robot, NO_MASSES, known.noise[0], known.series.name, known.noise[1])
    try:
        found = diagnose(known.measurements, measured, settings, details=False)
        left = held_out_mm(found.inference.problem, found.state)
    except FitError as error:
        # the calibration alone is still a result
        found, left = None, next(step for step in made if step.model == "b").held_out_mm
        notes = (f"not diagnosed: {error}", *notes)
    seconds["gap"] = time.perf_counter() - began
    prepared_fields = known.series, known.rows, known.measurements, known.robot
    return Studied(*prepared_fields, plain, made, found, left, seconds, notes)


def nominal_robot(series: Series, robots: Mapping[str, Any]) -> dict:
    """The nominal robot of a series for `rrru.pipeline.setup`: an entry of `robots:`, or a chain's file."""
    section = series.section
    if "chain" in section:
        name, dimensions = series.dataset, _chain(series)
    else:
        name, dimensions = section["robot"], robots[section["robot"]]
    return {"name": name, "dimensions": dimensions, "parameter_set": "full", "registered": True}


def _chain(series: Series) -> dict:
    """The robot of a chain's file; raises ConfigError for a missing or malformed file."""
    file = series.file.parent / series.section["chain"]
    where, allowed = f"real.sets.{series.dataset}.chain: {file}", "a JSON file, see rrru/studies/real/chains.py"
    try:
        return chains.robot_section(json.loads(file.read_text()))
    except (OSError, ValueError) as error:
        raise ConfigError(f"{where}: {error}; allowed: {allowed}") from error
    except (KeyError, TypeError, AttributeError, IndexError) as error:
        raise ConfigError(f"{where}: {type(error).__name__} {error}; allowed: {allowed}") from error


def _check_joints(series: Series, joints: Mapping[str, str], mechanism: Robot) -> None:
    """Raise ConfigError where the stated joints are not those of the robot."""
    columns = mechanism.parts.columns
    where, allowed = f"real.sets.{series.dataset}.joints", f"{', '.join(columns)} of robot {mechanism.name}"
    lacking = [name for name in columns if name not in joints]
    if lacking:
        raise ConfigError(f"{where}: got no {', '.join(lacking)} for {series.file}; allowed: {allowed}")
    more = [name for name in series.section.get("joints", ()) if name not in columns]
    if more:
        raise ConfigError(f"{where}: got {', '.join(more)}; allowed: {allowed}")


def _reference(known: Prepared) -> tuple[DiagnosisProblem, tuple[Step, ...]]:
    """The problem of the reference models of a series, and these models, each fitted to its training rows."""
    nominal, measurements = with_wide_bounds(known.robot), known.measurements
    turned = rows.has_turns(measurements)
    characteristic_length_mm = nominal.characteristic_length_mm if turned else np.nan
    problem = make_diagnosis_problem(
        measurements,
        nominal,
        NO_MASSES,
        known.noise[0] or 1.0,
        library_effects(nominal),
        True,
        characteristic_length_mm,
    )
    if turned:
        problem = with_characteristic_length(problem, *known.noise)
    made = steps(problem)
    if turned:
        _check_turned(known.series, problem, next(step for step in made if step.model == "b").state)
    return problem, made


def _check_turned(series: Series, problem: DiagnosisProblem, state: ModelState) -> None:
    """Raise ConfigError where the orientations of the calibrated robot disagree with the measured ones."""
    off_rad = float(
        np.median(np.linalg.norm(problem.residual(state)[~problem.positions], axis=1))
        / problem.characteristic_length_mm
    )
    if off_rad > _MAX_ORIENTATION_RAD:
        raise ConfigError(
            f"{series.file}: orientations have errors of {off_rad:.2g} rad after calibration; allowed: "
            f"{_MAX_ORIENTATION_RAD:g}; check sequence, rotation_unit and order of columns in "
            f"real.sets.{series.dataset}.readings"
        )
