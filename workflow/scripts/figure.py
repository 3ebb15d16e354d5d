"""Figures of the study as PDF and PNG."""

from rrru.report import tables
from rrru.report.figures import FIGURES, style
from rrru.report.job import job


def main(names, inputs, outputs, options):
    """Draw the named figures from the tables that they need; the outputs are a PDF and a PNG of each in turn."""
    for name, pdf, png in zip(names, outputs[::2], outputs[1::2], strict=True):
        draw, needed, _ = FIGURES[name]
        style.save(draw({table: tables.read(inputs[table]) for table in needed}, options), pdf, png)


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.params.figures, snakemake.input, list(snakemake.output), snakemake.params.options)
