"""Distances of places from the first one, seen in an unregistered frame (paper C, eqs. 8 to 15).

The robot stood at n actuator triples. With d_j the seen distance of place j from the first, l_j the model's, u_j the
direction between the two places and J_j the Jacobian by the parameters x,

    d_j - l_j = u_j . (J_j - J_1) dx,   j = 2 .. n
    (eqs. 9, 13, 14)

The whole shape of the places holds their displacements with sign and direction, too.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from scipy import linalg
from scipy.spatial.transform import Rotation

from rrru.arrays import FloatArray
from rrru.cache import last_cached
from rrru.errors import FitError
from rrru.kinematics.legs import rigid_motions
from rrru.kinematics.robot import Robot


@dataclass(frozen=True)
class _Places:
    """Places measured_mm (n, 3) at actuators (n, K) of a mechanism. Raises FitError where a number is not finite."""

    mechanism: Robot
    actuators: FloatArray
    measured_mm: FloatArray

    # ASSUME a laser tracker on a small machine, per axis of a place; a calibration takes what the residuals show
    default_sd: ClassVar[float] = 0.02
    unit: ClassVar[str] = "mm"

    def __post_init__(self) -> None:
        require_finite(self.actuators, "actuators")
        require_finite(self.measured_mm, "measured_mm")


@dataclass(frozen=True)
class Distances(_Places):
    """Distances of n places from the first one.

    mechanism: its `parameters` are estimated; actuators (n, K), measured_mm (n, 3): actuator values and places in any
    one frame. Every distance has the first place's noise too. Unless `alike`, residuals are multiplied by `whitener`,
    which makes them independent with the noise of one axis each. The paper gives all distances equal weight.
    Raises FitError where a number is not finite.
    """

    alike: bool = False

    def __len__(self) -> int:
        return len(self.actuators) - 1

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance (n-1, n-1) of the distances for unit noise of every axis: I + U U', U the directions."""
        direction = _from_first(self.measured_mm)[1]
        return np.eye(len(self)) + direction @ direction.T

    @cached_property
    def whitener(self) -> FloatArray:
        """Inverse Cholesky factor (n-1, n-1) of the covariance, or the unit matrix where all count alike."""
        return np.eye(len(self)) if self.alike else np.linalg.inv(np.linalg.cholesky(self.covariance))

    @last_cached
    def _model(self, values: FloatArray) -> FloatArray:
        """Model places (n, 3)."""
        return self.mechanism.forward(self.actuators, values)

    def residual(self, values: FloatArray, /) -> FloatArray:
        """Measured minus predicted distances (n-1, 1) in mm at deviations (p,), whitened."""
        difference = _from_first(self.measured_mm)[0] - _from_first(self._model(values))[0]
        return (self.whitener @ difference)[:, None]

    def jacobian(self, values: FloatArray, /) -> FloatArray:
        """Derivative (n-1, 1, p) of the residual by the deviations (p,)."""
        places = self._model(values)
        slope = self.mechanism.parameter_jacobian(places, self.actuators, values)
        rows: FloatArray = np.einsum("na,nap->np", _from_first(places)[1], slope[1:] - slope[0])
        return -(self.whitener @ rows)[:, None]


def require_finite(values: FloatArray, name: str) -> None:
    """Raise FitError, naming the first row, where values (n, ...) are not finite."""
    bad = np.flatnonzero(~np.isfinite(values).reshape(len(values), -1).all(axis=1))
    if bad.size:
        raise FitError(f"{name} is not finite at {bad.size} of {len(values)} places, the first is place {bad[0] + 1}")


def _from_first(places_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distances (n-1,) of places (n, 3) from the first, and the unit directions (n-1, 3)."""
    step = places_mm[1:] - places_mm[0]
    distance = np.linalg.norm(step, axis=1)
    return distance, step / distance[:, None]


@dataclass(frozen=True)
class Shape(_Places):
    """The whole shape of n places, the frame's rotation and origin free.

    mechanism, actuators (n, K), measured_mm (n, 3): as in `Distances`. The 3 n differences are projected on the 3 n - 6
    directions that no motion of the frame reaches. Raises FitError where a number is not finite.
    """

    def __len__(self) -> int:
        return len(self.actuators)

    @cached_property
    def _fixed_frame(self) -> FloatArray:
        """Orthonormal rows (3n - 6, 3n): small motions of the frame about the measured places do not reach them."""
        motions = rigid_motions(self.measured_mm - self.measured_mm.mean(axis=0))
        return np.asarray(linalg.null_space(motions.reshape(-1, 6).T).T)

    @last_cached
    def _aligned(self, values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Model places (n, 3) moved onto the measured ones, the rotation (3, 3) of it and the places before."""
        places = self.mechanism.forward(self.actuators, values)
        middle = self.measured_mm.mean(axis=0)
        turn = Rotation.align_vectors(self.measured_mm - middle, places - places.mean(axis=0))[0].as_matrix()
        return (places - places.mean(axis=0)) @ turn.T + middle, turn, places

    def residual(self, values: FloatArray, /) -> FloatArray:
        """Measured minus predicted places, (3n - 6, 1) in mm, at deviations (p,)."""
        moved, _, _ = self._aligned(values)
        return (self._fixed_frame @ (self.measured_mm - moved).ravel())[:, None]

    def jacobian(self, values: FloatArray, /) -> FloatArray:
        """Derivative (3n - 6, 1, p) of the residual; the projection removes the change of the best rotation."""
        _, turn, places = self._aligned(values)
        slope = turn @ self.mechanism.parameter_jacobian(places, self.actuators, values)
        return -(self._fixed_frame @ slope.reshape(-1, slope.shape[-1]))[:, None]
