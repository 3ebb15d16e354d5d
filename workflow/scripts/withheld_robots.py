"""The robots of a chunk drawn and driven: the answers, and all that the diagnosis is given."""

import pandas as pd

from rrru.store import tables
from rrru.store.job import run
from rrru.studies.withheld.chunks import Member
from rrru.studies.withheld.draw import draw
from rrru.studies.withheld.robots import Conditions
from rrru.studies.withheld.schemas import TABLES


def main(settings, inputs, outputs):
    """Write answers and measurements of a chunk, one robot below the other."""
    conditions = Conditions.from_config(settings)
    robots = [draw(Member(*member), conditions) for member in settings["members"]]
    driven = [robot.measured(conditions).assign(robot=robot.name, kind=robot.kind) for robot in robots]
    frames = {
        "withheld_answers": pd.DataFrame([robot.answer(conditions) for robot in robots]),
        "withheld_measurements": pd.concat(driven, ignore_index=True),
    }
    tables.write_all(TABLES, frames, outputs)


if __name__ == "__main__":
    run(main, snakemake)
