"""Which model of a machine lengths speak for, when what no model explains is smooth rather than noise.

Neighbouring rows err alike wherever a law is lacking, and F tests or BIC, which count them as independent, then find
whatever term imitates it. So the residual is noise and, of unknown size and length scale, a smooth function of the
place for every reading (a Gaussian process in cosines: Solin and Saerkkae, Hilbert space methods for reduced-rank
Gaussian process regression, Statistics and Computing 30, 2020). The marginal likelihood integrates the machine's
numbers, the rows' unknowns and the noise in closed form about the least squares; size and length scale by sums.
"""

from dataclasses import dataclass
from itertools import product
from operator import itemgetter

import numpy as np
from scipy import linalg, special

from rrru.fit.lengths_only import LengthFit

# cosines per reading, of so many half waves along an axis; size of the smooth error over that of the noise; its length
# scale over the span of the places
_COSINES, _HALF_WAVES = 40, 12
_SIZES = np.geomspace(0.5, 16.0, 6)
_LENGTHS = (0.1, 0.2, 0.4)
# cosines have no slope at the ends of their box: the places keep off by this share of their span
_MARGIN = 0.1
# lengths without any noise
_LEAST_MM = 1e-9


@dataclass(frozen=True)
class Evidence:
    """Log marginal likelihoods of a fitted model, with independent noise and with a smooth error beside it.

    noise_mm and standard_errors (n d + 2 k,): with the best smooth error; smooth_mm: the size of that error.
    """

    independent: float
    smooth: float
    noise_mm: float
    smooth_mm: float
    standard_errors: np.ndarray


def evidence(fit: LengthFit, ranges: np.ndarray) -> Evidence | None:
    """Evidence of a fit whose numbers are 0 within ranges (p,), 1 sigma; inf for those that all models share.

    None where the readings do not tell all numbers or leave no freedom.
    """
    count = int(fit.weight.sum()) - fit.model.unknown * len(fit.weight)
    numbers = len(fit.theta)
    if fit.identifiability.rank < numbers or count - numbers < 1:
        return None
    free, determinant = _contrasts(fit)
    by_theta, _ = fit.model.slopes(fit.theta, fit.places)
    residual = np.einsum("ikc,ik->ic", free, fit.weight * fit.residual_mm).ravel()
    slopes = np.einsum("ikc,ikp->icp", free, fit.weight[..., None] * by_theta * fit.model.scale)
    slopes = slopes.reshape(-1, numbers)
    waves, frequencies = _cosines(fit.places)
    weighted = free * fit.weight[..., None]
    smooth = np.einsum("ikc,im->icmk", weighted, waves).reshape(len(residual), -1)
    # what is believed of a number is one more reading of it, in units of the noise
    believed = np.flatnonzero(np.isfinite(ranges))
    precision = max(fit.noise_mm, _LEAST_MM) / ranges[believed]
    residual = np.append(residual, precision * fit.theta[believed])
    slopes = np.vstack([slopes, (np.eye(numbers)[believed] * fit.model.scale) * precision[:, None]])
    smooth = np.pad(smooth, ((0, len(believed)), (0, 0)))
    constant = -0.5 * determinant + np.log(precision).sum() + np.log(fit.model.scale).sum()
    marginal = _Marginal(residual, slopes, smooth, count + len(believed) - numbers)
    alone, noise, covariance = marginal.independent()
    best, logs = (-np.inf, 0.0, noise, covariance), []
    for length in _LENGTHS:
        density = np.exp(-0.25 * (length * frequencies) ** 2)
        # the function's mean variance over the places is 1
        density = density / np.sqrt(((waves * density) ** 2).sum(axis=1).mean())
        for size, (log, *rest) in zip(_SIZES, marginal.smooth(np.repeat(density, fit.weight.shape[1])), strict=True):
            logs.append(log)
            best = max(best, (log, size * rest[0], *rest), key=itemgetter(0))
    _, smooth_mm, noise_mm, covariance = best
    half = fit.model.basis * fit.model.scale
    errors = np.sqrt(((half @ covariance) * half).sum(axis=1))
    mixed = float(special.logsumexp(logs) - np.log(len(logs)))
    return Evidence(alone + constant, mixed + constant, float(noise_mm), float(smooth_mm), errors)


