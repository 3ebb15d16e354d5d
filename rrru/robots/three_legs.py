"""What all mechanisms here share: three legs, each with one closure, and a platform that follows them. Lengths in mm,
angles in rad.
"""

from functools import cached_property

import numpy as np

from rrru.errors import UnreachableError


class ThreeLegs:
    """Base of the mechanisms: they add `inverse`, `closure_jacobians`, `azimuth_rad`, `nominal_legs` and `leg_map`.

    nominal_legs (3, k): numbers of the legs without errors, the first what an actuator's value adds to; leg_map (3, k,
    p): their derivative by the errors.
    """

    @cached_property
    def turn(self):
        """Cosines and sines of the legs' azimuths, shape (2, 3)."""
        return np.array([np.cos(self.azimuth_rad), np.sin(self.azimuth_rad)])

    def legs(self, deviations=None):
        """Numbers of the legs, shape (..., 3, k), under errors of shape (..., p)."""
        if deviations is None:
            return self.nominal_legs
        return self.nominal_legs + np.einsum("lcp,...p->...lc", self.leg_map, np.asarray(deviations, dtype=float))

    def require_reachable(self, position_mm, deviations=None):
        """Actuator values as `inverse` gives them; raises UnreachableError naming the first point out of reach."""
        values = self.inverse(position_mm, deviations)
        bad = np.flatnonzero(np.isnan(values).any(axis=1))
        if bad.size:
            point = np.asarray(position_mm, dtype=float)[bad[0]]
            legs = ", ".join(str(i + 1) for i in np.flatnonzero(np.isnan(values[bad[0]])))
            raise UnreachableError(
                f"point {bad[0] + 1} at ({point[0]:.3f}, {point[1]:.3f}, {point[2]:.3f}) mm is out of reach of leg {legs}; "
                f"{bad.size} of {len(values)} points cannot be reached"
            )
        return values

    def leg_jacobian(self, position_mm, actuators, deviations=None):
        """Derivative of the position with respect to the legs' numbers, shape (n, 3 axes, 3 legs, k)."""
        by_position, by_leg = self.closure_jacobians(position_mm, actuators, deviations)
        return -np.einsum("nal,nlc->nalc", np.linalg.inv(by_position), by_leg)

    def actuator_jacobian(self, position_mm, actuators, deviations=None):
        """Derivative of the position with respect to the actuator values, shape (n, 3, 3)."""
        return self.leg_jacobian(position_mm, actuators, deviations)[..., 0]

    def parameter_jacobian(self, position_mm, actuators, deviations=None):
        """Derivative of the position with respect to the errors, shape (n, 3, p)."""
        return np.einsum("nalc,lcp->nap", self.leg_jacobian(position_mm, actuators, deviations), self.leg_map)


def points(array):
    """The argument as a float array of shape (n, 3); raises ValueError for another shape."""
    array = np.asarray(array, dtype=float)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"expected shape (n, 3), got {array.shape}")
    return array
