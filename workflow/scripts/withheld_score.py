"""The verdicts of a chunk compared with the truth."""

from rrru.diagnosis.settings import GapSettings
from rrru.store import tables
from rrru.store.job import run
from rrru.studies.blind_validation.robots import all_conditions
from rrru.studies.blind_validation.schemas import TABLES
from rrru.studies.blind_validation.score import Known, score_chunk


def main(settings, inputs, outputs):
    """Write scores, limits, parts of the gaps and statements on causes of the robots of a chunk."""
    frames = {name.removeprefix("withheld_"): tables.read(path) for name, path in inputs.items()}
    gap = GapSettings.from_config(settings["gap"])
    known = {name: Known(one, gap.library(one.mechanism)) for name, one in all_conditions(settings).items()}
    scored = score_chunk(**frames, known=known)
    tables.write_all(TABLES, {f"withheld_{name}": frame for name, frame in scored._asdict().items()}, outputs)


if __name__ == "__main__":
    run(main, snakemake)
