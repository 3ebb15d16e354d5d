"""Calibrations of one campaign on every set of trajectories."""

from rrru.pipeline.jobs.calibrate import main
from rrru.store.job import run

if __name__ == "__main__":
    run(main, snakemake)
