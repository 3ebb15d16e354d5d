"""Errors with which a fit predicts the readings of each stop from those of all others.

A function of a drive's value can have a hill at every stop. Whether it is more than that one stop's error is seen at
the others: without the stop the function has to predict what it explains there. With the hat matrix H of its k readings
and the prior of the coefficients the prediction error without them is

    r_out = (I - H)^-1 r,    H = J C J^T / s^2

J (k, p): derivative by the parameters; C (p, p): their covariance; s: noise; r (k,): residual with them (R. Cook and
S. Weisberg, Residuals and influence in regression, 1982, section 2.2).
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.diagnosis.model_fit import ModelFit

# share of a reading that its own fit leaves at least, so that rounding makes no prediction error
_LEAST_LEFT = 1e-6


def prediction_errors(fit: ModelFit) -> FloatArray:
    """Prediction errors (m, 3) in mm of the rows of a fit, those of each stop by a fit to all others."""
    estimate, problem = fit.estimate, fit.model.problem
    free = ~estimate.at_bound & np.isfinite(np.diag(estimate.covariance))
    jacobian = estimate.jacobian[:, :, free] / problem.axis_mm[:, None]
    known, covariance = estimate.residual / problem.axis_mm, estimate.covariance[np.ix_(free, free)]
    result = np.empty_like(known)
    for stop in np.unique(problem.stop):
        here = problem.stop == stop
        its = jacobian[here].reshape(-1, jacobian.shape[-1])
        taken, turned = np.linalg.eigh(its @ covariance @ its.T)
        left = turned @ (turned.T @ known[here].ravel() / np.maximum(1.0 - taken, _LEAST_LEFT))
        result[here] = left.reshape(-1, 3)
    return np.asarray(result * problem.axis_mm)


def prediction_rms_mm(fit: ModelFit) -> float:
    """Root mean square length in mm of the prediction errors of a fit, without the noise of the readings themselves."""
    squares = (prediction_errors(fit) ** 2).sum(axis=1).mean() - (fit.model.problem.axis_mm**2).sum()
    return float(np.sqrt(max(squares, 0.0)))
