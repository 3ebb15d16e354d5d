"""The noise of a campaign as a quantity with an uncertainty: size, share of each axis, correlation, offsets of runs.

Along each series (a run, of one reflector) the noise e of axis a is

    e = n + s + o,   n the instrument's: a first-order autoregression of correlation phi,
                     s the non-repeatability: white,   o the run's offset: constant per series

In the cosine basis of a series of k points it is independent to good approximation, with the variance

    sigma_a^2 (1 - f_a + f_a S(w) + k rho [w = 0])

at half-wave number w, n being the share f_a of it and S its spectrum, of mean 1. Non-repeatability may have any size.
The smooth parts are limited by the instrument's stated noise: correlated noise to 30 % above it, offsets to the noise
itself. Without a stated noise the highest frequencies set this limit: larger smooth errors are not noise. The
parameters maximise the restricted likelihood, that of the residuals after all columns of calibration and effects have
been projected out (Patterson and Thompson, Recovery of inter-block information when block sizes are unequal, Biometrika
58, 1971), times their prior. Where the readings may also have a smooth discrepancy, its size is one of the parameters
and not part of the noise: a noise that had to account for it would be too large and too little correlated.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial
from typing import Self

import numpy as np
import numpy.typing as npt
from scipy.fft import dct
from scipy.linalg import qr, toeplitz
from scipy.optimize import minimize_scalar
from scipy.special import chdtr, expit, fdtrc

from rrru.arrays import FloatArray, IntArray
from rrru.cache import Latest
from rrru.campaign.noise import along_runs

_CORRELATIONS = np.array([0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9])
_OFFSETS = np.array([0.0, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2])
# degrees of freedom that a stated size is worth: 30 % off, 1 sigma
_STATED = 5.6
# share of the mean variance that no axis is below
_LEAST_AXIS = 1e-4
# a stated noise is wrong by at most this factor: 1 sigma of its prior; beyond, it is contradicted
CONTRADICTED = 1.3
# a stated noise is too large where a true one would leave so small residuals with this probability; assumed
_MAX_P_OF_STATED = 0.01
# residual degrees of freedom after all that may be fitted, for the noise to be estimated within some 20 %
MIN_FREE_NUMBERS = 15.0
# free means of series, of three numbers each, for offsets between them to show: those of two series
MIN_FREE_MEANS = 6.0
# deviations of a smooth discrepancy over the noise's that are tried, and the prior probability that there is one
_DISCREPANCIES = np.concatenate([[0.0], 2.0 ** np.arange(-1.0, 11.0)])
_SOME_DISCREPANCY = 0.1
# the size is found to so many octaves
_OCTAVES = 0.1
# offsets of a smaller share of the noise's variance are none
_NO_OFFSET = 0.05
# prior probability of no correlation, and of no offsets: many campaigns have neither, and readings that do not decide
# must not widen every interval
_NONE = 0.5
_ROUNDS, _LEAST_LEFT, _RANK = 4, 0.02, 1e-9
# how much coefficients with a prior explain depends on the noise: it is found in more rounds
_ROUNDS_OF_PRIORS = 20
# weights of two kinds of readings are found to this share, in at most so many rounds
_WEIGHT_TOLERANCE, _MAX_WEIGHTINGS = 0.01, 20
# with more columns than this the rank comes from their squares, to fewer digits
_MANY, _RANK_OF_SQUARES = 400, 1e-12
# of longer runs the spectrum is that of endless ones
_LONG = 400


@dataclass(frozen=True)
class NoiseModel:
    """axis_mm (3,): deviation of each axis, offsets apart; correlation: phi; offset: rho; correlated (3,): f_a.

    offset_posterior: values of rho that were tried with their posterior probabilities; alike: factor of the variance by
    which readings at one stop, which share the robot's errors, count as fewer; discrepancy: likeliest deviation over
    mean_mm of a smooth discrepancy along the series, 0 for none.
    """

    axis_mm: FloatArray
    correlation: float = 0.0
    offset: float = 0.0
    correlated: FloatArray | float = 1.0
    offset_posterior: tuple[tuple[float, float], ...] = ((0.0, 1.0),)
    alike: float = 1.0
    discrepancy: float = 0.0

    @classmethod
    def white(cls, noise_mm: float) -> Self:
        """Uncorrelated noise of one size (mm) on all axes."""
        return cls(np.full(3, float(noise_mm)))

    @property
    def offset_probability(self) -> float:
        """Posterior probability that offsets make more than a twentieth of the noise's variance."""
        return sum(probability for value, probability in self.offset_posterior if value > _NO_OFFSET)

    def drawn_offsets(self, generator: np.random.Generator, draws: int) -> FloatArray:
        """Draws (draws,) of the share of offsets from its posterior."""
        values, probabilities = np.array(self.offset_posterior).T
        return np.asarray(generator.choice(values, draws, p=probabilities / probabilities.sum()))

    @property
    def mean_mm(self) -> float:
        """Deviation per axis, offsets included, root mean square over the axes."""
        return float(np.sqrt((self.axis_mm**2).mean() * (1.0 + self.offset)))

    @property
    def counted(self) -> Self:
        """The model under which the readings count as independent."""
        return replace(self, axis_mm=self.axis_mm * np.sqrt(self.alike), alike=1.0)

    def of_size(self, noise_mm: float) -> Self:
        """The model of another `mean_mm`, with the same discrepancy in mm."""
        ratio = noise_mm / self.mean_mm
        return replace(self, axis_mm=self.axis_mm * ratio, discrepancy=self.discrepancy / ratio)

    def whitening(
        self, series: npt.ArrayLike, discrepancy: Callable[[FloatArray], FloatArray] | None = None
    ) -> "Whitening":
        """The Whitening of readings in series (m,) under this noise.

        discrepancy: from half-wave numbers (m,) to variances (m,) in mm^2 of a smooth discrepancy along the series.
        """
        series = np.asarray(series)
        waves, length = half_waves(series), lengths(series)
        variance = self.variance(waves, length)
        if discrepancy is not None:
            variance = variance + discrepancy(waves)[:, None]
        return Whitening(series, np.sqrt(variance))

    def variance(self, wave: FloatArray, length: npt.NDArray[np.int_]) -> FloatArray:
        """Variances (m, 3) in mm^2 in the cosine basis, by half-wave number and length (m,) of the series."""
        smooth, run = _densities(self.correlation, wave, length)
        return self.axis_mm**2 * (1.0 + self.correlated * (smooth - 1.0) + self.offset * run)


