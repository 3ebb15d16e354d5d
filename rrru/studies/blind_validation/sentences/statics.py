"""Loads of weight on drives from the potential energy alone. Lengths mm, angles rad, N."""

import numpy as np

G = 9.80665
# steps of central differences
_STEP = {"mm": 1e-2, "rad": 1e-5}


def drive_loads(energy, values, units):
    """Torques in N mm or forces in N (n, K) on the drives at their positions (n, K): minus the energy gradient.

    energy: from actuator positions to potential energies (n,) in N mm; units (K,): "mm" or "rad".
    """
    result = np.empty_like(values)
    for k, unit in enumerate(units):
        step = _STEP[unit] * np.eye(len(units))[k]
        result[:, k] = (energy(values - step) - energy(values + step)) / (2.0 * _STEP[unit])
    return result
