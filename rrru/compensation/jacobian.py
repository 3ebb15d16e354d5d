"""Two ways from a position error to slider values that compensate it (paper B, 2.3). Lengths in mm."""

import numpy as np


def through_inverse(mechanism, position_mm, error_mm, deviations=None):
    """Actuator values (n, 3) of the corrected positions p - dp through the exact inverse kinematics (eq. 11).

    position_mm, error_mm: (n, 3); deviations (p,): those of the controller's model. NaN where a leg cannot reach.
    """
    return mechanism.inverse(np.asarray(position_mm) - error_mm, deviations)


def through_jacobian(mechanism, position_mm, error_mm):
    """Actuator values (n, 3) of the positions p, less J dp (eq. 12): the first order of `through_inverse`."""
    values = mechanism.inverse(position_mm)
    return values - np.linalg.solve(mechanism.actuator_jacobian(position_mm, values), error_mm[..., None])[..., 0]
