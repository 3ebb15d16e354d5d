"""Diagnosis of one campaign, with its figures."""

from rrru.pipeline.jobs.diagnose import main
from rrru.store.job import run

if __name__ == "__main__":
    run(main, snakemake)
