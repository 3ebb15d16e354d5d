"""Diagnosis of one campaign, with its figures."""

from rrru.pipeline.jobs.diagnose import main

__all__ = ["main"]