@dataclass(frozen=True, eq=False)
class Whitening:
    """The linear map that makes correlated readings independent with unit variance: cosines along each series.

    series (m,): of the rows; sd (m, a): standard deviations of the cosines.
    """

    series: npt.NDArray[np.generic]
    sd: FloatArray

    @cached_property
    def log_determinant(self) -> float:
        """Logarithm of the determinant of the map."""
        return float(-np.log(self.sd).sum())

    def __call__(self, values: FloatArray) -> FloatArray:
        """Whitened values (m, a, ...)."""
        cosines, _ = along_runs(values, self.series)
        return cosines / self.sd.reshape(*self.sd.shape, *[1] * (values.ndim - 2))


def half_waves(series: npt.NDArray[np.generic]) -> FloatArray:
    """Half-wave number (m,) from 0 on of each row's cosine in its series."""
    result = np.empty(len(series))
    for label in np.unique(series):
        here = np.flatnonzero(series == label)
        result[here] = np.arange(len(here))
    return result


def lengths(series: npt.NDArray[np.generic]) -> npt.NDArray[np.int_]:
    """Number of points (m,) of the series of each row."""
    _, number, count = np.unique(series, return_inverse=True, return_counts=True)
    return np.asarray(count[number])


def _spike_and_slab(density: FloatArray) -> FloatArray:
    """Prior probabilities (g,) over a grid that begins with none: half for none, the others by a density (g,)."""
    slab = density[1:] / max(density[1:].sum(), 1e-300)
    return np.concatenate([[_NONE if len(slab) else 1.0], (1.0 - _NONE) * slab])


