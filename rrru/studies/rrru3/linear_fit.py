"""Least mean distance on a linearised model: what the twin's search can afford for every candidate."""

import numpy as np

from rrru.errors import FitError
from rrru.fit.identifiability import RANK_TOLERANCE


def linear_fit(mechanism, theta, measured, start):
    """Deviations (p,) of least mean distance and the minimum, on the model linearised at its least-squares deviations.

    theta, measured, start: (n, 3). Raises FitError where the iteration leaves the reach.
    """
    deviations = mechanism.parameters.nominal
    for _ in range(3):
        residual = measured - mechanism.forward(theta, deviations, start)
        jacobian = mechanism.parameter_jacobian(measured - residual, theta, deviations)
        if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
            raise FitError("the candidate's calibration leaves the reach")
        flat = jacobian.reshape(-1, jacobian.shape[-1])
        step = np.linalg.lstsq(flat, residual.ravel(), rcond=RANK_TOLERANCE)[0]
        deviations = deviations + step
    whitened = np.linalg.qr(flat)
    q, value = _least_mean(residual - jacobian @ step, whitened.Q.reshape(jacobian.shape))
    return deviations + np.linalg.solve(whitened.R, q), value


def _least_mean(residual, basis):
    """Coordinates q (p,) that minimise the mean distance of residual (n, 3) - basis (n, 3, p) q, and the minimum.

    Damped Newton.
    """
    q = np.zeros(basis.shape[-1])
    value = np.linalg.norm(residual, axis=1).mean()
    for _ in range(30):
        step, size = _newton_step(residual - basis @ q, basis), 1.0
        while size > 1e-3 and np.linalg.norm(residual - basis @ (q + size * step), axis=1).mean() > value:
            size *= 0.5
        if size <= 1e-3:
            break
        q = q + size * step
        previous, value = value, np.linalg.norm(residual - basis @ q, axis=1).mean()
        if previous - value < 1e-10:
            break
    return q, value


def _newton_step(residual, basis):
    """Newton step (p,) of the mean distance of residuals (n, 3) that change by -basis (n, 3, p)."""
    distance = np.maximum(np.linalg.norm(residual, axis=1), 1e-9)
    along = np.einsum("na,nap->np", residual / distance[:, None], basis)
    scaled = (basis / np.sqrt(distance)[:, None, None]).reshape(-1, basis.shape[-1])
    along_scaled = along / np.sqrt(distance)[:, None]
    return np.linalg.solve(scaled.T @ scaled - along_scaled.T @ along_scaled, along.sum(axis=0))
