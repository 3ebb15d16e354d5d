"""Descent of a candidate for the twin to the nearest optimum: damped Gauss-Newton on the objective's residuals.

The objective is half a sum of squares (see `twin_objective`). Common random numbers make it smooth, with kinks where
another point has the largest error. Levenberg-Marquardt (Nocedal and Wright, Numerical Optimization, 2006, chapter 10)
with differences comes to an optimum in some hundred candidates. A first descent with a tolerance on every number is
broad: far from the printed numbers the heavy tails have many optima of their own. Genes are in 0..1.
"""

import numpy as np

# of the first descent, added to a number's scatter as a share of the printed number
TOLERANCE = 0.1
# most steps with it and without it, and the gain in nat below which two steps in a row end a descent
_STEPS, _LEAST_GAIN = (8, 20), 0.2
# difference of a gene, longest step of one, and dampings tried at once, as multiples of the last one
_DIFFERENCE, _LONGEST = 1e-3, 0.2
_DAMPING, _FACTORS, _LEAST_DAMPING = 1e-2, (0.1, 1.0, 10.0, 100.0), 1e-6


def descend(rate, genes, periodic):
    """Genes (p,) of an optimum near genes (p,), and its residuals (m,), NaN where the start cannot be driven.

    rate: genes (n, p) and a tolerance to residuals (n, m), NaN where a candidate cannot be driven; periodic (p,): genes
    that come round.
    """
    for tolerance, steps in zip((TOLERANCE, 0.0), _STEPS, strict=True):
        residuals = rate(genes[None], tolerance)[0]
        if np.isnan(residuals).any():
            break
        damping, idle = _DAMPING, 0
        for _ in range(steps):
            slopes = _slopes(rate, genes, residuals, tolerance)
            dampings = np.maximum(damping * np.array(_FACTORS), _LEAST_DAMPING)
            tried = np.array([_step(genes, residuals, slopes, periodic, one) for one in dampings])
            found = rate(tried, tolerance)
            halves = np.nan_to_num(0.5 * (found**2).sum(axis=1), nan=np.inf)
            best, before = halves.argmin(), 0.5 * residuals @ residuals
            damping = dampings[best]
            idle = idle + 1 if before - halves[best] < _LEAST_GAIN else 0
            if halves[best] < before:
                genes, residuals = tried[best], found[best]
            else:
                damping = dampings[-1]
            if idle == 2:
                break
    return genes, residuals


def _slopes(rate, genes, residuals, tolerance):
    """Derivatives (m, p) of the residuals by the genes, zero where no candidate next to them can be driven."""
    steps = np.where(genes < 0.5, _DIFFERENCE, -_DIFFERENCE)
    found = rate(genes + np.diag(steps), tolerance)
    lost = np.flatnonzero(np.isnan(found).any(axis=1))
    if len(lost):
        steps[lost] *= -1.0
        found[lost] = rate(np.clip(genes + np.diag(steps)[lost], 0.0, 1.0), tolerance)
    return np.nan_to_num((found - residuals) / steps[:, None]).T


def _step(genes, residuals, slopes, periodic, damping):
    """Genes (p,) a damped step further; a gene at a bound that would cross it stays."""
    gradient = slopes.T @ residuals
    free = periodic | ~((genes <= 0.0) & (gradient > 0.0) | (genes >= 1.0) & (gradient < 0.0))
    bent = slopes[:, free].T @ slopes[:, free]
    step = np.zeros_like(genes)
    step[free] = -np.linalg.solve(bent + damping * np.diag(np.diag(bent) + 1.0), gradient[free])
    moved = genes + np.clip(step, -_LONGEST, _LONGEST)
    return np.where(periodic, moved % 1.0, np.clip(moved, 0.0, 1.0))
