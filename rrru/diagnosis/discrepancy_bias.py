"""Errors of the fitted parameters by a discrepancy that follows the drives, the place, the time or the load.

A calibration absorbs a part of every error that its model lacks. How much cannot be seen: the residuals show the rest.
Functions of the variables of `rrru.diagnosis.smooth_functions` are fitted to that rest by their marginal likelihood
after the parameters are projected out (restricted likelihood: H. Patterson and R. Thompson, Biometrika 58, 1971), which
says how large the whole functions d are. The readings y = J x + d + e then determine the parameters x as readings with
noise of the covariance E[e e^T] + E[d d^T] do (M. Kennedy and A. O'Hagan, Bayesian calibration of computer models,
JRSS B 63, 2001). Of the readings only those combinations count that the parameters can change: the form of d in the
others is not trusted. The discrepancy along single runs, with which the parameters are fitted, cannot say this: a
function of a drive's value is the same in every run.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import groupby, product
from typing import Self

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import logsumexp

from rrru.arrays import FloatArray
from rrru.diagnosis.model_fit import ModelFit, whitening_of
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.smooth_functions import (
    OF_DRIVES,
    OF_RATES,
    OF_ZEROS,
    Regression,
    Variable,
    couplings,
    process,
    variables,
)
from rrru.diagnosis.state import RANK_TOLERANCE
from rrru.estimation.estimate import Estimate
from rrru.estimation.noise_model import Whitening

# a function of which the parameters absorb all but this share leaves nothing to estimate its size from
_LEAST_LEFT = 1e-6
# functions that are less probable than this share make no difference
_LEAST_SHARE = 1e-3


def discrepancy_covariance(fit: ModelFit) -> FloatArray:
    """By how much the second moments (p, p) of the errors of a fit's parameters grow by a discrepancy.

    It is the mean over the functions, each with a size, by their marginal likelihood. That there is none of them, but
    only the discrepancy along the runs that the fit has, has the prior odds of all together.
    """
    left = _Left.of(fit, whitening_of(fit.model.problem, 0))
    sized = [_likely(left, design) for design in _designs(fit)]
    logs = [log for sizes in sized for log, _ in sizes]
    along_runs = _Left.of(fit, whitening_of(fit.model.problem, fit.level)).log_evidence - left.log_evidence
    total = logsumexp([*logs, along_runs + np.log(max(len(logs), 1))])
    result = np.zeros_like(fit.estimate.covariance)
    # made anew: all functions of a long campaign together are too large for the memory
    for design, sizes in zip(_designs(fit), sized, strict=True):
        for log, size in sizes:
            if (share := float(np.exp(log - total))) > _LEAST_SHARE:
                result += share * growth_with(fit.estimate, size * design)
    return result


@dataclass(frozen=True, eq=False)
class _Left:
    """What a fit's parameters leave of whitened readings.

    basis (3m, r): orthonormal, of the parameters' columns; residual (m, 3): beyond them; log_evidence: restricted
    logarithm of the likelihood, up to a constant of the readings and parameters.
    """

    whiten: Whitening
    basis: FloatArray
    residual: FloatArray
    log_evidence: float

    @classmethod
    def of(cls, fit: ModelFit, whiten: Whitening) -> Self:
        """What a fit leaves under a Whitening."""
        jacobian, residual = fit.estimate.jacobian, whiten(fit.estimate.residual)
        unit = _inverse_lengths(jacobian.reshape(-1, jacobian.shape[-1]))
        columns = whiten(jacobian * unit).reshape(residual.size, -1)
        turned, values, _ = np.linalg.svd(columns, full_matrices=False)
        seen = values > RANK_TOLERANCE * values.max(initial=0.0)
        basis = turned[:, seen]
        left = residual.ravel() - basis @ (basis.T @ residual.ravel())
        log = whiten.log_determinant - float(np.log(values[seen]).sum()) - 0.5 * float(left @ left)
        return cls(whiten, basis, left.reshape(residual.shape), log)

    def of_functions(self, design: FloatArray) -> FloatArray:
        """What is left of functions (m, 3, k) of unit size, whitened."""
        white = self.whiten(design).reshape(self.residual.size, -1)
        return np.asarray(white - self.basis @ (self.basis.T @ white)).reshape(design.shape)


def _likely(left: _Left, design: FloatArray) -> list[tuple[float, float]]:
    """Sizes that functions (m, 3, k) of unit size may have, each with its log marginal likelihood over none."""
    rms, rest = float(np.sqrt((left.residual**2).mean())), left.of_functions(design)
    whole, seen = (float(np.sqrt((one**2).sum(axis=-1).mean())) for one in (left.whiten(design), rest))
    if seen <= _LEAST_LEFT * whole:
        return []
    unit = rms / seen
    regression = Regression(rest * unit, left.residual, 1.0)
    return [(regression.log_evidence(amplitude), amplitude * unit) for amplitude in OPTIONS.bias_amplitudes]


def growth_with(estimate: Estimate, functions: FloatArray) -> FloatArray:
    """By how much the second moments (p, p) of an Estimate's errors grow with functions (n, a, k) of unit size each.

    They are about the estimated values, which are not the means under a model that has the functions. Zero for
    parameters at a bound, and for those that neither readings nor priors determine.
    """
    white, count = estimate.problem.whiten, len(estimate.values)
    free = ~estimate.at_bound & np.isfinite(np.diag(estimate.covariance))
    # the Jacobian is that of the residuals
    columns = -white(estimate.jacobian).reshape(-1, count)[:, free]
    unit = _inverse_lengths(columns)
    basis, triangle = np.linalg.qr(columns * unit)
    triangle = triangle / unit
    moved = basis.T @ white(functions).reshape(len(columns), -1)
    root = np.linalg.cholesky(np.eye(len(moved)) + moved @ moved.T)
    known = solve_triangular(root, triangle, lower=True)
    left = solve_triangular(root, basis.T @ estimate.standardized_residual.ravel(), lower=True)
    result = np.zeros((count, count))
    for share, one in estimate.cases or ((1.0, estimate),):
        precision = one.parameters.prior_precision[free]
        narrow, wide = (
            unit[:, None] * np.linalg.inv((some * unit).T @ (some * unit) + np.diag(precision * unit**2)) * unit
            for some in (triangle, known)
        )
        off = np.where(precision > 0.0, one.parameters.mean[free] - estimate.values[free], 0.0)
        step = wide @ (known.T @ left + precision * off)
        result[np.ix_(free, free)] += share * (wide - narrow + np.outer(step, step))
    return result


def _inverse_lengths(columns: FloatArray) -> FloatArray:
    """Inverse lengths (p,) of columns (n, p), 1 for those of length zero."""
    length = np.linalg.norm(columns, axis=0)
    return np.asarray(1.0 / np.where(length > 0.0, length, 1.0))


def _designs(fit: ModelFit) -> Iterator[FloatArray]:
    """What functions of each kind of variable make of the readings (m, 3, k), for unit size and each length scale."""
    problem = fit.model.problem
    drive = problem.of_rows(problem.map_of(fit.state).drive_effect)
    rows = np.ones(len(problem), dtype=bool)
    found = variables(problem, fit.state, drive, rows)
    # of positions on the robot alone; errors of drives turn the platform as well
    mask = problem.on_robot[:, None, None]
    for kind, group in groupby(found, key=lambda one: one.kind or one.follows):
        some = [
            one if kind in (OF_DRIVES, OF_ZEROS, OF_RATES) else replace(one, response=one.response * mask)
            for one in group
        ]
        if some[0].steps:
            yield some[0].design(some[0].value)
            continue
        for scale in OPTIONS.bias_scales:
            yield _together(some, [_over_range(one) / scale for one in some])
    drives, zeros = ([one for one in found if one.kind == kind] for kind in (OF_DRIVES, OF_ZEROS))
    if zeros:
        time = _over_range(zeros[0])
        for of_value, of_time in product(OPTIONS.bias_scales[-2:], OPTIONS.bias_scales):
            yield _together(drives, [np.column_stack([_over_range(one) / of_value, time / of_time]) for one in drives])
    for coupling, scale in product(couplings(problem, drive, rows), OPTIONS.bias_scales):
        yield _together([coupling], [_over_range(coupling) / scale])


def _together(some: list[Variable], places: list[FloatArray]) -> FloatArray:
    """Designs (m, 3, k) of independent functions of variables at places (m, d), in units of their length scales."""
    pairs = zip(some, places, strict=True)
    return np.concatenate([one.design(process(place, 1.0, OPTIONS.bias_spacing)) for one, place in pairs], axis=-1)


def _over_range(variable: Variable) -> FloatArray:
    """Values (m, d) of a variable over the width of their range."""
    return np.asarray(variable.value / np.linalg.norm(np.ptp(variable.value, axis=0)))
