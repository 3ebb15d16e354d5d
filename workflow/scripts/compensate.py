"""Every calibration of one campaign applied to all its trajectories."""

from rrru.pipeline.jobs.compensate import main

__all__ = ["main"]
