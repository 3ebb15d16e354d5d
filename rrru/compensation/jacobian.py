"""Two ways from a position error to slider values that compensate it (paper B, 2.3). Lengths in mm."""

import numpy as np
import numpy.typing as npt

from rrru.arrays import FloatArray
from rrru.kinematics.robot import Robot


def through_inverse(
    mechanism: Robot, position_mm: npt.ArrayLike, error_mm: FloatArray, deviations: FloatArray | None = None
) -> FloatArray:
    """Actuator values (n, 3) of the corrected positions p - dp through the exact inverse kinematics (eq. 11).

    position_mm, error_mm: (n, 3); deviations (p,): those of the controller's model. NaN where a leg cannot reach.
    """
    return mechanism.inverse(np.asarray(position_mm) - error_mm, deviations)


def through_jacobian(mechanism: Robot, position_mm: FloatArray, error_mm: FloatArray) -> FloatArray:
    """Actuator values (n, 3) of the positions p, less J dp (eq. 12): the first order of `through_inverse`."""
    values = mechanism.inverse(position_mm)
    return values - np.linalg.solve(mechanism.actuator_jacobian(position_mm, values), error_mm[..., None])[..., 0]