def fit_noise(
    data: FloatArray,
    columns: FloatArray,
    series: npt.NDArray[np.generic],
    stated_mm: float | None = None,
    repeats: tuple[float, int] | None = None,
    discrepancy: Callable[[FloatArray], FloatArray] | None = None,
    prior_sd: FloatArray | None = None,
) -> NoiseModel:
    """NoiseModel of data (m, 3) after columns (m, 3, k) are projected out; series (m,).

    prior_sd (k,): prior standard deviations of the columns' coefficients, infinite for those of which nothing is known,
    None for all of them. A coefficient with a prior is a random effect: the residuals are those about its posterior
    mean, and it takes as many degrees of freedom from them as the readings determine it (Harville, Maximum likelihood
    approaches to variance component estimation, Journal of the American Statistical Association 72, 1977).

    stated_mm: stated s.d. per axis, None where none is; repeats: s.d. per axis of poses that were measured several
    times and its degrees of freedom, which count where the columns leave few degrees of freedom, None for none;
    discrepancy: from half-wave numbers (m,) to variances (m,), 1 on average, of a smooth discrepancy along the series
    that is not noise, None for none. A stated size that is not significantly above what is found is the result's.
    """
    together, wave = along_runs(np.concatenate([columns, data[..., None]], axis=-1), series)
    length, model, instrument_mm = lengths(series), NoiseModel.white(stated_mm or 1.0), stated_mm
    smooth = np.zeros((len(wave), 1)) if discrepancy is None else discrepancy(wave)[:, None]
    for _ in range(_ROUNDS if prior_sd is None else _ROUNDS_OF_PRIORS):
        variance = model.variance(wave, length) + (model.discrepancy * model.mean_mm) ** 2 * smooth
        white = (together / np.sqrt(variance)[..., None]).reshape(-1, together.shape[-1])
        left, share = _left(white[:, -1], white[:, :-1], prior_sd)
        seen = _Seen(variance * left.reshape(-1, 3) ** 2, share.reshape(-1, 3), wave, length, smooth)
        known = [(stated_mm**2, _STATED)] if stated_mm else []
        if repeats and repeats[1] and seen.free < MIN_FREE_NUMBERS:
            known.append((repeats[0] ** 2, float(repeats[1])))
            instrument_mm = instrument_mm or repeats[0]
        instrument_mm = instrument_mm or float(np.nan_to_num(seen.rough()))
        last, model = model, seen.most_likely(instrument_mm, known)
        new, old = ([*m.axis_mm, m.correlation, m.offset, m.discrepancy] for m in (model, last))
        if np.allclose(new, old, rtol=1e-2, atol=1e-2 * model.mean_mm):
            break
    if stated_mm and model.mean_mm < stated_mm and not _too_large(stated_mm, model.mean_mm, seen.free):
        return model.of_size(stated_mm)
    return model


def _too_large(stated_mm: float, found_mm: float, freedom: float) -> bool:
    """Whether a stated noise contradicts a smaller one that residuals of so many degrees of freedom show.

    Under the stated noise f found^2 / stated^2 follows a chi-square distribution of f degrees of freedom.
    """
    return bool(chdtr(freedom, freedom * (found_mm / stated_mm) ** 2) < _MAX_P_OF_STATED)


def high_frequency_noises(
    data: FloatArray, columns: FloatArray, series: npt.NDArray[np.generic], chosen: npt.NDArray[np.bool_]
) -> tuple[float, float]:
    """Standard deviations per axis of chosen rows (m,) and of the others by the upper half of the frequencies.

    data (m, 3), of which columns (m, 3, k) are projected out, along each series (m,). Smooth errors along a path
    without a column, such as effects that a calibration lacks, do not reach these frequencies. NaN for less than one
    degree of freedom there.

    Under one weight for all rows the residuals of the quieter rows have a part of the noise of the others. All rows are
    therefore divided by the standard deviation of their kind, and estimated again, until both ratios agree. Where the
    ratio runs away, as many columns fit the quieter rows exactly, one weight holds for all.
    """
    ratio, step, equal = 1.0, np.inf, (np.nan, np.nan)
    for number in range(_MAX_WEIGHTINGS):
        weight = np.where(chosen, 1.0, ratio)[:, None]
        weighted, its_columns = data * weight, columns * weight[..., None]
        together, wave = along_runs(np.concatenate([its_columns, weighted[..., None]], axis=-1), series)
        flat = together.reshape(-1, together.shape[-1])
        left, share = _left(flat[:, -1], flat[:, :-1])
        seen = _Seen((left**2).reshape(-1, 3), share.reshape(-1, 3), wave, lengths(series))
        found, its_others = (seen.rough(kind) for kind in (chosen, ~chosen))
        others = its_others / ratio
        equal = equal if number else (found, others)
        if not (found > 0.0 and others > 0.0):
            return equal
        before, ratio = ratio, found / others
        last, step = step, abs(np.log(ratio / before))
        if step < _WEIGHT_TOLERANCE:
            return found, others
        if number and step > last:
            return equal
    return equal


