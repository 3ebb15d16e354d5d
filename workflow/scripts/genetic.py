"""The genetic algorithm on all calibration sets of a campaign."""

from rrru.pipeline.jobs.genetic import main

__all__ = ["main"]
