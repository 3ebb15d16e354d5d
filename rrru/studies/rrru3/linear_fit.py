"""Least mean distance of many draws on a linearised model: what the twin's search can afford for every candidate."""

import numpy as np

from rrru.errors import FitError
from rrru.fit.identifiability import RANK_TOLERANCE


def linear_fit(mechanism, theta, measured, start):
    """Deviations (d, p) of least mean distance and the minima (d,) of d draws.

    The model is linearised once, at the least-squares deviations of the draws' mean. theta, start: (n, 3); measured:
    (d, n, 3). Raises FitError where the iteration leaves the reach.
    """
    deviations, centre = mechanism.parameters.nominal, measured.mean(axis=0)
    for _ in range(3):
        residual = centre - mechanism.forward(theta, deviations, start)
        jacobian = mechanism.parameter_jacobian(centre - residual, theta, deviations)
        if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
            raise FitError("the candidate's calibration leaves the reach")
        flat = jacobian.reshape(-1, jacobian.shape[-1])
        step = np.linalg.lstsq(flat, residual.ravel(), rcond=RANK_TOLERANCE)[0]
        deviations = deviations + step
    whitened = np.linalg.qr(flat)
    basis = whitened.Q.reshape(jacobian.shape)
    q, value = _least_mean(residual - jacobian @ step + (measured - centre), basis)
    return deviations + np.linalg.solve(whitened.R, q.T).T, value


def _least_mean(residual, basis):
    """Coordinates q (d, p) that minimise the mean distances of residuals (d, n, 3) - basis (n, 3, p) q, and the minima.

    Damped Newton from least squares; the basis is orthonormal.
    """
    q = np.einsum("dna,nap->dp", residual, basis)
    value = _mean(residual, basis, q)
    for _ in range(30):
        step, size = _newton_step(residual - _moved(basis, q), basis), np.ones(len(q))
        while (worse := (size > 0.0) & (_mean(residual, basis, q + size[:, None] * step) > value)).any():
            size[worse] = np.where(size[worse] > 1e-3, 0.5 * size[worse], 0.0)
        q = q + size[:, None] * step
        previous, value = value, _mean(residual, basis, q)
        if (previous - value).max() < 1e-10:
            break
    return q, value


def _moved(basis, q):
    """Basis (n, 3, p) times coordinates (d, p), (d, n, 3)."""
    return np.einsum("nap,dp->dna", basis, q)


def _mean(residual, basis, q):
    """Mean distances (d,) at coordinates (d, p)."""
    return np.linalg.norm(residual - _moved(basis, q), axis=-1).mean(axis=-1)


def _newton_step(residual, basis):
    """Newton steps (d, p) of the mean distances of residuals (d, n, 3) that change by -basis (n, 3, p)."""
    distance = np.maximum(np.linalg.norm(residual, axis=-1), 1e-9)
    along = np.einsum("dna,nap->dnp", residual / distance[..., None], basis)
    weight = 1.0 / distance
    gram = np.einsum("nap,naq->npq", basis, basis)
    turned = along * np.sqrt(weight)[..., None]
    hessian = np.einsum("dn,npq->dpq", weight, gram) - turned.transpose(0, 2, 1) @ turned
    return np.linalg.solve(hessian, along.sum(axis=1)[..., None])[..., 0]
