"""The robots of a chunk drawn: the answers that the diagnosis must not see."""

import pandas as pd

from rrru.store import tables
from rrru.store.job import job
from rrru.studies.withheld import draw
from rrru.studies.withheld.robots import answer, nominal


def main(config, robots, output):
    """Write the answers of a chunk; robots: check, effect taken out, first number, number after the last."""
    check, effect, first, end = robots
    mechanism = nominal(config["robots"])
    rows = []
    for number in range(first, end):
        if check == "effect":
            robot = draw.draw_single(config["seed"], effect, number, mechanism)
        else:
            robot = draw.draw_labelled(config["seed"], number, mechanism)
        rows.append(answer(robot, mechanism))
    tables.write("withheld_answers", pd.DataFrame(rows), output)


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.config, snakemake.params.robots, snakemake.output.answers)
