"""One table for the whole study out of the same table of every part."""

import pandas as pd

from rrru.report import tables
from rrru.report.job import job


def main(name, inputs, output):
    """Write the parts, one below the other, as one table."""
    parts = [tables.read(path) for path in inputs]
    filled = [part for part in parts if len(part)] or parts[:1]
    tables.write(name, pd.concat(filled, ignore_index=True), output)


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.params.table, list(snakemake.input), snakemake.output[0])
