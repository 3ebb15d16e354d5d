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
from rrru.campaign.ingest.campaign_file import IngestSpec, ingest
from rrru.gap.attribute import with_arm
from rrru.gap.case import Case, State
from rrru.gap.diagnose import Diagnosis, MeasuredRobot, diagnose, sim
from rrru.gap.make_case import make_case
from rrru.gap.settings import GapSettings
from rrru.robots.dynamics import Masses
from rrru.robots.robot import Robot
from rrru.studies import setup
from rrru.studies.real import chains
from rrru.studies.real.series import Series
from rrru.studies.real.sheets import HELD_OUT, sheet, stated_noise
from rrru.studies.real.steps import Step, held_out_mm, steps

# an arm's masses are those of its links
NO_MASSES = Masses(0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Studied:
    """A series with all that was found of it.

    rows: the sheet; measurements: of all its rows; robot: with the numbers that its training rows tell; steps: the
    plain models; diagnosis: of the training rows; held_out_mm (n,): what its named causes leave on the rows held out.
    """

    series: Series
    rows: pd.DataFrame
    measurements: pd.DataFrame
    robot: Robot
    steps: tuple[Step, ...]
    diagnosis: Diagnosis
    held_out_mm: np.ndarray
    seconds: Mapping[str, float]
    notes: tuple[str, ...]

    def step(self, model: str) -> Step:
        """The step of a model's letter."""
        return next(step for step in self.steps if step.model == model)

    @property
    def case(self) -> Case:
        """The case of the diagnosis."""
        return self.diagnosis.attribution.case

    @property
    def state(self) -> State:
        """The corrected sim."""
        return self.diagnosis.state


def study(series: Series, robots: Mapping[str, Any], settings: GapSettings, sheet_file: Path) -> Studied:
    """The series, ingested from the sheet that is written to a parquet file.

    robots: entries of the configuration's `robots:`. Raises ConfigError, IngestError and FitError as these steps do.
    """
    began = time.perf_counter()
    raw = series.read()
    table = sheet(series, raw)
    sheet_file.parent.mkdir(parents=True, exist_ok=True)
    table.to_parquet(sheet_file, index=False)
    nominal = nominal_robot(series, robots)
    spec = {"ingest": str(sheet_file), "frame": "register", "extra_columns": "ignore"}
    if "world_targets" in series.section:
        spec["world_targets"] = series.section["world_targets"]
    ingested = ingest(IngestSpec.from_config(spec), setup.mechanism(nominal))
    measurements = rows.hold_out(ingested.measurements, table[HELD_OUT].to_numpy())
    robot = setup.measured_robot(nominal, measurements)
    noise_mm, noise_rad = stated_noise(series, raw)
    at = {"ingest": time.perf_counter() - began}
    made = _reference(measurements, robot, settings, (noise_mm, noise_rad))
    at |= {step.model: step.seconds for step in made}
    began = time.perf_counter()
    measured = MeasuredRobot(robot, NO_MASSES, noise_mm, series.name, noise_rad)
    found = diagnose(measurements, measured, settings)
    at["gap"] = time.perf_counter() - began
    left = held_out_mm(found.attribution.case, found.state)
    return Studied(series, table, measurements, robot, made, found, left, at, ingested.notes)


def nominal_robot(series: Series, robots: Mapping[str, Any]) -> dict:
    """The nominal robot of a series, as `rrru.studies.setup` takes it: an entry of `robots:`, or a chain's file."""
    section = series.section
    if "chain" in section:
        chain = json.loads((series.file.parent / section["chain"]).read_text())
        name, dimensions = series.dataset, chains.robot_section(chain)
    else:
        name, dimensions = section["robot"], robots[section["robot"]]
    return {"name": name, "dimensions": dimensions, "parameter_set": "full", "registered": True}


def _reference(
    measurements: pd.DataFrame, robot: Robot, settings: GapSettings, noise: tuple[float | None, float | None]
) -> tuple[Step, ...]:
    """The reference models of a series, each fitted to its training rows."""
    nominal = sim(robot)
    arm_mm = nominal.angle_arm_mm if rows.has_turns(measurements) else np.nan
    library = settings.library(nominal)
    case = make_case(measurements, nominal, NO_MASSES, noise[0] or 1.0, library, True, arm_mm)
    if rows.has_turns(measurements):
        case = with_arm(case, *noise)
    return steps(case)
