"""How far the 3-RRRU is from its two kinds of singularity.

A locked drive lets leg i move the platform only across g_i, the unit gradient of its closure (eq. 8), and keeps it from turning about
b_i = t_i x a_3i, where t_i is the direction of joints 1, 2 and 5 and a_3i that of joints 3 and 4; b_i points from joint 2 along the
link L2. The rows g_i make the translational measure, the rows b_i the constraint measure: each is the smallest singular value of a
matrix of three unit rows, 0 at a singularity and 1 at best. Eq. (8) does not see the second kind.
"""

import numpy as np


def leg_forces(mechanism, position_mm, theta_rad, errors=None):
    """Unit directions (n, 3 legs, 3) in which each leg pushes the platform: rows of the normalised closure Jacobian."""
    gradient, _ = mechanism.closure_jacobians(position_mm, theta_rad, errors)
    return gradient / np.linalg.norm(gradient, axis=-1, keepdims=True)


def leg_couples(mechanism, position_mm, theta_rad, errors=None):
    """Unit directions (n, 3 legs, 3) about which each leg keeps the platform from turning."""
    passive = mechanism.passive_angles(position_mm, theta_rad, errors)
    plane = np.asarray(theta_rad, dtype=float) + mechanism.legs(errors)[:, 0] + passive[..., 0]
    cx, cy = mechanism.turn
    return np.stack([np.cos(plane) * cx, np.cos(plane) * cy, np.sin(plane)], axis=-1)


def translational_measure(mechanism, position_mm, theta_rad, errors=None):
    """Smallest singular value (n,) of the three unit force directions; 0 where the platform can move with all drives locked."""
    return _smallest_singular_value(leg_forces(mechanism, position_mm, theta_rad, errors))


def constraint_measure(mechanism, position_mm, theta_rad, errors=None):
    """Smallest singular value (n,) of the three unit couple directions; 0 where the platform can turn with all drives locked."""
    return _smallest_singular_value(leg_couples(mechanism, position_mm, theta_rad, errors))


def constraint_determinant(mechanism, position_mm, theta_rad, errors=None):
    """Determinant (n,) of the couple directions; its sign changes across a constraint singularity."""
    return np.linalg.det(leg_couples(mechanism, position_mm, theta_rad, errors))


def _smallest_singular_value(matrices):
    """Smallest singular value (n,) of (n, 3, 3) matrices, NaN where the pose cannot be reached."""
    result = np.full(len(matrices), np.nan)
    fine = np.isfinite(matrices).all(axis=(1, 2))
    if fine.any():
        result[fine] = np.linalg.svd(matrices[fine], compute_uv=False)[:, -1]
    return result
