"""The verdicts of a chunk beside the answers."""

from rrru.gap.settings import GapSettings
from rrru.store import tables
from rrru.store.job import job
from rrru.studies.withheld import score
from rrru.studies.withheld.robots import nominal


def main(config, check, inputs, outputs):
    """Write scores and limits of the robots of a chunk."""
    frames = {name: tables.read(inputs[name]) for name in ("answers", "measurements", "verdicts", "states")}
    library = GapSettings.from_config(config["gap"]).library()
    scores, limits = score.score_chunk(
        check, config["seed"], **frames, mechanism=nominal(config["robots"]), library=library
    )
    tables.write("withheld_scores", scores, outputs["scores"])
    tables.write("withheld_limits", limits, outputs["limits"])


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.config, snakemake.params.robots[0], snakemake.input, snakemake.output)
