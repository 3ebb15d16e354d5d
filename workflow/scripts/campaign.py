"""One campaign, driven by a virtual robot or read from a file."""

from rrru.pipeline.jobs.read import main
from rrru.store.job import run

if __name__ == "__main__":
    run(main, snakemake)
