"""The verdicts of a chunk beside the answers."""

from rrru.gap.settings import GapSettings
from rrru.store import tables
from rrru.store.job import run
from rrru.studies.withheld import score
from rrru.studies.withheld.robots import nominal
from rrru.studies.withheld.schemas import TABLES


def main(settings, inputs, outputs):
    """Write scores and limits of the robots of a chunk."""
    frames = {name.removeprefix("withheld_"): tables.read(path) for name, path in inputs.items()}
    library = GapSettings.from_config(settings["gap"]).library()
    mechanism = nominal(settings["robots"])
    scores, limits = score.score_chunk(
        settings["check"], settings["seed"], **frames, mechanism=mechanism, library=library
    )
    tables.write_all(TABLES, {"withheld_scores": scores, "withheld_limits": limits}, outputs)


if __name__ == "__main__":
    run(main, snakemake)
