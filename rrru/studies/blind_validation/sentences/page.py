"""The results for a user's files, made by the jobs of the workflow and the command: read, diagnosed, corrected."""

from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from rrru.campaign.ingest.campaign_file import ingest
from rrru.campaign.ingest.spec import IngestSpec
from rrru.diagnosis.diagnose import Diagnosis
from rrru.diagnosis.settings import GapSettings
from rrru.kinematics.dynamics import Masses
from rrru.pipeline import config as parts
from rrru.pipeline import setup
from rrru.pipeline.jobs import diagnose as diagnose_job
from rrru.pipeline.jobs import read as read_job
from rrru.pipeline.read_config import read_config

_CAMPAIGN = "own"


@dataclass(frozen=True)
class Page:
    """The content of a page: facts of `verdict.json`, tables by name, notes from reading the file, what the corrected
    file cannot hold, and the path of that file.
    """

    facts: dict
    tables: dict = field(default_factory=dict)
    read: tuple = ()
    not_in_model: tuple = ()
    corrected: Path | None = None


@dataclass(frozen=True)
class Run:
    """A Page with the input for the truth.

    settings: of the job `diagnose`; measurements: the campaign as it was read; rotation (3, 3), translation_mm (3,):
    from the instrument's frame to the robot's.
    """

    page: Page
    diagnosis: Diagnosis
    settings: dict
    measurements: pd.DataFrame
    rotation: np.ndarray
    translation_mm: np.ndarray

    @property
    def masses(self):
        """The robot's masses as stated."""
        return Masses(**self.settings["masses"])

    def library(self, mechanism):
        """Effects by name that the diagnosis may find in a mechanism."""
        return GapSettings.from_config(self.settings["gap"]).library(mechanism)


@cache
def _defaults():
    """The package's defaults."""
    return read_config()


def _configured(section, robot_section, config, name=_CAMPAIGN):
    """A configuration of one campaign and its robot; config: sections in place of the package's defaults."""
    return {**_defaults(), **config, "robots": {"own": robot_section}, "campaigns": {name: section}}


def read(section, robot_section):
    """The campaign of a section, read from its file as by the job `read`.

    Without the rest of that job: with a stated noise it refuses no more, and it takes longer. Raises IngestError or
    ConfigError where the file is refused.
    """
    nominal = parts.nominal(_configured(section, robot_section, {}), _CAMPAIGN)
    return ingest(IngestSpec.from_config(section), setup.mechanism(nominal))


def run(name, section, robot_section, config):
    """The Run of a campaign's section.

    config: sections of the configuration in place of the package's defaults. Raises the errors with which the jobs end.
    """
    config = _configured(section, robot_section, config, name)
    frames = read_job.read(parts.read_settings(config, name))
    settings, measurements = parts.diagnosis_settings(config, name, section), frames["measurements"]
    file = Path(next(iter(robot_section.values()))).with_name(f"corrected.{parts.corrected_kind(config, section)}")
    result = diagnose_job.with_corrected(settings, diagnose_job.diagnose(settings, measurements), file)
    facts = diagnose_job.facts(settings, result, setup.measured_robot(settings["robot"], measurements))
    notes = frames["campaigns"]["notes"].iloc[0]
    page = Page(facts, result.tables, _parts_of(notes), _parts_of(result.verdict["not_in_model"]), file)
    registration = frames["registration"]["value"]
    moved = np.array(registration) if len(registration) else np.zeros(6)
    rotation = Rotation.from_rotvec(moved[3:]).as_matrix()
    return Run(page, result, settings, measurements, rotation, moved[:3])


def _parts_of(text):
    """The parts of a text between semicolons."""
    return tuple(part for part in text.split("; ") if part)
