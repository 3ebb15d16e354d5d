"""The results for a user's files as in the workflow: campaign read and diagnosed, robot file corrected."""

from dataclasses import dataclass, field
from pathlib import Path

from rrru.campaign.ingest.campaign_file import Ingested, ingest
from rrru.campaign.ingest.spec import IngestSpec
from rrru.diagnosis.correction.corrected_model import write_corrected
from rrru.diagnosis.diagnose import Diagnosis, MeasuredRobot, diagnose
from rrru.diagnosis.verdict_text import answer
from rrru.kinematics.dynamics import Masses
from rrru.pipeline import campaigns, setup
from rrru.pipeline import config as parts
from rrru.robots.drive_words import drive_words

_CORRECTED = {"urdf": "corrected.urdf", "mjcf": "corrected.xml"}


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
    """A Page with the input for the truth: the diagnosis, its masses, and the campaign as it was read."""

    page: Page
    diagnosis: Diagnosis
    masses: Masses
    ingested: Ingested
    noise_mm: float


def nominal_part(section, robot_section):
    """The part of the configuration for the nominal robot of a campaign's section."""
    return parts.robot({"robots": {"own": robot_section}}, section)


def read(section, robot_section):
    """The campaign of a section as read; raises IngestError or ConfigError where it is refused."""
    return ingest(IngestSpec.from_config(section), setup.mechanism(nominal_part(section, robot_section)))


def run(name, section, robot_section, settings):
    """The Run of a campaign's section.

    settings: `gap`, a GapSettings; `margin`, of singularities. Raises the errors with which the workflow ends.
    """
    nominal = nominal_part(section, robot_section)
    ingested, gap = read(section, robot_section), settings["gap"]
    robot = setup.mechanism(nominal)
    measurements, _ = campaigns.with_singularities(robot, ingested.measurements, settings["margin"])
    known = setup.measured_robot(nominal, measurements)
    masses = Masses(**parts.masses({"loads": {}, "robots": {"own": robot_section}}, section))
    measured = MeasuredRobot(known, masses, section.get("noise_mm"), name, section.get("noise_rad"))
    result = diagnose(measurements, measured, gap)
    kind = "urdf" if "urdf" in robot_section else "mjcf"
    file = Path(robot_section[kind]).with_name(_CORRECTED[kind])
    result = write_corrected(result, robot_section, masses, file)
    facts = answer(name, result.verdict, result.tables, drive_words(known))
    lost = tuple(text for text in result.verdict["not_in_model"].split("; ") if text)
    page = Page(facts, result.tables, tuple(ingested.notes), lost, file)
    return Run(page, result, masses, ingested, section.get("noise_mm"))
