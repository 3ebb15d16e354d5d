"""Every calibration of one campaign applied to all its trajectories."""

from rrru.pipeline.jobs.compensate import main
from rrru.store.job import run

if __name__ == "__main__":
    run(main, snakemake)
