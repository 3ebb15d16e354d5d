"""F test of a linearised problem: whether further columns explain more of the readings than noise does.

About an estimate the whitened residual r is linear in the parameters x and in the coefficients c of further columns,

    r = A x + C c + s e,   e ~ N(0, I),   s unknown

With M the projection off A, P that on M C, of rank k, and f = N - rank A - k,

    F = (|P r|^2 / k) / ((|M r|^2 - |P r|^2) / f)

follows Fisher's distribution of k and f degrees of freedom where c is 0 (Cook and Weisberg, Residuals and Influence in
Regression, 1982, 2.2). Priors of x and c do not count.

Where the proportions of the readings' noises are unknown there is one test for each of several. The largest p value of
them keeps the significance level whichever is true. Their mean, weighted by the marginal likelihoods of r under flat
priors,

    log p(r) = log |W| - 1/2 log |[A C]' [A C]| - f/2 log (|M r|^2 - |P r|^2) + constant,

keeps it on the average (partial predictive p: Bayarri and Berger, Journal of the American Statistical Association 95,
2000; restricted likelihood: Harville, ibid. 72, 1977).
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy import special

from rrru.arrays import FloatArray
from rrru.estimation.estimate import Estimate
from rrru.estimation.problem import Whiten, log_determinant

# a direction of the columns, in units of their lengths, of which a smaller share remains is absorbed by the parameters
_RANK_TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class LinearizedModel:
    """A problem linearised about an estimate: the part of its N whitened readings that the parameters explain.

    basis (N, r): orthonormal basis of the column space of A; residual (N,): the estimate's whitened residual projected
    off it; log_density: log |W| - 1/2 log |A' A|.
    """

    whiten: Whiten
    basis: FloatArray
    residual: FloatArray
    log_density: float

    @classmethod
    def of(cls, estimate: Estimate, whiten: Whiten | None = None) -> Self:
        """About an Estimate; whiten: by default that of its problem.

        Raises FitError where the whitening does not state its determinant.
        """
        whiten = whiten or estimate.problem.whiten
        white = whiten(estimate.residual).ravel()
        return cls(whiten, np.zeros((white.size, 0)), white, log_determinant(whiten)).with_columns(estimate.jacobian)

    def remainder(self, readings: FloatArray) -> FloatArray:
        """Whitened readings (n, a, ...) projected off the parameters' columns, (N, ...)."""
        white = self.whiten(readings).reshape(len(self.basis), *readings.shape[2:])
        return white - np.tensordot(self.basis, np.tensordot(self.basis.T, white, axes=1), axes=1)

    def add(self, columns: FloatArray) -> "AddedColumns":
        """AddedColumns of a block (n, a, c), or of b blocks (n, a, c, b), in the readings' unit."""
        columns = columns if columns.ndim == 4 else columns[..., None]
        length = np.linalg.norm(self.whiten(columns), axis=(0, 1))
        length = np.where(length > 0.0, length, 1.0)
        free = np.moveaxis(self.remainder(columns) / length, -1, 0)
        basis, size, turned = np.linalg.svd(free, full_matrices=False)
        seen = size > _RANK_TOLERANCE
        size, basis = np.where(seen, size, 1.0), basis * seen[:, None]
        inverse = np.swapaxes(turned, 1, 2) / size[:, None] @ np.swapaxes(basis, 1, 2) / length.T[..., None]
        log_volume = np.log(size).sum(axis=1) + np.log(length).sum(axis=0)
        return AddedColumns(self, basis[..., : seen.sum(axis=1).max()], inverse, log_volume)

    def with_columns(self, columns: FloatArray) -> Self:
        """The model that has the coefficients of columns (n, a, c) as parameters too."""
        added = self.add(columns)
        (new,) = added.basis
        basis, residual = np.concatenate([self.basis, new], axis=1), self.residual - new @ (new.T @ self.residual)
        return replace(self, basis=basis, residual=residual, log_density=self.log_density - float(added.log_volume[0]))


