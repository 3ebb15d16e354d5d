"""Readings that an effect of many coefficients explains, and that no other stop predicts with it: outliers.

A function of a drive's value can have a hill at every stop. Whether it is more than that one stop's error is seen at
the others: without the stop the function has to predict what it explains there. With the hat matrix H of its k readings
and the prior of the coefficients the prediction error without them is

    r_out = (I - H)^-1 r,    H = J C J^T / s^2

J (k, p): derivative by the parameters; C (p, p): their covariance; s: noise; r (k,): residual with them (R. Cook and
S. Weisberg, Residuals and influence in regression, 1982, section 2.2).
"""

import numpy as np

from rrru.arrays import BoolArray, FloatArray
from rrru.diagnosis.model_fit import ModelFit
from rrru.diagnosis.options import OPTIONS

# share of a reading that its own fit leaves at least, so that rounding makes no prediction error
_LEAST_LEFT = 1e-6


def unsupported(fit: ModelFit, candidates: BoolArray, apart: FloatArray) -> BoolArray:
    """Which candidates (m,) of the rows of a fit its other stops do not predict better than a fit without the effect.

    apart (m, 3): residuals of that fit. A reading is predicted where its mean square shrinks by
    `OPTIONS.min_followed_share`.
    """
    result = np.zeros_like(candidates)
    stop = fit.model.problem.stop
    for number in np.unique(stop[candidates]):
        here = stop == number
        left = _left_out(fit, here)
        rows = candidates[here]
        result[here] = rows & ((left**2).sum(axis=1) > (1.0 - OPTIONS.min_followed_share) * (apart[here] ** 2).sum(1))
    return result


def _left_out(fit: ModelFit, rows: BoolArray) -> FloatArray:
    """Prediction errors (k, 3) in mm of some rows (m,) by a fit to the others."""
    estimate, axis_mm = fit.estimate, fit.model.problem.axis_mm
    free = ~estimate.at_bound & np.isfinite(np.diag(estimate.covariance))
    jacobian = estimate.jacobian[rows][:, :, free] / axis_mm[:, None]
    jacobian = jacobian.reshape(-1, jacobian.shape[-1])
    taken, turned = np.linalg.eigh(jacobian @ estimate.covariance[np.ix_(free, free)] @ jacobian.T)
    residual = (estimate.residual[rows] / axis_mm).ravel()
    left = turned @ (turned.T @ residual / np.maximum(1.0 - taken, _LEAST_LEFT))
    return np.asarray(left.reshape(-1, 3) * axis_mm)
