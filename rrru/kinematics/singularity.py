"""Distance of a mechanism from its two kinds of singularity.

A locked drive lets leg i move the platform only across g_i, the unit gradient of its closure, and keeps it from turning
about b_i, its constraint moment. The rows g_i make the translational measure, the rows b_i the constraint measure:
each is the smallest singular value of a matrix of three unit rows, 0 at a singularity and 1 at best. The closure
equations of a platform that only translates do not show the second kind.
"""

from typing import Protocol

import numpy as np

from rrru.arrays import FloatArray
from rrru.kinematics.parameter_jacobian import singular_values


class ThreeLegged(Protocol):
    """A mechanism whose three legs have one closure each."""

    def closure_jacobians(
        self, position_mm: FloatArray, actuators: FloatArray, deviations: FloatArray | None = None, /
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives of the closures by the position (n, 3, 3) and by the legs' numbers (n, 3, k)."""

    def constraint_moments(self, position_mm: FloatArray, actuators: FloatArray, /) -> FloatArray:
        """Unit directions (n, 3 legs, 3) about which each leg keeps the platform from turning."""


def leg_forces(
    mechanism: ThreeLegged, position_mm: FloatArray, actuators: FloatArray, deviations: FloatArray | None = None
) -> FloatArray:
    """Unit directions (n, 3 legs, 3) in which each leg pushes the platform: rows of the normalised closure Jacobian."""
    gradient, _ = mechanism.closure_jacobians(position_mm, actuators, deviations)
    return np.asarray(gradient / np.linalg.norm(gradient, axis=-1, keepdims=True))


def translational_measure(
    mechanism: ThreeLegged, position_mm: FloatArray, actuators: FloatArray, deviations: FloatArray | None = None
) -> FloatArray:
    """Smallest singular value (n,) of the legs' forces; 0 where the platform can move with all drives locked."""
    return singular_values(leg_forces(mechanism, position_mm, actuators, deviations))[:, -1]


def constraint_measure(mechanism: ThreeLegged, position_mm: FloatArray, actuators: FloatArray) -> FloatArray:
    """Smallest singular value (n,) of the constraint moments; 0 where the platform can turn with all drives locked."""
    return singular_values(mechanism.constraint_moments(position_mm, actuators))[:, -1]


def constraint_determinant(mechanism: ThreeLegged, position_mm: FloatArray, actuators: FloatArray) -> FloatArray:
    """Determinant (n,) of the constraint moments; its sign changes across a constraint singularity."""
    return np.asarray(np.linalg.det(mechanism.constraint_moments(position_mm, actuators)))
