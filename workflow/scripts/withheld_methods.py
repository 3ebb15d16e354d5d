"""Answers of the diagnosis and of other methods compared with the truth."""

import pandas as pd

from rrru.store import tables
from rrru.store.job import run
from rrru.studies.blind_validation.schemas import TABLES
from rrru.studies.blind_validation.summary import compare_methods


def main(settings, inputs, outputs):
    """Write the table of methods."""
    said, answers = (
        pd.concat([tables.read(path) for path in inputs[name]], ignore_index=True)
        for name in ("withheld_beliefs", "withheld_answers")
    )
    tables.write_all(TABLES, {"withheld_methods": compare_methods(said, answers)}, outputs)


if __name__ == "__main__":
    run(main, snakemake)
