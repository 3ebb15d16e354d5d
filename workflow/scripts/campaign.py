"""One campaign, driven by a virtual robot or read from a file."""

from rrru.pipeline.jobs.read import main

__all__ = ["main"]
