"""One real series of an arm: ingested, calibrated, diagnosed on its training rows, judged on those held out.

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
from rrru.diagnosis.diagnose import Diagnosis, MeasuredRobot, diagnose, sim
from rrru.diagnosis.inference import with_arm
from rrru.diagnosis.make_problem import make_case
from rrru.diagnosis.problem import Case
from rrru.diagnosis.settings import GapSettings
from rrru.diagnosis.state import State
from rrru.errors import ConfigError, FitError, IngestError
from rrru.kinematics.dynamics import Masses
from rrru.kinematics.robot import Robot
from rrru.studies import setup
from rrru.studies.real import chains
from rrru.studies.real.series import Series
from rrru.studies.real.sheets import HELD_OUT, in_file, joint_columns, retold, sheet, stated_noise
from rrru.studies.real.steps import Step, held_out_mm, laws, steps

# an arm's masses are those of its links
NO_MASSES = Masses(0.0, 0.0, 0.0)
# ASSUME no calibrated arm's orientations are off by so many rad, at the median; angles read in another sequence are
_TURNED = 0.1


@dataclass(frozen=True)
class Studied:
    """A series with all that was found of it.

    rows: the sheet; measurements: of all its rows; robot: with the numbers that its training rows tell; plain: the case
    of the plain models, the steps; diagnosis: of the training rows, None where they are too few; held_out_mm (n,): what
    its named causes, without a diagnosis its geometry, leave on the rows held out.
    """

    series: Series
    rows: pd.DataFrame
    measurements: pd.DataFrame
    robot: Robot
    plain: Case
    steps: tuple[Step, ...]
    diagnosis: Diagnosis | None
    held_out_mm: np.ndarray
    seconds: Mapping[str, float]
    notes: tuple[str, ...]

    def step(self, model: str) -> Step:
        """The step of a model's letter."""
        return next(step for step in self.steps if step.model == model)

    @property
    def case(self) -> Case:
        """The case of the diagnosis, without one that of the plain models."""
        return self.diagnosis.inference.case if self.diagnosis else self.plain

    @property
    def state(self) -> State:
        """The corrected sim, without a diagnosis the calibrated one."""
        return self.diagnosis.state if self.diagnosis else self.step("b").state


@dataclass(frozen=True)
class Prepared:
    """A series that has been read and ingested; noise: that the instrument states, in mm and rad, None where none."""

    series: Series
    rows: pd.DataFrame
    measurements: pd.DataFrame
    robot: Robot
    noise: tuple[float | None, float | None]
    seconds: float
    notes: tuple[str, ...]


def prepared(series: Series, robots: Mapping[str, Any], sheet_file: Path) -> Prepared:
    """The series, ingested from the sheet that is written to a parquet file.

    robots: entries of the configuration's `robots:`. Raises ConfigError and IngestError for what cannot be used.
    """
    began = time.perf_counter()
    raw, nominal = series.read(), nominal_robot(series, robots)
    mechanism = setup.mechanism(nominal)
    _check_joints(series, joint_columns(series, raw), mechanism)
    table = sheet(series, raw)
    sheet_file.parent.mkdir(parents=True, exist_ok=True)
    table.to_parquet(sheet_file, index=False)
    seen = [name for name in series.section["readings"] if (table["target"] == name).any()]
    beside = [name for name in series.section.get("world_targets", ()) if name in seen]
    if len(beside) == len(seen):
        raise ConfigError(f"{series.file}: seen are {', '.join(seen)} alone; allowed: with one that the robot holds")
    spec = {"ingest": str(sheet_file), "frame": "register", "extra_columns": "ignore", "world_targets": beside}
    try:
        ingested = ingest(IngestSpec.from_config(spec), mechanism)
    except IngestError as error:
        raise retold(error, series, table) from error
    measurements = rows.hold_out(ingested.measurements, table[HELD_OUT].to_numpy())
    robot, noise = setup.measured_robot(nominal, measurements), stated_noise(series, raw)
    unseen = tuple(f"{name} was never seen" for name in series.section["readings"] if name not in seen)
    notes = unseen + tuple(in_file(note, table) for note in ingested.notes)
    return Prepared(series, table, measurements, robot, noise, time.perf_counter() - began, notes)


