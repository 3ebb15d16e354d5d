"""The robots of a chunk drawn and driven: the truth, and the input of the diagnosis."""

import pandas as pd

from rrru.store import tables
from rrru.store.job import run
from rrru.studies.blind_validation.chunks import Member
from rrru.studies.blind_validation.draw import drawn
from rrru.studies.blind_validation.robots import all_conditions
from rrru.studies.blind_validation.schemas import tables_of


def main(settings, inputs, outputs):
    """Write answers and measurements of a chunk, concatenated over the robots."""
    conditions, answers, driven = all_conditions(settings), [], []
    for member in map(Member._make, settings["members"]):
        robot, measurements = drawn(member, conditions[member.file])
        answers.append(robot.answer(conditions[member.file]))
        driven.append(measurements.assign(robot=robot.name, kind=robot.kind))
    frames = {
        "withheld_answers": pd.DataFrame(answers),
        "withheld_measurements": pd.concat(driven, ignore_index=True),
    }
    names = frames["withheld_measurements"].columns
    # the drives are those of all robots of the chunk
    tables.write_all(tables_of(conditions[member.file].mechanism, names), frames, outputs)


if __name__ == "__main__":
    run(main, snakemake)
