"""A smooth model discrepancy, correlated between neighbouring places.

    delta(x) = size sum_m a_m(length) w_m phi_m(x),   w_m ~ N(0, 1)

A Gaussian process of squared exponential covariance in cosines phi over the box of the places (Solin and Saerkkae,
Hilbert space methods for reduced-rank Gaussian process regression, Statistics and Computing 30, 2020), as a part of the
model of the readings (Kennedy and O'Hagan, Bayesian calibration of computer models, JRSS B 63, 2001).
"""

from dataclasses import dataclass
from itertools import product
from typing import Self

import numpy as np

from rrru.arrays import FloatArray

# cosines of a function of the place, of so many half waves along an axis: shorter ones have next to no amplitude
_COSINES, _HALF_WAVES = 40, 12
# standard deviation of the discrepancy over that of the noise, and its length scale over the span of the places
_SIZES = np.geomspace(0.5, 16.0, 6)
_LENGTH_SCALES = (0.1, 0.2, 0.4)
# cosines have no slope at the ends of their box: the margin to the places is this share of their span
_MARGIN = 0.1


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """Extra columns of a linear model whose coefficients have normal priors of unknown size and length scale.

    columns (n, a, s): changes of the readings in their unit for unit coefficients; amplitudes (l, s): standard
    deviations of the coefficients for a discrepancy of size 1, a row per length scale; sizes (g,): that may be. All
    length scales and sizes are equally probable. As the priors of parameters, sizes are in units of an unknown noise.
    """

    columns: FloatArray
    amplitudes: FloatArray
    sizes: FloatArray

    @classmethod
    def over_places(cls, places: FloatArray, readings: int, noise: float) -> Self:
        """Discrepancy of N rows of readings, each reading a function of its own of the row's place (N, d).

        noise: standard deviation of a reading, in units of which the discrepancy's size is.
        """
        waves, frequencies = cosines(places)
        densities = np.exp(-0.25 * np.outer(_LENGTH_SCALES, frequencies) ** 2)
        # the function's mean variance over the places is 1
        densities /= np.sqrt((densities**2 @ (waves**2).T).mean(axis=1, keepdims=True))
        columns = noise * np.einsum("im,kl->ikml", waves, np.eye(readings)).reshape(len(places), readings, -1)
        return cls(columns, np.repeat(densities, readings, axis=1), _SIZES)


def cosines(places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The longest cosine waves (N, m) over the box of places (N, d), and their frequencies (m,) per span."""
    span = np.maximum(np.ptp(places, axis=0), 1e-9)
    inside = (places - places.min(axis=0)) / span.max() + _MARGIN
    box = span / span.max() + 2.0 * _MARGIN
    counts = np.array(list(product(range(_HALF_WAVES), repeat=places.shape[1])))
    frequencies = np.pi * counts / box
    size = np.linalg.norm(frequencies, axis=1)
    chosen = np.argsort(size, kind="stable")[:_COSINES]
    waves = np.where(counts[chosen] > 0, np.sqrt(2.0), 1.0) * np.cos(inside[:, None] * frequencies[chosen])
    return waves.prod(axis=-1), size[chosen]
