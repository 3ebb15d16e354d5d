"""The robots of a chunk driven and measured: all that the diagnosis is given."""

import pandas as pd

from rrru.store import tables
from rrru.store.job import run
from rrru.studies.withheld.robots import Robot, measure, nominal
from rrru.studies.withheld.schemas import TABLES


def main(settings, inputs, outputs):
    """Write the measurements of the robots of a chunk, one below the other."""
    mechanism = nominal(settings["robots"])
    frames = []
    for text in tables.read(inputs["withheld_answers"])["drawn"]:
        robot = Robot.from_json(text)
        frames.append(measure(robot, settings["seed"], mechanism).assign(robot=robot.name, kind=robot.kind))
    tables.write_all(TABLES, {"withheld_measurements": pd.concat(frames, ignore_index=True)}, outputs)


if __name__ == "__main__":
    run(main, snakemake)