@dataclass(frozen=True, eq=False)
class AddedColumns:
    """Blocks of c columns that are added to a model's parameters one block at a time.

    basis (b, N, k): orthonormal, of each block projected off the parameters, zeros where its rank is below another's;
    inverse (b, c, N): from whitened readings to the coefficients; log_volume (b,): 1/2 log |C' M C|.
    """

    model: LinearizedModel
    basis: FloatArray
    inverse: FloatArray
    log_volume: FloatArray

    @property
    def rank(self) -> int:
        """Combinations of coefficients that a test has: those of the block with the most."""
        return int(self.basis.shape[-1])

    @property
    def freedom(self) -> int:
        """Residual degrees of freedom after parameters and block."""
        return len(self.model.basis) - int(self.model.basis.shape[1]) - self.rank

    def explained(self, white: FloatArray) -> FloatArray:
        """Sums of squares (b, ...) that the blocks explain of whitened readings (N, ...)."""
        return np.asarray((np.tensordot(np.swapaxes(self.basis, 1, 2), white, axes=1) ** 2).sum(axis=1))

    def unexplained(self) -> FloatArray:
        """Sums of squares (b,) that the blocks leave of the model's residual."""
        taken = self.basis @ (np.swapaxes(self.basis, 1, 2) @ self.model.residual)[..., None]
        return np.asarray(((self.model.residual - taken[..., 0]) ** 2).sum(axis=1))

    def estimates(self, noise: float | None = None) -> tuple[FloatArray, FloatArray]:
        """Coefficients (b, c) of least squares and their standard errors; noise: by default that of the residuals."""
        sd = np.sqrt(self.unexplained() / self.freedom)[:, None] if noise is None else noise
        return self.inverse @ self.model.residual, sd * np.linalg.norm(self.inverse, axis=-1)

    def test(self, readings: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Each block's p value (b, ...) for readings (n, a, ...), and its log marginal likelihood (b, ...).

        NaN and 0 where nothing is tested or no freedom is left.
        """
        white = self.model.remainder(readings)
        explained = self.explained(white)
        if not self.rank or self.freedom < 1:
            return np.full(explained.shape, np.nan), np.zeros(explained.shape)
        unexplained = (white**2).sum(axis=0) - explained
        volume = self.log_volume.reshape(-1, *[1] * (unexplained.ndim - 1))
        log_likelihood = self.model.log_density - volume - 0.5 * self.freedom * np.log(unexplained)
        ratio = explained / self.rank * self.freedom / unexplained
        return special.fdtrc(self.rank, self.freedom, ratio), log_likelihood

    def power(self, limit: float, effects: FloatArray, noise: float) -> FloatArray:
        """Probabilities (...) that p is below a limit for effects (n, a, ...) in the span of a single block."""
        # loading it takes a fifth of a job's start, and few jobs come here
        from scipy import stats

        off_center = (self.model.remainder(effects) ** 2).sum(axis=0) / noise**2
        threshold = stats.f.isf(limit, self.rank, self.freedom)
        # scipy's distribution is wrong at 0 itself
        return np.asarray(stats.ncf.sf(threshold, self.rank, self.freedom, np.maximum(off_center, 1e-9)))


def largest_p(models: Iterable[LinearizedModel], columns: FloatArray, readings: FloatArray) -> FloatArray:
    """Largest p (b, ...) of columns, as `LinearizedModel.add` takes them, under several noises."""
    return np.asarray(np.max([one.add(columns).test(readings)[0] for one in models], axis=0))


def mean_p(models: Iterable[LinearizedModel], columns: FloatArray, readings: FloatArray) -> FloatArray:
    """Mean p (b, ...) of columns under several noises, weighted by their marginal likelihoods."""
    tests = [one.add(columns).test(readings) for one in models]
    p, log_likelihood = (np.array(part) for part in zip(*tests, strict=True))
    return np.asarray((p * special.softmax(log_likelihood, axis=0)).sum(axis=0))
