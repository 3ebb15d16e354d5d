"""The genetic algorithm on all calibration sets of a campaign."""

from rrru.pipeline.jobs.genetic import main
from rrru.store.job import run

if __name__ == "__main__":
    run(main, snakemake)
