"""Kinematics, singularities, backlash and repeatability of paper B's robot."""

from rrru.store import tables
from rrru.store.job import job
from rrru.studies.ptt3 import bench


def main(config, outputs):
    """Write the tables of all that comes before the experiments."""
    encoder, backlash = bench.backlash(config)
    frames = {
        "ptt_kinematics": bench.kinematics(config),
        "ptt_singularity": bench.singularity(config),
        "ptt_encoder": encoder,
        "ptt_backlash": backlash,
        "ptt_repeatability": bench.repeatabilities(config, backlash),
    }
    for name, frame in frames.items():
        tables.write(name, frame, outputs[name])


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.config, snakemake.output)
