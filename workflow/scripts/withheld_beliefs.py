"""Answers of the diagnosis and of other methods on robots of a chunk, from their measurements alone."""

import pandas as pd

from rrru.diagnosis.diagnose import MeasuredRobot
from rrru.diagnosis.settings import GapSettings
from rrru.kinematics.dynamics import Masses
from rrru.pipeline import setup
from rrru.store import tables
from rrru.store.job import run
from rrru.studies.blind_validation.rivals import beliefs
from rrru.studies.blind_validation.schemas import TABLES


def main(settings, inputs, outputs):
    """Write the answers on the chosen robots of a chunk."""
    gap = GapSettings.from_config(settings["gap"], settings["seed"])
    robot, masses = setup.mechanism(settings["robot"]), Masses(**settings["masses"])
    measured = tables.read(inputs["withheld_measurements"]).drop(columns="kind").groupby("robot")
    said = []
    for name in settings["robots"]:
        points = measured.get_group(name).drop(columns="robot").reset_index(drop=True)
        said.append(beliefs(points, MeasuredRobot(robot, masses, settings["withheld"]["noise_mm"], name), gap))
    tables.write_all(TABLES, {"withheld_beliefs": pd.concat(said, ignore_index=True)}, outputs)


if __name__ == "__main__":
    run(main, snakemake)
