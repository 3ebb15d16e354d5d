"""The instrument: a laser tracker that sees a target at the platform's centre."""

import numpy as np


def measure(position_mm, noise_mm, generator):
    """Positions (n, 3) with independent normal noise of `noise_mm` (1 sigma per axis, mm) from a numpy Generator."""
    return np.asarray(position_mm, dtype=float) + noise_mm * generator.standard_normal(np.shape(position_mm))
