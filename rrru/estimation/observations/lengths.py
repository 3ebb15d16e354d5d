"""Lengths of belts or cables between anchors and a place that is measured or unknown.

Reading j of row i is the count q_ij of a length that starts at s_j and grows by f_j a count:

    s_j + f_j q_ij = sum_n m_jn sqrt(|p_i - a_n|^2 + h_n^2) + e_ij

over the distances from the row's place p_i to the anchors a_n; m is the routing, h an anchor's height above the plane
of the places. A start length is what a count misses or the length at a drum's zero; a factor is 1 for a count in mm, or
a drum's radius for one in rad.

An unknown place is a parameter of its row alone, with a flat prior. It is eliminated: residual and derivative
are those at the places that fit the row best (variable projection: Golub and Pereyra, Inverse Problems 19, 2003; the
derivative without second derivatives of the model: Kaufman, BIT 15, 1975). The gradient of the objective is exact.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from rrru.arrays import BoolArray, FloatArray
from rrru.cache import last_cached
from rrru.errors import FitError
from rrru.estimation.observations.multilateration import MIN_DISTANCE_MM, Multilateration, row_loss
from rrru.estimation.parameters import Parameters
from rrru.estimation.problem import Problem


@dataclass(frozen=True, eq=False)
class Lengths:
    """Counts of N rows of k lengths over n anchors, and which numbers of the machine are estimated.

    counted (N, k), in mm or rad; routing (k, n); heights_mm (n,). The machine's numbers (n d + 2 k,) are the anchors'
    coordinates, row by row, start lengths and factors: origin + basis @ values, basis (n d + 2 k, p). places_mm (N, d):
    measured; None eliminates them, of lengths to one anchor each. used (N, k): False for readings that are left out.
    noise_mm: standard deviation of a length. cauchy_mm: length at which Cauchy's loss bends, inf for least squares.
    Raises FitError where places that are not measured go with lengths over several anchors.
    """

    default_sd: ClassVar[float] = 1.0
    unit: ClassVar[str] = "mm"

    counted: FloatArray
    routing: FloatArray
    heights_mm: FloatArray
    origin: FloatArray
    basis: FloatArray
    places_mm: FloatArray | None = None
    used: BoolArray | None = None
    noise_mm: float = default_sd
    cauchy_mm: float = np.inf

    def __post_init__(self) -> None:
        readings, anchors = self.routing.shape
        if self.places_mm is None and (readings != anchors or not (self.routing == np.eye(readings)).all()):
            raise FitError("lengths over several anchors; allowed: one anchor each, or measured places")

    def __len__(self) -> int:
        return len(self.counted)

    @property
    def dimensions(self) -> int:
        """Number of coordinates d of a place."""
        readings, anchors = self.routing.shape
        return int((len(self.origin) - 2 * readings) // anchors)

    @property
    def eliminated(self) -> int:
        """Number of eliminated parameters of every row."""
        return self.dimensions if self.places_mm is None else 0

    @cached_property
    def weight(self) -> FloatArray:
        """Weights (N, k): 1 for readings in use, else 0."""
        return np.ones(self.counted.shape) if self.used is None else self.used.astype(float)

    @property
    def redundancy(self) -> int:
        """Number of readings in use above that of all parameters, the rows' included."""
        return int(self.weight.sum()) - self.eliminated * len(self) - int(self.basis.shape[1])

    def rows(self, chosen: npt.NDArray[np.bool_ | np.int_]) -> "Lengths":
        """The rows that a mask (N,) or their numbers choose."""
        places = None if self.places_mm is None else self.places_mm[chosen]
        used = None if self.used is None else self.used[chosen]
        return replace(self, counted=self.counted[chosen], places_mm=places, used=used)

    def problem(self, parameters: Parameters) -> Problem:
        """The estimation of parameters (p,), the columns of the basis, from these lengths."""
        if np.isinf(self.cauchy_mm):
            return Problem(self, parameters, self.whiten)
        return Problem(self, parameters, self.whiten, "cauchy", self.cauchy_mm / self.noise_mm)

    def whiten(self, values: FloatArray) -> FloatArray:
        """Values (N, k, ...) over the noise, 0 for readings that are not in use."""
        return values * (self.weight / self.noise_mm).reshape(*self.weight.shape, *[1] * (values.ndim - 2))

    def machine(self, values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Anchors (n, d) in mm, start lengths (k,) in mm and factors (k,) for values (p,)."""
        return self.split(self.origin + self.basis @ values)

    def split(self, numbers: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The machine's numbers (n d + 2 k,) as those of anchors (n, d), start lengths (k,) and factors (k,)."""
        readings, anchors = self.routing.shape
        return numbers[: -2 * readings].reshape(anchors, -1), numbers[-2 * readings : -readings], numbers[-readings:]

    @last_cached
    def places(self, values: FloatArray) -> FloatArray:
        """Places (N, d) in mm: the measured ones, or those that fit their rows best at values (p,)."""
        if self.places_mm is not None:
            return self.places_mm
        anchors, start, factor = self.machine(values)
        rows = Multilateration(anchors, self.heights_mm, start + factor * self.counted, self.weight > 0.0)
        return rows.least_squares() if np.isinf(self.cauchy_mm) else rows.least_cauchy(self.cauchy_mm)

    def residual(self, values: FloatArray, /) -> FloatArray:
        """Read less modelled lengths (N, k) in mm at values (p,)."""
        anchors, start, factor = self.machine(values)
        modelled = self._distances(anchors, self.places(values))[1] @ self.routing.T
        return np.asarray(start + factor * self.counted - modelled)

    def jacobian(self, values: FloatArray, /) -> FloatArray:
        """Derivative (N, k, p) of the residual by the values, the eliminated places following."""
        return self.eliminate(self.slopes(values)[0], values)

    @last_cached
    def slopes(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Derivatives (N, k, p) and (N, k, d) of the residual by the values and by the row's own place."""
        ways, distance = self._distances(self.machine(values)[0], self.places(values))
        unit = ways / np.maximum(distance, MIN_DISTANCE_MM)[..., None]
        by_anchor = np.einsum("kn,ind->iknd", self.routing, unit).reshape(*self.counted.shape, -1)
        fixed, counting = np.split(self.basis[by_anchor.shape[-1] :], 2)
        by_values = by_anchor @ self.basis[: by_anchor.shape[-1]] + fixed + self.counted[..., None] * counting
        return by_values, -np.einsum("kn,ind->ikd", self.routing, unit)

    def eliminate(self, columns: FloatArray, values: FloatArray) -> FloatArray:
        """Columns (N, k, c) of changes of the residual, with the eliminated places following them, at values (p,)."""
        if not self.eliminated:
            return columns
        by_place, gain = self._places_gain(values)
        return np.asarray(columns - by_place @ (gain @ columns))

    def place_leverage(self, values: FloatArray) -> FloatArray:
        """Share (N, k) of every reading's variance that the eliminated place of its row absorbs, at values (p,)."""
        if not self.eliminated:
            return np.zeros(self.counted.shape)
        by_place = self.slopes(values)[1]
        return np.asarray(np.einsum("ikd,ide,ike->ik", by_place, _inverse(by_place, self.weight), by_place))

    def normalization(self, values: FloatArray) -> tuple[int, float]:
        """Number of readings in use less that of eliminated places' coordinates, and the log of a constant factor.

        The density of the readings, with the places integrated out under a flat prior of density 1 per mm, is this
        factor times exp(-|whitened residual|^2 / 2) times (2 pi)^-1/2 for each of that number. The factor is
        noise^-used |J' J / noise^2|^-1/2, J (k, d) the derivative by the place. Rows that do not determine their place
        do not count.
        """
        used = self.weight.sum(axis=1)
        if not self.eliminated:
            return int(used.sum()), -float(used.sum() * np.log(self.noise_mm))
        determined = used >= self.eliminated
        by_place = self.slopes(values)[1][determined] * self.weight[determined][..., None]
        count = int(used[determined].sum()) - self.eliminated * int(determined.sum())
        size = np.linalg.svd(by_place, compute_uv=False)
        return count, -float(np.log(np.maximum(size, 1e-9)).sum()) - count * float(np.log(self.noise_mm))

    def _distances(self, anchors: FloatArray, places: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Ways (..., n, d) from the anchors to places (..., d), and distances (..., n), heights included."""
        ways = places[..., None, :] - anchors
        return ways, np.sqrt((ways**2).sum(axis=-1) + self.heights_mm**2)

    def _places_gain(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Derivative (N, k, d) of the residual by the places, and the places' (N, d, k) by it, weighted."""
        by_place = self.slopes(values)[1]
        _, slope, _ = row_loss(self.residual(values), self.weight, self.cauchy_mm)
        return by_place, _inverse(by_place, slope) @ (slope[..., None] * by_place).mT


def _inverse(by_place: FloatArray, weight: FloatArray) -> FloatArray:
    """Covariances (N, d, d) of places whose readings have a derivative (N, k, d), weights (N, k) and unit noise."""
    return np.asarray(np.linalg.pinv((weight[..., None] * by_place).mT @ by_place, hermitian=True))
