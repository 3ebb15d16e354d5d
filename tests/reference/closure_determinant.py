"""Determinant of the spatial closure's Jacobian: what both kinds of singularity must be seen in."""

import numpy as np

from rrru.plant import spatial


def closure_determinant(geometry, theta_rad, passive_rad):
    """Determinant (n,) of the 12 x 12 Jacobian at angles (n, 3), (n, 3, 4); lengths count in units of 500 mm."""
    parts = [np.ascontiguousarray(part, dtype=float) for part in geometry.fixed_parts]
    jacobian, residual, result = np.empty((12, 12)), np.empty(12), []
    for theta, passive in zip(theta_rad, passive_rad, strict=True):
        spatial._closure(
            *parts,
            *(geometry.lengths_mm, theta.copy(), passive.ravel(), np.zeros((3, 3))),
            *(jacobian, residual, np.empty((3, 3, 3)), np.empty((3, 3))),
        )
        assert np.abs(residual).max() < 1e-6
        result.append(np.linalg.det(jacobian / 500.0))
    return np.array(result)