class BlockTests:
    """F tests of blocks of columns in addition to others, of data (m, 3) of equal noises.

    All columns (m, 3, k) and the data are reduced to one triangle, which has their sums of squares and their ranks; see
    `rrru.estimation.f_test`.
    """

    def __init__(self, data: FloatArray, columns: FloatArray) -> None:
        self._count, self._together = data.size, np.concatenate([columns, data[..., None]], axis=-1)
        # blocks are tested in addition to the same columns, one after another
        self._without = Latest(1)

    @cached_property
    def _triangle(self) -> FloatArray:
        flat = self._together.reshape(self._count, -1)
        return np.asarray(qr(flat, mode="r", check_finite=False)[0][: flat.shape[1]])

    def of(self, columns: IntArray, block: IntArray, prior_sd: FloatArray | None = None) -> tuple[float, float]:
        """The p value of a block (c,) in addition to columns (k,), numbers of both, and the degrees of freedom left.

        1 where the columns hold the block. prior_sd (k,): of the columns' coefficients, as for `fit_noise`, over the
        noise.
        """
        both = np.concatenate([columns, block])
        both_sd = None if prior_sd is None else np.concatenate([prior_sd, np.full(len(block), np.inf)])
        left, share = self._left(both, both_sd)
        asked = columns.tobytes(), None if prior_sd is None else prior_sd.tobytes()
        without, its_share = self._without.of(asked, lambda: self._left(columns, prior_sd))
        free = self._count - float((1.0 - share).sum())
        freedom, rank = round(free), round(float((its_share - share).sum()))
        if rank < 1 or freedom < 1:
            return 1.0, free
        unexplained = float(left @ left)
        ratio = (float(without @ without) - unexplained) / rank * freedom / max(unexplained, 1e-300)
        return float(fdtrc(rank, freedom, max(ratio, 0.0))), free

    def _left(self, columns: IntArray, prior_sd: FloatArray | None) -> tuple[FloatArray, FloatArray]:
        """`_left` of the triangle."""
        return _left(self._triangle[:, -1], self._triangle[:, columns], prior_sd)


def free_numbers(columns: FloatArray, prior_sd: FloatArray | None = None) -> float:
    """Degrees of freedom that columns (m, 3, k) leave; prior_sd (k,): as for `fit_noise`, over the noise."""
    flat = columns.reshape(-1, columns.shape[-1])
    return float(_left(np.zeros(len(flat)), flat, prior_sd)[1].sum())


