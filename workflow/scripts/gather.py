"""Tables for the whole study out of the same tables of its parts."""

import pandas as pd

from rrru.store import tables
from rrru.store.job import job


def main(inputs, outputs):
    """Write every table as its parts, one below the other."""
    for name, output in outputs.items():
        parts = [tables.read(path) for path in inputs[name]]
        filled = [part for part in parts if len(part)] or parts[:1]
        tables.write(name, pd.concat(filled, ignore_index=True), output)


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(dict(snakemake.input.items()), dict(snakemake.output.items()))
