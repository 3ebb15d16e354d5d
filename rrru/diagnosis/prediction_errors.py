"""Errors with which a fit predicts the readings of each stop from those of all others.

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

# share of a reading that its own fit leaves at least, so that rounding makes no prediction error
_LEAST_LEFT = 1e-6
# the same of a stop that says something of a prediction: one that alone determines a parameter does not; assumed
_LEAST_PREDICTED = 0.1
# singular values below this share of the largest are parameters that the readings do not determine
_DETERMINED = 1e-9


def prediction_errors(fit: ModelFit) -> FloatArray:
    """Prediction errors (m, 3) in mm of the rows of a fit, those of each stop by a fit to all others."""
    jacobian, free = _jacobian(fit)
    left, _ = _left_out(fit, jacobian, fit.estimate.covariance[np.ix_(free, free)])
    return np.asarray(left * fit.model.problem.axis_mm)


def prediction_rms_mm(fit: ModelFit) -> float:
    """Root mean square in mm of the prediction errors of positions on the robot, without the readings' own noise.

    Those of least squares, whatever discrepancy the fit has: C / s^2 is the inverse of J^T J. 0 where no stop is
    predicted by the others.
    """
    problem, (jacobian, _) = fit.model.problem, _jacobian(fit)
    flat = jacobian.reshape(-1, jacobian.shape[-1])
    size = np.maximum(np.linalg.norm(flat, axis=0), np.finfo(float).tiny)
    inverse = np.linalg.pinv(flat / size, rcond=_DETERMINED) / size[:, None]
    left, share = _left_out(fit, jacobian, inverse @ inverse.T)
    rows = problem.on_robot & (share > _LEAST_PREDICTED)
    if not rows.any():
        return 0.0
    noise = problem.axis_mm
    squares = ((left[rows] * noise) ** 2).sum(axis=1).mean() - (noise**2).sum()
    return float(np.sqrt(max(squares, 0.0)))


def _jacobian(fit: ModelFit) -> tuple[FloatArray, BoolArray]:
    """Derivative (m, 3, k) of readings per standard deviation by the parameters (p,) that are free, and which are."""
    estimate = fit.estimate
    free = ~estimate.at_bound & np.isfinite(np.diag(estimate.covariance))
    return estimate.jacobian[:, :, free] / fit.model.problem.axis_mm[:, None], free


def _left_out(fit: ModelFit, jacobian: FloatArray, covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Prediction errors (m, 3) per standard deviation, and the least share (m,) of its stop that the fit leaves."""
    problem = fit.model.problem
    known = fit.estimate.residual / problem.axis_mm
    result, share = np.empty_like(known), np.empty(len(known))
    for stop in np.unique(problem.stop):
        here = problem.stop == stop
        its = jacobian[here].reshape(-1, jacobian.shape[-1])
        taken, turned = np.linalg.eigh(its @ covariance @ its.T)
        left = turned @ (turned.T @ known[here].ravel() / np.maximum(1.0 - taken, _LEAST_LEFT))
        result[here], share[here] = left.reshape(-1, 3), 1.0 - taken.max()
    return result, share
