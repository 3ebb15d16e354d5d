"""How many statements of each kind are true, with an example of each."""

from rrru.store import tables
from rrru.store.job import run
from rrru.studies.blind_validation.schemas import TABLES
from rrru.studies.blind_validation.sentences.score import sentences


def main(settings, inputs, outputs):
    """Write the table of sentences."""
    statements = tables.read(inputs["withheld_statements"])
    tables.write_all(TABLES, {"sentences": sentences(statements)}, outputs)


if __name__ == "__main__":
    run(main, snakemake)
