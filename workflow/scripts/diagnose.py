"""Diagnosis of one campaign's gap between calibrated model and measurements, with its figures."""

import pandas as pd

from rrru.campaign.noise import read_noise
from rrru.diagnosis.design.run_limits import StatedLimits
from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.schemas import TABLES, tables_of
from rrru.diagnosis.settings import GapSettings
from rrru.diagnosis.verdict_text import answer
from rrru.figures.drawing import draw_all
from rrru.kinematics.dynamics import Masses
from rrru.robots.drive_words import drive_words
from rrru.store import json_files, tables
from rrru.store.job import run
from rrru.studies import setup


def main(settings, inputs, outputs):
    """Write the verdict, its tables and its figures."""
    measurements, masses = tables.read(inputs["measurements"]), Masses(**settings["masses"])
    nominal = setup.measured_robot(settings["robot"], measurements)
    noise = {key: settings[key] for key in ("noise_mm", "noise_rad", "noise_known")}
    if noise["noise_mm"] is None:
        noise["noise_mm"] = read_noise(measurements)
    limits = StatedLimits.from_config(settings["limits"])
    robot = MeasuredRobot(nominal, masses, campaign=settings["campaign"], limits=limits, **noise)
    chosen = GapSettings.from_config(settings["gap"], settings["seed"], settings["use_near_singularity"])
    result = diagnose(measurements, robot, chosen)
    if "corrected" in outputs:
        # MuJoCo is loaded only where a file is written
        from rrru.diagnosis.correction.corrected_model import write_corrected

        result = write_corrected(
            result, settings["robot"]["dimensions"], masses, outputs["corrected"], settings["seed"]
        )
    words = drive_words(nominal)
    facts = answer(settings["campaign"], result.verdict, result.tables, words)
    json_files.write(facts, outputs["verdict"])
    frames = {"gap_verdicts": pd.DataFrame([result.verdict]), **result.tables}
    keys = {table.name: table.key for table in TABLES}
    frames = {
        name: frame.assign(campaign=settings["campaign"]) if "campaign" in keys[name] else frame
        for name, frame in frames.items()
    }
    tables.write_all(tables_of(nominal), frames, outputs)
    options = settings["options"] | {"z_down": nominal.z_down, "drives": words.all_names, "drive_noun": words.noun}
    draw_all(settings["figures"], {name: outputs[name] for name in frames}, options, outputs)


if __name__ == "__main__":
    run(main, snakemake)
