"""Calibrations of one campaign on every set of trajectories."""

from rrru.pipeline.jobs.calibrate import main

__all__ = ["main"]