def study(series: Series, robots: Mapping[str, Any], settings: GapSettings, sheet_file: Path) -> Studied:
    """The series, read and ingested by `prepared`, then studied."""
    return studied(prepared(series, robots, sheet_file), settings)


def studied(known: Prepared, settings: GapSettings) -> Studied:
    """A series with its plain models and its diagnosis; raises ConfigError and FitError as these steps do."""
    plain, made = _reference(known)
    at = {"ingest": known.seconds} | {step.model: step.seconds for step in made}
    began, notes = time.perf_counter(), known.notes
    measured = MeasuredRobot(known.robot, NO_MASSES, known.noise[0], known.series.name, known.noise[1])
    try:
        found = diagnose(known.measurements, measured, settings, details=False)
        left = held_out_mm(found.inference.case, found.state)
    except FitError as error:
        # its calibration still tells something
        found, left = None, next(step for step in made if step.model == "b").held_out_mm
        notes = (f"not diagnosed: {error}", *notes)
    at["gap"] = time.perf_counter() - began
    own = known.series, known.rows, known.measurements, known.robot
    return Studied(*own, plain, made, found, left, at, notes)


def nominal_robot(series: Series, robots: Mapping[str, Any]) -> dict:
    """The nominal robot of a series, as `rrru.studies.setup` takes it: an entry of `robots:`, or a chain's file."""
    section = series.section
    if "chain" in section:
        name, dimensions = series.dataset, _chain(series)
    else:
        name, dimensions = section["robot"], robots[section["robot"]]
    return {"name": name, "dimensions": dimensions, "parameter_set": "full", "registered": True}


def _chain(series: Series) -> dict:
    """The robot of a chain's file; raises ConfigError where there is none, or none of this form."""
    file = series.file.parent / series.section["chain"]
    where, allowed = f"real.sets.{series.dataset}.chain: {file}", "a JSON file, see rrru/studies/real/chains.py"
    try:
        return chains.robot_section(json.loads(file.read_text()))
    except (OSError, ValueError) as error:
        raise ConfigError(f"{where}: {error}; allowed: {allowed}") from error
    except (KeyError, TypeError, AttributeError, IndexError) as error:
        raise ConfigError(f"{where}: {type(error).__name__} {error}; allowed: {allowed}") from error


def _check_joints(series: Series, joints: Mapping[str, str], mechanism: Robot) -> None:
    """Raise ConfigError where the joints that are told are not those of the robot."""
    columns = mechanism.parts.columns
    where, allowed = f"real.sets.{series.dataset}.joints", f"{', '.join(columns)} of robot {mechanism.name}"
    lacking = [name for name in columns if name not in joints]
    if lacking:
        raise ConfigError(f"{where}: got no {', '.join(lacking)} for {series.file}; allowed: {allowed}")
    more = [name for name in series.section.get("joints", ()) if name not in columns]
    if more:
        raise ConfigError(f"{where}: got {', '.join(more)}; allowed: {allowed}")


def _reference(known: Prepared) -> tuple[Case, tuple[Step, ...]]:
    """The reference models of a series, each fitted to its training rows, and their case."""
    nominal, measurements, turned = sim(known.robot), known.measurements, rows.has_turns(known.measurements)
    arm_mm = nominal.angle_arm_mm if turned else np.nan
    case = make_case(measurements, nominal, NO_MASSES, known.noise[0] or 1.0, laws(nominal), True, arm_mm)
    if turned:
        case = with_arm(case, *known.noise)
    made = steps(case)
    if turned:
        _check_turned(known.series, case, next(step for step in made if step.model == "b").state)
    return case, made


def _check_turned(series: Series, case: Case, state: State) -> None:
    """Raise ConfigError where a calibrated robot's orientations have nothing to do with those that were read."""
    off_rad = float(np.median(np.linalg.norm(case.residual(state)[~case.positions], axis=1)) / case.arm_mm)
    if off_rad > _TURNED:
        raise ConfigError(
            f"{series.file}: orientations are off by {off_rad:.2g} rad, calibrated; allowed: {_TURNED:g}: does "
            f"real.sets.{series.dataset}.readings have their sequence, rotation_unit and order of columns?"
        )
