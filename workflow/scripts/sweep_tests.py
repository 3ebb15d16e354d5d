"""Whether the swept settings' effects can be told from the seeds' scatter."""

from rrru.calibrate.sweep import setting_effect, setting_pairs
from rrru.report import tables
from rrru.report.job import job


def main(seed, inputs, outputs):
    """Write the tests over all values and of every value against the best."""
    runs = tables.read(inputs["sweep_runs"])
    tables.write("sweep_effect", setting_effect(runs), outputs["sweep_effect"])
    tables.write("sweep_pairs", setting_pairs(runs, seed), outputs["sweep_pairs"])


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.config["seed"], snakemake.input, snakemake.output)