def _contrasts(fit: LengthFit) -> tuple[np.ndarray, float]:
    """Directions (N, k, k - d) of the rows' readings that their own unknowns do not touch, and log |J_p' J_p|."""
    rows, readings = fit.weight.shape
    if not fit.model.unknown:
        return np.broadcast_to(np.eye(readings), (rows, readings, readings)), 0.0
    _, by_place = fit.model.slopes(fit.theta, fit.places)
    basis, upper = np.linalg.qr(by_place * fit.weight[..., None], mode="complete")
    diagonal = np.abs(np.diagonal(upper, axis1=1, axis2=2))
    return basis[..., fit.model.unknown :], float(2.0 * np.log(np.maximum(diagonal, 1e-9)).sum())


def _cosines(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The longest cosine waves (N, m) over the box of the places, and their frequencies (m,) per span."""
    span = np.maximum(np.ptp(places, axis=0), 1e-9)
    inside = (places - places.min(axis=0)) / span.max() + _MARGIN
    box = span / span.max() + 2.0 * _MARGIN
    counts = np.array(list(product(range(_HALF_WAVES), repeat=places.shape[1])))
    frequencies = np.pi * counts / box
    size = np.linalg.norm(frequencies, axis=1)
    chosen = np.argsort(size, kind="stable")[:_COSINES]
    waves = np.where(counts[chosen] > 0, np.sqrt(2.0), 1.0) * np.cos(inside[:, None] * frequencies[chosen])
    return waves.prod(axis=-1), size[chosen]


class _Marginal:
    """Marginal likelihood of contrasts (m,) = slopes (m, p) q + smooth (m, s) w + noise, in `freedom` degrees."""

    def __init__(self, residual: np.ndarray, slopes: np.ndarray, smooth: np.ndarray, freedom: int) -> None:
        self._freedom = freedom
        self._smooth = smooth
        self._data = np.column_stack([slopes, residual])
        self._square = self._data.T @ self._data
        self._cross = smooth.T @ self._data

    def independent(self) -> tuple[float, float, np.ndarray]:
        """Log likelihood, noise and covariance (p, p) without any smooth error."""
        return self._integrated(self._square, 0.0)

    def smooth(self, density: np.ndarray) -> list[tuple[float, float, np.ndarray]]:
        """The same with a smooth error of amplitudes (s,) times each of the sizes."""
        half = self._smooth * density
        values, vectors = linalg.eigh(half.T @ half)
        values = np.maximum(values, 0.0)
        turned = vectors.T @ (density[:, None] * self._cross)
        result = []
        for size in _SIZES:
            # Woodbury: 1 / (1 + size^2 H H')
            grown = 1.0 + size**2 * values
            square = self._square - turned.T @ (size**2 / grown[:, None] * turned)
            result.append(self._integrated(square, float(np.log(grown).sum())))
        return result

    def _integrated(self, square: np.ndarray, determinant: float) -> tuple[float, float, np.ndarray]:
        """Log likelihood over q and the noise's size (prior 1 / size), the noise, and the covariance (p, p) of q."""
        inner, mixed = square[:-1, :-1], square[:-1, -1]
        factor = linalg.cho_factor(inner, lower=True)
        left = max(float(square[-1, -1] - mixed @ linalg.cho_solve(factor, mixed)), 1e-300)
        half = 0.5 * self._freedom
        log = special.gammaln(half) - half * np.log(np.pi * left) - 0.5 * determinant
        log -= float(np.log(np.diag(factor[0])).sum())
        noise = np.sqrt(left / self._freedom)
        return float(log), float(noise), noise**2 * linalg.cho_solve(factor, np.eye(len(inner)))
