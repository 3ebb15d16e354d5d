"""Figures of the study as PDF and PNG."""

from rrru.figures import style
from rrru.figures.catalogue import FIGURES
from rrru.store import tables
from rrru.store.job import job


def main(names, inputs, outputs, options):
    """Draw the named figures from the tables that they need; the outputs are a PDF and a PNG of each in turn."""
    for name, pdf, png in zip(names, outputs[::2], outputs[1::2], strict=True):
        draw, needed, _ = FIGURES[name]
        style.save(draw({table: tables.read(inputs[table]) for table in needed}, options), pdf, png)


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.params.figures, snakemake.input, list(snakemake.output), snakemake.params.options)
