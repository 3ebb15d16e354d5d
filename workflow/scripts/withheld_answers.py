"""The robots of a chunk drawn: the answers that the diagnosis must not see."""

import pandas as pd

from rrru.store import tables
from rrru.store.job import run
from rrru.studies.withheld import draw
from rrru.studies.withheld.robots import answer, nominal
from rrru.studies.withheld.schemas import TABLES


def main(settings, inputs, outputs):
    """Write the answers of a chunk."""
    mechanism, seed = nominal(settings["robots"]), settings["seed"]
    rows = []
    for number in range(settings["first"], settings["end"]):
        if settings["check"] == "effect":
            robot = draw.draw_single(seed, settings["effect"], number, mechanism)
        else:
            robot = draw.draw_labelled(seed, number, mechanism)
        rows.append(answer(robot, mechanism))
    tables.write_all(TABLES, {"withheld_answers": pd.DataFrame(rows)}, outputs)


if __name__ == "__main__":
    run(main, snakemake)
