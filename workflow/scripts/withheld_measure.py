"""The robots of a chunk driven and measured: all that the diagnosis is given."""

import pandas as pd

from rrru.store import tables
from rrru.store.job import job
from rrru.studies.withheld.robots import Robot, measure, nominal


def main(config, answers, output):
    """Write the measurements of the robots of a chunk, one below the other."""
    mechanism = nominal(config["robots"])
    frames = []
    for text in tables.read(answers)["drawn"]:
        robot = Robot.from_json(text)
        frames.append(measure(robot, config["seed"], mechanism).assign(robot=robot.name, kind=robot.kind))
    tables.write("withheld_measurements", pd.concat(frames, ignore_index=True), output)


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.config, snakemake.input.answers, snakemake.output.measurements)
