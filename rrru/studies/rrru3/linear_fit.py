"""Least mean distance of many draws on a linearised model, fast enough for every candidate of the twin's search."""

import numpy as np

from rrru.calibration.identifiability import RANK_TOLERANCE
from rrru.errors import FitError

# weight in mm of the squared excess over a bound, in half widths: violations are some thousandths
_STIFFNESS = 10.0
# tested fractions of a Newton step
_SIZES = np.array([0.0, *0.5 ** np.arange(10)])


def linear_fit(mechanism, theta, measured, start):
    """Deviations (d, p) of least mean distance within the mechanism's bounds, and the minima (d,), of d draws.

    The model is linearised once, at the least-squares deviations of the draws' mean. theta, start: (n, 3); measured:
    (d, n, 3). Raises FitError where the iteration leaves the workspace.
    """
    parameters, centre = mechanism.parameters, measured.mean(axis=0)
    deviations = parameters.nominal
    for _ in range(3):
        residual, jacobian = _linearised(mechanism, theta, centre, start, deviations)
        step = np.linalg.lstsq(jacobian.reshape(-1, len(deviations)), residual.ravel(), rcond=RANK_TOLERANCE)[0]
        deviations = np.clip(deviations + step, parameters.low, parameters.high)
    residual, jacobian = _linearised(mechanism, theta, centre, start, deviations)
    whitened = np.linalg.qr(jacobian.reshape(-1, len(deviations)))
    back = np.linalg.inv(whitened.R)
    bounds = _Bounds(back, deviations, parameters.low, parameters.high)
    q, value = _least_mean(residual + (measured - centre), whitened.Q.reshape(jacobian.shape), bounds)
    return deviations + q @ back.T, value


def _linearised(mechanism, theta, measured, start, deviations):
    """Residuals (n, 3) of measured positions and the model's derivatives (n, 3, p) at deviations."""
    residual = measured - mechanism.forward(theta, deviations, start)
    jacobian = mechanism.parameter_jacobian(measured - residual, theta, deviations)
    if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
        raise FitError("the candidate's calibration leaves the workspace")
    return residual, jacobian


class _Bounds:
    """Quadratic penalty on violated bounds of deviations about a centre, in coordinates q: value, slope, curvature."""

    def __init__(self, back, centre, low, high):
        self.half = 0.5 * (high - low)
        self.back, self.middle = back / self.half[:, None], (centre - 0.5 * (high + low)) / self.half

    def excess(self, q):
        """Signed excess (..., p), in half widths."""
        place = self.middle + q @ self.back.T
        return place - np.clip(place, -1.0, 1.0)

    def value(self, q):
        """Penalties (...)."""
        return _STIFFNESS * (self.excess(q) ** 2).sum(axis=-1)

    def gradient_and_hessian(self, q):
        """First and second derivatives (d, p), (d, p, p) of the penalties."""
        excess = self.excess(q)
        bend = np.einsum("dk,kp,kq->dpq", excess != 0.0, self.back, self.back)
        return 2.0 * _STIFFNESS * excess @ self.back, 2.0 * _STIFFNESS * bend


def _least_mean(residual, basis, bounds):
    """Coordinates q (d, p) that minimise the mean distances of residuals (d, n, 3) - basis (n, 3, p) q, and the minima.

    Damped Newton from least squares; the basis is orthonormal.
    """
    q = np.einsum("dna,nap->dp", residual, basis)

    def cost(q):
        return np.linalg.norm(residual - _moved(basis, q), axis=-1).mean(axis=-1) + bounds.value(q)

    value, every = cost(q), np.arange(len(q))
    for _ in range(60):
        step = _newton_step(residual - _moved(basis, q), basis, *bounds.gradient_and_hessian(q))
        tried = q + _SIZES[:, None, None] * step
        costs = cost(tried)
        best = costs.argmin(axis=0)
        q, previous, value = tried[best, every], value, costs[best, every]
        if (previous - value).max() < 1e-7:
            break
    return q, value


def _moved(basis, q):
    """Basis (n, 3, p) times coordinates (..., p), (..., n, 3)."""
    return np.tensordot(q, basis, axes=([-1], [2]))


def _newton_step(residual, basis, slope, bend):
    """Newton steps (d, p) of mean distances of residuals (d, n, 3) that change by -basis (n, 3, p), and penalties."""
    distance = np.maximum(np.linalg.norm(residual, axis=-1), 1e-9)
    count = distance.shape[1]
    along = np.einsum("dna,nap->dnp", residual / distance[..., None], basis)
    weight = 1.0 / distance
    gram = np.einsum("nap,naq->npq", basis, basis)
    turned = along * np.sqrt(weight)[..., None]
    hessian = np.tensordot(weight, gram, axes=([1], [0])) - turned.transpose(0, 2, 1) @ turned
    return np.linalg.solve(hessian / count + bend, (along.mean(axis=1) - slope)[..., None])[..., 0]
