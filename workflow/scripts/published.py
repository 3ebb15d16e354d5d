"""Paper A's numbers beside this study's, and the audit of its misprints."""

from rrru.report import tables
from rrru.report.job import job
from rrru.reproduce.audit import audit_table
from rrru.reproduce.published import published_table


def main(config, inputs, outputs):
    """Write both tables."""
    frames = [tables.read(inputs[name]) for name in ("errors", "parameters", "genetic", "sweep_runs")]
    tables.write("published", published_table(config, *frames), outputs["published"])
    tables.write("audit", audit_table(), outputs["audit"])


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.config, snakemake.input, snakemake.output)
