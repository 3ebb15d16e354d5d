"""Sentences and numbers of own robots' pages, and gross mistakes in files, of a chunk, each compared with the truth."""

from rrru.store import tables
from rrru.store.job import run
from rrru.studies.blind_validation.schemas import TABLES
from rrru.studies.blind_validation.sentences.score import settings_of, statements


def main(settings, inputs, outputs):
    """Write the statements of a chunk."""
    check, first, end = settings["chunk"]
    rows = statements(check, range(first, end), settings_of(settings))
    tables.write_all(TABLES, {"withheld_statements": rows}, outputs)


if __name__ == "__main__":
    run(main, snakemake)
