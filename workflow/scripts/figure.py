"""One figure of the study as PDF and PNG."""

from rrru.errors import ConfigError
from rrru.report import tables
from rrru.report.figures import FIGURES, style
from rrru.report.job import job


def main(name, inputs, outputs, options):
    """Read the tables that the named figure needs, draw it and write both files."""
    if name not in FIGURES:
        raise ConfigError(f"there is no figure {name!r}; known: {', '.join(FIGURES)}")
    draw, names, _ = FIGURES[name]
    frames = {table: tables.read(inputs[table]) for table in names}
    style.save(draw(frames, options), outputs["pdf"], outputs["png"])


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.wildcards.figure, snakemake.input, snakemake.output, snakemake.params.options)
