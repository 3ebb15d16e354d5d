"""Zero errors of the drives from places known up to a rigid motion: the paper's step, and its omitted-variable bias.

Readings are `rrru.estimation.observations`: `Distances` (paper C, eqs. 8 to 15), `Shape`, `TargetHeights`. Lengths in
mm, angles in rad.
"""

from dataclasses import replace

import numpy as np

from rrru.calibration.calibrate import assess, estimate_deviations_at
from rrru.calibration.identifiability import analyse


def one_step(residuals):
    """Deviations (p,) by one step from the nominal robot: the paper's for `Distances` of equal weight (eq. 15)."""
    nominal = residuals.mechanism.parameters.nominal
    return nominal + taken_for_errors(residuals, residuals.residual(nominal)[..., None])[:, 0]


def step_fit(distances):
    """Calibration by the paper's step on `Distances` of equal weight, and the covariance (p, p) of its deviations.

    With J' J instead of the optimal weights the covariance is s^2 J^+ C J^+', C that of the distances, and s^2 the sum
    of squared residuals over the trace of (I - J J^+) C. Singular values are those of the whitened distances, as in
    every other fit.
    """
    deviations = one_step(distances)
    plain = assess(estimate_deviations_at(distances, deviations, "one step", 1))
    nominal = distances.mechanism.parameters.nominal
    jacobian = distances.jacobian(nominal)[:, 0]
    inverse = np.linalg.pinv(jacobian)
    left = distances.covariance - jacobian @ (inverse @ distances.covariance)
    noise = np.sqrt((plain.residual_mm**2).sum() / np.trace(left))
    covariance = noise**2 * inverse @ distances.covariance @ inverse.T
    identifiability = analyse(distances.mechanism, replace(distances, alike=False).jacobian(deviations))
    errors = np.sqrt(np.diag(covariance))
    return replace(plain, noise_mm=float(noise), standard_errors=errors, identifiability=identifiability), covariance


def taken_for_errors(residuals, changes):
    """Bias (p, q) of a fit from changes of its residuals (m, k, q) that are not in its model, to first order.

    Changes are derivatives of measured minus model values: of the model by other deviations, or of the measurement by
    an instrument's errors.
    """
    jacobian = residuals.jacobian(residuals.mechanism.parameters.nominal)
    flat = jacobian.reshape(-1, jacobian.shape[-1])
    return -np.linalg.lstsq(flat, np.asarray(changes).reshape(len(flat), -1), rcond=None)[0]
