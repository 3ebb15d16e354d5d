"""Calibration and sim-to-real diagnosis of parallel robots."""