def alike(
    data: FloatArray,
    columns: FloatArray,
    stop: npt.NDArray[np.int_],
    kind: npt.NDArray[np.int_],
    prior_sd: FloatArray | None = None,
) -> float:
    """Design effect of several readings at one stop: 1 + (t - 1) r, t readings at a stop, of correlation r.

    data (m, 3), of which columns (m, 3, k) are projected out; stop (m,): of each row; kind (m,): of reading, odd for
    orientations, which do not count; prior_sd (k,): as for `fit_noise`, over the noise. Source: Kish, Survey Sampling,
    1965, section 5.4 (design effect).

    Columns that all readings of a stop share take more of what is shared than of the rest. So r is that at which the
    products of pairs of residuals have the ratio to their squares that is expected after the projection.
    """
    counted = kind % 2 == 0
    count = np.bincount(stop[counted], minlength=stop.max() + 1).astype(float)
    if count.max() < 2.0:
        return 1.0
    basis = _basis(_with_priors(columns.reshape(data.size, -1), prior_sd))
    ours = basis[: data.size]
    left = (data.ravel() - ours @ (ours.T @ data.ravel())).reshape(-1, 3)
    size = np.sqrt(np.bincount(kind, (left**2).sum(axis=1)) / np.maximum(np.bincount(kind), 1))
    unit = left / np.maximum(size, 1e-300)[kind, None]
    # readings of a stop along one axis, and how many others each has
    group, own = (3 * stop[counted][:, None] + np.arange(3)).ravel(), np.flatnonzero(np.repeat(counted, 3))
    others = np.repeat(count[stop[counted]] - 1.0, 3)

    def of_pairs(values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Sums (c, k) of the others of a stop, and values (c, k) by their number, of values (3m, k) of readings."""
        sums = np.zeros((3 * len(count), values.shape[1]))
        np.add.at(sums, group, values[own])
        return sums[group] - values[own], others[:, None] * values[own]

    numbers = unit.reshape(-1, 1)
    products = [float((numbers[own] * made).sum()) for made in of_pairs(numbers)]
    made, counts = of_pairs(ours), float(others.sum())
    # independent readings, and identical ones, before and after the projection
    identical = ours.copy()
    identical[own] += made[0]
    seen = ours.T @ identical + basis[data.size :].T @ basis[data.size :]
    expected = []
    for form, before in zip(made, (0.0, counts), strict=True):
        apart = before - (ours[own] * form).sum()
        same = counts - 2.0 * (identical[own] * form).sum() + ((ours[own].T @ form) * seen).sum()
        expected.append((float(apart), float(same)))
    (pairs_apart, pairs_same), (squares_apart, squares_same) = expected
    pairs, squares = products
    wanted = squares * pairs_apart - pairs * squares_apart
    slope = pairs * (squares_same - squares_apart) - squares * (pairs_same - pairs_apart)
    share = wanted / slope if abs(slope) > 1e-300 else 0.0
    mean = (count**2).sum() / count.sum()
    return float(1.0 + (mean - 1.0) * np.clip(share, 0.0, 1.0))


def _densities(correlation: float, wave: FloatArray, length: npt.NDArray[np.int_]) -> tuple[FloatArray, FloatArray]:
    """Variances (m, 1) in the cosine basis of correlated noise of unit variance, and of offsets of unit variance."""
    density = np.empty(len(wave))
    for count in np.unique(length):
        here = length == count
        density[here] = _spectrum(correlation, int(count))[wave[here].astype(int)]
    return density[:, None], (length * (wave == 0))[:, None]


@lru_cache(maxsize=256)
def _spectrum(correlation: float, count: int) -> FloatArray:
    """Variances (count,) of an autoregression of unit variance in the cosine basis, exact for runs of usual length."""
    if count > _LONG:
        angle = np.pi * np.arange(count) / count
        return (1.0 - correlation**2) / (1.0 - 2.0 * correlation * np.cos(angle) + correlation**2)
    covariance = toeplitz(correlation ** np.arange(count, dtype=float))
    return np.diag(dct(dct(covariance, axis=0, norm="ortho"), axis=1, norm="ortho")).copy()


def _with_priors(columns: FloatArray, prior_sd: FloatArray | None) -> FloatArray:
    """Columns (n, k), and below them the readings of their coefficients that priors of s.d. (k,) are."""
    if prior_sd is None:
        return columns
    return np.concatenate([columns, np.diag(1.0 / prior_sd)[np.isfinite(prior_sd)]])


def _left(data: FloatArray, columns: FloatArray, prior_sd: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
    """Data (n,) projected off columns (n, k), and the share (n,) of each row's variance that remains.

    prior_sd (k,): of the columns' coefficients in data of unit noise, None where nothing is known of any. With B the
    columns and D the prior precisions the data lose B (B^T B + D)^-1 B^T of themselves.
    """
    if not columns.size:
        return data, np.ones(len(data))
    basis = _basis(_with_priors(columns, prior_sd))[: len(data)]
    return data - basis @ (basis.T @ data), np.clip(1.0 - (basis**2).sum(axis=1), 0.0, 1.0)


def _basis(columns: FloatArray) -> FloatArray:
    """Orthonormal basis (n, r) of columns (n, k), without combinations that rounding makes."""
    size = np.linalg.norm(columns, axis=0)
    unit = columns / np.where(size > 0.0, size, 1.0)
    if columns.shape[1] > _MANY:
        value, turned = np.linalg.eigh(unit.T @ unit)
        independent = value > _RANK_OF_SQUARES * value[-1]
        return np.asarray(unit @ (turned[:, independent] / np.sqrt(value[independent])))
    # the pivots of the triangle are those of the columns, and are found in a fraction of the time
    basis, triangle = qr(unit, mode="economic", check_finite=False)
    turned, pivots, _ = qr(triangle, mode="economic", pivoting=True)
    return np.asarray(basis @ turned[:, np.abs(np.diag(pivots)) > _RANK * np.abs(pivots[0, 0])])


@dataclass(frozen=True)
class _Grid:
    """Posterior over pairs (g, 2) of correlation and offset: weights (g,) over the highest log likelihood.

    size: of the discrepancy over the noise's deviation; correlated (3,): see NoiseModel.
    """

    size: float
    correlated: FloatArray
    pairs: FloatArray
    weight: FloatArray
    highest: float

    @property
    def evidence(self) -> float:
        """Log likelihood of the size, averaged over correlation and offset."""
        return float(np.log(self.weight.sum()) + self.highest)


class _Seen:
    """Data on the noise: squares (m, 3) in the cosine basis, each with its degrees of freedom.

    smooth: variances (m, 1), 1 on average, of a smooth discrepancy along a series, or 0.
    """

    def __init__(
        self,
        squares: FloatArray,
        share: FloatArray,
        wave: FloatArray,
        length: npt.NDArray[np.int_],
        smooth: FloatArray | None = None,
    ) -> None:
        self.freedom = np.where(share > _LEAST_LEFT, share, 0.0)
        self.squares = np.where(self.freedom > 0.0, squares, 0.0)
        self.wave, self.length = wave, length
        self._smooth = smooth if smooth is not None else np.zeros((len(wave), 1))

    def rough(self, chosen: npt.NDArray[np.bool_] | bool = True) -> float:
        """Deviation per axis by the upper half of the frequencies of chosen rows (m,), NaN where none is free."""
        upper = (self.wave > 0.5 * self.length) & chosen
        freedom = self.freedom[upper].sum()
        return float(np.sqrt(self.squares[upper].sum() / freedom)) if freedom >= 1.0 else np.nan

    @property
    def free(self) -> float:
        """Residual degrees of freedom of the readings after all that may be fitted."""
        return float(self.freedom.sum())

    @property
    def _shows_offsets(self) -> bool:
        """Whether the means of the series are free enough to show offsets between them."""
        return float(self.freedom[self.wave == 0].sum()) >= MIN_FREE_MEANS

    @cached_property
    def _by_wave(self) -> tuple[FloatArray, FloatArray, FloatArray, npt.NDArray[np.int_], FloatArray]:
        """Sums of squares and freedom (u, 3), half-wave number and length (u,) and smooth (u, 1) of series alike."""
        key = self.wave + self.length * (self.wave.max(initial=0.0) + 1.0)
        _, first, alike_rows = np.unique(key, return_index=True, return_inverse=True)
        summed = [np.zeros((len(first), 3)) for _ in range(2)]
        for total, part in zip(summed, (self.squares, self.freedom), strict=True):
            np.add.at(total, alike_rows, part)
        return summed[0], summed[1], self.wave[first], self.length[first], self._smooth[first]

    def most_likely(self, instrument_mm: float, known: Sequence[tuple[float, float]]) -> NoiseModel:
        """The NoiseModel of the posterior mean of correlation and offset, over a grid, and the likeliest sizes."""
        most = self._largest_discrepancy(known)
        sizes = _DISCREPANCIES[most >= _DISCREPANCIES]
        largest = (CONTRADICTED * instrument_mm) ** 2
        prior = np.full(len(sizes), _SOME_DISCREPANCY / max(len(sizes) - 1, 1))
        prior[0] = 1.0 - _SOME_DISCREPANCY
        value = np.array([self._over_grid(size, largest, known).evidence for size in sizes.tolist()]) + np.log(prior)
        best = int(value.argmax())
        size = float(sizes[best])
        if best:
            found = minimize_scalar(
                lambda octaves: -self._over_grid(2.0**octaves, largest, known).evidence,
                bounds=(np.log2(size) - 1.0, min(np.log2(size) + 1.0, np.log2(most))),
                method="bounded",
                options={"xatol": _OCTAVES},
            )
            size = float(2.0**found.x)
        return self._mean(self._over_grid(size, largest, known), known)

    def _largest_discrepancy(self, known: Sequence[tuple[float, float]]) -> float:
        """Upper limit of the discrepancy over the noise.

        Where nothing is known of the noise the readings at the highest frequencies show it, and at most half of their
        variance may be the discrepancy's. Without a limit its white part could explain them alone, with no noise.
        """
        if not self._smooth.any():
            return 0.0
        highest = float(self._smooth[self._smooth > 0.0].min())
        return float("inf") if known else 1.0 / np.sqrt(max(highest, 1e-12))

    def _over_grid(self, size: float, largest: float, known: Sequence[tuple[float, float]]) -> "_Grid":
        """Posterior of correlation and offset where the discrepancy has so many times the noise's deviation.

        largest: upper limit of the variance of the correlated part of the noise.
        """
        none = np.zeros(1)
        white = self._axes(self._shapes(none, none, size, 1.0), known)[0][0]
        # a discrepancy that explains a part of the squares leaves less noise, of which more may be correlated
        correlated = np.minimum(1.0, largest / white)
        # parameters that few degrees of freedom do not determine are set to none
        offsets = _OFFSETS[_OFFSETS * white.mean() <= largest] if self._shows_offsets else _OFFSETS[:1]
        correlations = _CORRELATIONS if self.free >= MIN_FREE_NUMBERS else _CORRELATIONS[:1]
        pairs = np.array([(correlation, offset) for correlation in correlations for offset in offsets])
        shapes = self._shapes(pairs[:, 0], pairs[:, 1], size, correlated)
        value = self._axes(shapes, known)[1] - 0.5 * np.einsum("ua,gua->g", self._by_wave[1], np.log(shapes))
        prior = np.outer(_spike_and_slab(1.0 - correlations), _spike_and_slab(np.exp(-offsets)))
        highest = float(value.max())
        return _Grid(size, correlated, pairs, prior.ravel() * np.exp(value - highest), highest)

    def _mean(self, grid: "_Grid", known: Sequence[tuple[float, float]]) -> NoiseModel:
        """The NoiseModel of the posterior mean of a grid, at the likeliest sizes of the axes."""
        weight = grid.weight / grid.weight.sum()
        correlation, offset = (float(mean) for mean in weight @ grid.pairs)
        shape = self._shapes(np.array([correlation]), np.array([offset]), grid.size, grid.correlated)
        values, place = np.unique(grid.pairs[:, 1], return_inverse=True)
        posterior = tuple(zip(values.tolist(), np.bincount(place, weight).tolist(), strict=True))
        axes = np.sqrt(self._axes(shape, known)[0][0])
        # over the deviation with offsets
        discrepancy = float(grid.size / np.sqrt(1.0 + offset))
        return NoiseModel(axes, correlation, offset, grid.correlated, posterior, discrepancy=discrepancy)

    def _shapes(
        self, correlation: FloatArray, offset: FloatArray, size: float, correlated: FloatArray | float
    ) -> FloatArray:
        """Variances (g, u, 3) over those of the axes at g correlations and offsets and a size of the discrepancy."""
        _, _, wave, length, smooth = self._by_wave
        result, smooth = np.empty((len(correlation), len(wave), 3)), size**2 * smooth
        for phi in np.unique(correlation).tolist():
            along, run = self._known_densities.of(phi, partial(_densities, phi, wave, length))
            chosen = correlation == phi
            result[chosen] = 1.0 + correlated * (along - 1.0) + offset[chosen, None, None] * run + smooth
        return result

    @cached_property
    def _known_densities(self) -> Latest:
        """`_densities` by correlation, the same for every size of the discrepancy."""
        return Latest(len(_CORRELATIONS) + 1)

    def _axes(self, shapes: FloatArray, known: Sequence[tuple[float, float]]) -> tuple[FloatArray, FloatArray]:
        """Variances (g, 3) of the axes under variances of shapes (g, u, 3), and their log posteriors (g,).

        Averaged over two models of even odds: one variance for all axes, and one of each axis.
        known: statements (variance in mm^2, degrees of freedom that it is worth).
        """
        squares, freedoms = self._by_wave[:2]
        sums, freedom = (squares / shapes).sum(axis=1), freedoms.sum(axis=0)
        stated = sum(worth for _, worth in known)
        total = sums.sum(axis=1) + sum(worth * variance for variance, worth in known)
        pooled = (total / (freedom.sum() + stated))[:, None]
        by_axis = np.where(freedom > 0.0, sums / np.maximum(freedom, 1e-9), pooled)
        by_axis = np.maximum(by_axis, _LEAST_AXIS * pooled)
        equal = -0.5 * (freedom * np.log(pooled) + sums / pooled).sum(axis=1)
        # a variance of each axis has two parameters more (Schwarz, Annals of Statistics 6, 1978)
        apart = -0.5 * (freedom * np.log(by_axis) + sums / by_axis).sum(axis=1) - np.log(max(freedom.sum(), 1.0))
        share = expit(apart - equal)[:, None]
        value = np.logaddexp(equal, apart)
        for variance, worth in known:
            value -= 0.5 * worth * (np.log(pooled / variance) + variance / pooled - 1.0)[:, 0]
        return share * by_axis + (1.0 - share) * pooled, value
