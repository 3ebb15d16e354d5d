"""Kinematics, singularities, backlash and repeatability of paper B's robot."""

from rrru.store import tables
from rrru.store.job import run
from rrru.studies.ptt3 import bench
from rrru.studies.ptt3.schemas import TABLES


def main(settings, inputs, outputs):
    """Write the tables of all that comes before the experiments."""
    encoder, backlash = bench.backlash(settings)
    frames = {
        "ptt_kinematics": bench.kinematics(settings),
        "ptt_singularity": bench.singularity(settings),
        "ptt_encoder": encoder,
        "ptt_backlash": backlash,
        "ptt_repeatability": bench.repeatabilities(settings, backlash),
    }
    tables.write_all(TABLES, frames, outputs)


if __name__ == "__main__":
    run(main, snakemake)
