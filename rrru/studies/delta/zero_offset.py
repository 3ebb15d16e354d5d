"""Zero errors of the drives from places that are known up to a rigid motion: distances (paper C, eqs. 8 to 15), shapes.

The robot stood at n actuator triples and its places were seen in a frame of which nothing is known. With l_cj the seen
distance of place j from the first and l_j the model's, u_j the direction between them and J_j the Jacobian,

    l_cj - l_j = u_j . (J_j - J_1) dtheta,   j = 2 .. n
    (eqs. 9, 13, 14)

All residuals here have `residual`, `jacobian` and a length, and are fitted by `rrru.fit.least_squares`. Lengths in mm,
angles in rad.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import linalg
from scipy.spatial.transform import Rotation

from rrru.fit.identifiability import analyse
from rrru.fit.least_squares import make_fit
from rrru.fit.residuals import Residuals
from rrru.kept import last_kept


@dataclass(frozen=True)
class Distances:
    """Distances of n places from the first one.

    mechanism: its `parameters` are fitted; actuators, measured_mm: (n, 3) actuator values and places in any one frame.
    Every distance carries the first place's noise too; unless `alike`, residuals are multiplied by `whitener`, which
    leaves them independent and with the noise of one axis each. The paper counts all distances alike.
    """

    mechanism: object
    actuators: np.ndarray
    measured_mm: np.ndarray
    alike: bool = False

    def __len__(self):
        return len(self.actuators) - 1

    @cached_property
    def covariance(self):
        """Covariance (n-1, n-1) of the distances for unit noise of every axis: I + U U', U the directions."""
        direction = _from_first(self.measured_mm)[1]
        return np.eye(len(self)) + direction @ direction.T

    @cached_property
    def whitener(self):
        """Inverse Cholesky factor (n-1, n-1) of the covariance, or the unit matrix where all count alike."""
        return np.eye(len(self)) if self.alike else np.linalg.inv(np.linalg.cholesky(self.covariance))

    @last_kept
    def _model(self, deviations):
        """Model places (n, 3)."""
        return self.mechanism.forward(self.actuators, deviations)

    def residual(self, deviations):
        """Measured less model distances (n-1, 1) in mm, whitened."""
        difference = _from_first(self.measured_mm)[0] - _from_first(self._model(deviations))[0]
        return (self.whitener @ difference)[:, None]

    def jacobian(self, deviations):
        """Derivative (n-1, 1, p) of the residual."""
        places = self._model(deviations)
        slope = self.mechanism.parameter_jacobian(places, self.actuators, deviations)
        rows = np.einsum("na,nap->np", _from_first(places)[1], slope[1:] - slope[0])
        return -(self.whitener @ rows)[:, None]


@dataclass(frozen=True)
class Shape:
    """The whole shape of n places: displacements with sign and direction, the frame's rotation and origin free.

    mechanism, actuators, measured_mm: as in `Distances`. The 3 n differences are projected on the 3 n - 6 directions
    that no motion of the frame reaches.
    """

    mechanism: object
    actuators: np.ndarray
    measured_mm: np.ndarray

    def __len__(self):
        return len(self.actuators)

    @cached_property
    def _rest(self):
        """Orthonormal rows (3n - 6, 3n): small motions of the frame about the measured places do not reach them."""
        turned = np.cross(np.eye(3)[None], (self.measured_mm - self.measured_mm.mean(axis=0))[:, None])
        motions = np.concatenate([np.tile(np.eye(3), (len(self), 1, 1)), turned], axis=1)
        return linalg.null_space(motions.transpose(1, 0, 2).reshape(6, -1)).T

    @last_kept
    def _turned(self, deviations):
        """Model places (n, 3) moved onto the measured ones, the rotation (3, 3) of it and the places before."""
        places = self.mechanism.forward(self.actuators, deviations)
        middle = self.measured_mm.mean(axis=0)
        turn = Rotation.align_vectors(self.measured_mm - middle, places - places.mean(axis=0))[0].as_matrix()
        return (places - places.mean(axis=0)) @ turn.T + middle, turn, places

    def residual(self, deviations):
        """Measured less model places, (3n - 6, 1) in mm."""
        moved, _, _ = self._turned(deviations)
        return (self._rest @ (self.measured_mm - moved).ravel())[:, None]

    def jacobian(self, deviations):
        """Derivative (3n - 6, 1, p) of the residual; how the best rotation follows is what `_rest` takes away."""
        _, turn, places = self._turned(deviations)
        slope = turn @ self.mechanism.parameter_jacobian(places, self.actuators, deviations)
        return -(self._rest @ slope.reshape(-1, slope.shape[-1]))[:, None]


@dataclass(frozen=True)
class Heights(Residuals):
    """Measured heights alone, z of the robot's base frame."""

    def residual(self, deviations):
        """Measured less model heights, (n, 1) in mm."""
        return super().residual(deviations)[:, 2:]

    def jacobian(self, deviations):
        """Derivative (n, 1, p) of the residual."""
        return super().jacobian(deviations)[:, 2:]


def one_step(residuals):
    """Deviations (p,) by one step from the nominal robot: the paper's on `Distances` that count alike (eq. 15)."""
    nominal = residuals.mechanism.parameters.nominal
    return nominal + taken_for_errors(residuals, residuals.residual(nominal)[..., None])[:, 0]


def step_fit(distances):
    """Fit of the paper's step on `Distances` that count alike, and the covariance (p, p) of its deviations.

    With J' J in place of the best weights the covariance is s^2 J^+ C J^+', C that of the distances, and s^2 the sum of
    squared residuals over the trace of (I - J J^+) C. Singular values are those of the whitened distances, as in every
    other fit.
    """
    deviations = one_step(distances)
    plain, nominal = make_fit(distances, deviations, 1), distances.mechanism.parameters.nominal
    jacobian = distances.jacobian(nominal)[:, 0]
    inverse = np.linalg.pinv(jacobian)
    left = distances.covariance - jacobian @ (inverse @ distances.covariance)
    noise = np.sqrt((plain.residual_mm**2).sum() / np.trace(left))
    covariance = noise**2 * inverse @ distances.covariance @ inverse.T
    seen = analyse(distances.mechanism, replace(distances, alike=False).jacobian(deviations))
    errors = np.sqrt(np.diag(covariance))
    return replace(plain, noise_mm=float(noise), standard_errors=errors, identifiability=seen), covariance


def taken_for_errors(residuals, changes):
    """Deviations (p, q) by which a fit answers to changes of its residuals (m, k, q) that it does not know.

    To first order. Changes are derivatives of measured less model values: of the model by other deviations, or of the
    measurement by an instrument's.
    """
    jacobian = residuals.jacobian(residuals.mechanism.parameters.nominal)
    flat = jacobian.reshape(-1, jacobian.shape[-1])
    return -np.linalg.lstsq(flat, np.asarray(changes).reshape(len(flat), -1), rcond=None)[0]


def _from_first(places_mm):
    """Distances (n-1,) of places (n, 3) from the first, and the unit directions (n-1, 3)."""
    step = places_mm[1:] - places_mm[0]
    distance = np.linalg.norm(step, axis=1)
    return distance, step / distance[:, None]
