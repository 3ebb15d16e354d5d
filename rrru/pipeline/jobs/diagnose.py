"""Diagnosis of one campaign's gap between calibrated model and measurements, with its figures."""

from collections.abc import Callable, Collection, Mapping
from typing import Any

import pandas as pd

from rrru.campaign.noise import read_noise
from rrru.diagnosis import diagnose as core
from rrru.diagnosis.design.run_limits import StatedLimits
from rrru.diagnosis.schemas import TABLES, tables_of
from rrru.diagnosis.settings import GapSettings
from rrru.diagnosis.verdict_facts import answer
from rrru.figures.drawing import FigureRequest, draw_all, requests
from rrru.figures.files import KINDS
from rrru.kinematics.dynamics import Masses
from rrru.kinematics.robot import Robot
from rrru.pipeline import setup
from rrru.robots.drive_words import drive_words
from rrru.store import json_files, tables


def main(settings: Mapping[str, Any], inputs: Mapping[str, str], outputs: Mapping[str, str]) -> None:
    """Write the verdict, its tables and its figures."""
    measurements = tables.read(inputs["measurements"])
    result = diagnose(settings, measurements)
    if "corrected" in outputs:
        result = with_corrected(settings, result, outputs["corrected"])
    nominal = setup.measured_robot(settings["robot"], measurements)
    write(settings, result, nominal, outputs)
    draw_all(figures(settings, nominal, outputs))


def diagnose(
    settings: Mapping[str, Any], measurements: pd.DataFrame, progress: Callable[[str], None] | None = None
) -> core.Diagnosis:
    """The `rrru.diagnosis.diagnose.Diagnosis` of a campaign's measurement table.

    progress: called with the name of each step before it begins. Raises FitError where the readings do not determine
    the calibration, and ConfigError for settings that do not fit together.
    """
    noise = {key: settings[key] for key in ("noise_mm", "noise_rad", "noise_known")}
    if noise["noise_mm"] is None:
        noise["noise_mm"] = read_noise(measurements)
    robot = core.MeasuredRobot(
        setup.measured_robot(settings["robot"], measurements),
        Masses(**settings["masses"]),
        campaign=settings["campaign"],
        limits=StatedLimits.from_config(settings["limits"]),
        **noise,
    )
    chosen = GapSettings.from_config(settings["gap"], settings["seed"], settings["use_near_singularity"])
    return core.diagnose(measurements, robot, chosen, progress=progress)


def with_corrected(settings: Mapping[str, Any], result: core.Diagnosis, path: str) -> core.Diagnosis:
    """The Diagnosis with what its robot's corrected file leaves; writes the file to a path."""
    # MuJoCo is loaded only where a file is written
    from rrru.diagnosis.correction.corrected_model import write_corrected

    masses = Masses(**settings["masses"])
    corrected: core.Diagnosis = write_corrected(result, settings["robot"]["dimensions"], masses, path, settings["seed"])
    return corrected


def facts(settings: Mapping[str, Any], result: core.Diagnosis, nominal: Robot) -> dict[str, Any]:
    """The answer of a Diagnosis as the mapping of `verdict.json`; nominal: the robot as measured."""
    answers: dict[str, Any] = answer(settings["campaign"], result.verdict, result.tables, drive_words(nominal))
    return answers


def frames_of(settings: Mapping[str, Any], result: core.Diagnosis) -> dict[str, pd.DataFrame]:
    """Frames of a Diagnosis by table name, with the campaign's name."""
    frames = {"gap_verdicts": pd.DataFrame([result.verdict]), **result.tables}
    keys = {table.name: table.key for table in TABLES}
    return {
        name: frame.assign(campaign=settings["campaign"]) if "campaign" in keys[name] else frame
        for name, frame in frames.items()
    }


def write(settings: Mapping[str, Any], result: core.Diagnosis, nominal: Robot, paths: Mapping[str, str]) -> None:
    """Write verdict and tables of a Diagnosis to paths by name; nominal: the robot as measured."""
    json_files.write(facts(settings, result, nominal), paths["verdict"])
    tables.write_all(tables_of(nominal), frames_of(settings, result), paths)


def figures(
    settings: Mapping[str, Any], nominal: Robot, paths: Mapping[str, str], kinds: Collection[str] = KINDS
) -> list[FigureRequest]:
    """Figures of a Diagnosis from the tables that `write` has written; kinds: of the files, see `requests`."""
    return requests(settings["figures"], paths, figure_options(settings, nominal), paths, kinds)


def figure_options(settings: Mapping[str, Any], nominal: Robot) -> dict[str, Any]:
    """Options of the figures of a diagnosis; nominal: the robot as measured."""
    words = drive_words(nominal)
    options: dict[str, Any] = settings["options"] | {
        "z_down": nominal.z_down,
        "drives": words.all_names,
        "drive_noun": words.noun,
    }
    return options
