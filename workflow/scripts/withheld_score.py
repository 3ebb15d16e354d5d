"""The verdicts of a chunk beside the answers."""

from rrru.gap.settings import GapSettings
from rrru.store import tables
from rrru.store.job import run
from rrru.studies.withheld.robots import Conditions
from rrru.studies.withheld.schemas import TABLES
from rrru.studies.withheld.score import score_chunk


def main(settings, inputs, outputs):
    """Write scores, limits and parts of the gaps of the robots of a chunk."""
    frames = {name.removeprefix("withheld_"): tables.read(path) for name, path in inputs.items()}
    conditions = Conditions.from_config(settings)
    library = GapSettings.from_config(settings["gap"]).library(conditions.mechanism)
    scored = score_chunk(**frames, conditions=conditions, library=library)
    tables.write_all(TABLES, {f"withheld_{name}": frame for name, frame in scored._asdict().items()}, outputs)


if __name__ == "__main__":
    run(main, snakemake)
