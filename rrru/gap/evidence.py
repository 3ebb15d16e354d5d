"""How well a hypothesis predicts the data, all its numbers averaged out: the marginal likelihood of linear models with
a discrepancy.

Along each run the data d (one axis, k points) are

    d = B b + X c + w + e,   e ~ N(0, sigma^2),   w ~ N(0, level^2 sigma^2 K),   c ~ N(0, (strength sigma)^2 S)

with the calibration's errors b (flat prior), the effects' coefficients c, and a discrepancy w for whatever the library
does not hold: K is diagonal in the cosine basis of the run and falls with the frequency, so that w is smooth along the
path, plus a small part that is not (Kennedy and O'Hagan, Bayesian calibration of computer models, 2001). S is scaled so
that `strength` is the rms of the effect's part of the gap per axis over sigma, the calibration's share taken out;
positive coefficients have the positive half of their prior. Strengths are averaged over a grid, even in their
logarithm; none makes a coefficient's prior wider than the largest size that its law allows.

The parameters of a law's shape, such as a time constant, may be off the grid on which they were tried: each has a
coefficient N(0, 1) on `Linear.laws`.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy.fft import dct
from scipy.optimize import lsq_linear
from scipy.special import logsumexp

from rrru.gap import evidence_kernels as kernels
from rrru.gap.terms import spread

LEVELS = np.array([0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0])
STRENGTHS = np.array([0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0])
# the discrepancy's spectrum: half its density is lost at this half-wave number along a run; share of it that is white
_HALF_WAVES, _WHITE = 3.0, 0.01
# a term of which the calibration leaves a smaller share of the mean square is not seen
_LEAST_VISIBLE = 1e-9


def along_runs(values, run):
    """Cosine transform of (n, ...) along each run, orthonormal, and the half-wave number (n,) of each row; run (n,)."""
    result, wave = np.empty_like(values), np.empty(len(run))
    for label in np.unique(run):
        rows = np.flatnonzero(run == label)
        result[rows] = dct(values[rows], axis=0, norm="ortho")
        wave[rows] = np.arange(len(rows))
    return result, wave


def spectrum(wave):
    """Variance (n,) of the discrepancy by half-wave number, 1 on average."""
    density = 1.0 / (1.0 + (wave / _HALF_WAVES) ** 2) + _WHITE
    return density / density.mean()


@dataclass(frozen=True)
class Evidence:
    """Evidence of sets of terms on one linearisation.

    library: effects by name; linear: `rrru.gap.case.Linear`; run (n,); noise_mm per axis.
    """

    library: dict
    linear: object
    run: np.ndarray
    noise_mm: float

    def __len__(self):
        return len(self.run)

    @cached_property
    def _offsets(self):
        """First column of each (effect, shape), and of each ("law", effect), among all columns but the
        calibration's.
        """
        sizes = [columns.shape[-1] for columns in self._blocks.values()]
        return dict(zip(self._blocks, np.cumsum([0, *sizes[:-1]]), strict=True))

    @property
    def _blocks(self):
        """All columns but the calibration's by key."""
        return self.linear.columns | {("law", name): columns for name, columns in self.linear.laws.items()}

    @cached_property
    def _grams(self):
        """Gram matrices (levels, K, K) of the whitened effects' columns and the data, the calibration projected out,
        constants (levels,), and the Gram matrix (K, K) of the same columns with the calibration's part, without
        discrepancy.
        """
        linear = self.linear
        p = linear.base.shape[-1]
        together = np.concatenate([linear.base, *self._blocks.values(), linear.data[..., None]], axis=-1)
        turned, wave = along_runs(together.reshape(len(self), -1), self.run)
        turned, shape = turned.reshape(together.shape), spectrum(wave)
        grams, constants = [], []
        whole = (together[..., p:] / self.noise_mm).reshape(-1, together.shape[-1] - p)
        for level in LEVELS:
            variance = 1.0 + level**2 * shape
            white = (turned / (self.noise_mm * np.sqrt(variance))[:, None, None]).reshape(-1, together.shape[-1])
            basis, triangle = np.linalg.qr(white[:, :p])
            rest = white[:, p:] - basis @ (basis.T @ white[:, p:])
            grams.append(rest.T @ rest)
            constants.append(
                -1.5 * np.log(variance).sum() - np.log(np.abs(np.diag(triangle))).sum() - 0.5 * grams[-1][-1, -1]
            )
        return np.array(grams), np.array(constants), whole.T @ whole

    @property
    def none(self):
        """Log evidence (levels,) of no effect at all."""
        return self._grams[1]

    def projected(self, terms):
        """What a set of terms needs: Gram (levels, k, k), moment (levels, k), prior size (k,), largest size (k,),
        positive (k,), owner (k,) of each coefficient; the coefficients of the terms come first, those of their shapes,
        owned by nobody, last.
        """
        maps, index, sizes, largest, positive, owner = [], [], [], [], [], []
        for number, term in enumerate(terms):
            coordinates = self.library[term.effect].coordinates
            matrix = spread(coordinates, term.legs)
            maps.append(matrix)
            index.append(self._offsets[term.effect, term.shape] + np.arange(len(coordinates)))
            sizes.append(matrix.T @ coordinates.typical / matrix.sum(axis=0))
            each = np.broadcast_to(coordinates.most, len(coordinates))
            largest.append(np.array([each[column > 0.0].max() for column in matrix.T]))
            positive.append(matrix.T @ coordinates.positive > 0)
            owner.append(np.full(matrix.shape[1], number))
        for term in terms:
            if term.effect in self.linear.laws:
                count = self.linear.laws[term.effect].shape[-1]
                maps.append(np.eye(count))
                index.append(self._offsets["law", term.effect] + np.arange(count))
                sizes.append(np.ones(count))
                largest.append(np.full(count, np.inf))
                positive.append(np.zeros(count, dtype=bool))
                owner.append(np.full(count, len(terms)))
        index = np.concatenate(index)
        k = sum(matrix.shape[1] for matrix in maps)
        join, row, column = np.zeros((len(index), k)), 0, 0
        for matrix in maps:
            join[row : row + matrix.shape[0], column : column + matrix.shape[1]] = matrix
            row, column = row + matrix.shape[0], column + matrix.shape[1]
        grams, _, whole = self._grams
        gram = join.T @ grams[:, index[:, None], index] @ join
        raw = join.T @ whole[index[:, None], index] @ join
        moment = grams[:, index, -1] @ join
        size, owner = np.concatenate(sizes), np.concatenate(owner)
        for number in range(len(terms)):
            own = owner == number
            power, total = ((np.diag(g)[own] * size[own] ** 2).sum() / (3.0 * len(self)) for g in (gram[0], raw))
            # of what the calibration takes up, rounding is all that is left: it must not be blown up to the size of an
            # effect
            size[own] /= np.sqrt(max(power, _LEAST_VISIBLE * total, 1e-30))
        return gram, moment, size, np.concatenate(largest), np.concatenate(positive), owner

    def over_strengths(self, terms, strengths=None, levels=slice(None)):
        """Log evidence (levels, combinations) over every combination of the terms' strengths, and the combinations (m,
        terms).

        strengths: grids, one per term, by default STRENGTHS for each.
        """
        gram, moment, size, largest, positive, owner = self.projected(terms)
        combinations = np.array(list(product(*(strengths or (STRENGTHS,) * len(terms)))))
        scale = np.minimum(_with_laws(combinations)[:, owner] * size, largest)
        gained = kernels.log_evidence(
            np.ascontiguousarray(gram[levels]),
            np.ascontiguousarray(moment[levels]),
            np.ascontiguousarray(scale),
            positive,
        )
        return self.none[levels, None] + gained, combinations

    def score(self, terms, strengths=None, levels=slice(None)):
        """Log evidence (levels,) of a set of terms, averaged over their strengths."""
        if not terms:
            return self.none[levels]
        value, _ = self.over_strengths(terms, strengths, levels)
        return averaged(value, len(terms))

    def scales(self, terms, strengths):
        """Prior standard deviations (k,) of the terms' coefficients at given strengths."""
        if not terms:
            return np.zeros(0)
        _, _, size, largest, _, owner = self.projected(terms)
        own = owner < len(terms)
        return np.minimum(np.asarray(strengths)[owner[own]] * size[own], largest[own])

    def explained(self, hypothesis):
        """Rms per axis, over sigma, of what a hypothesis explains at its best level and strengths, the calibration's
        share taken out.
        """
        if not hypothesis.terms:
            return 0.0
        level = int(hypothesis.evidence.argmax())
        mean, _ = self.posterior(hypothesis.terms, hypothesis.strengths[level], level)
        gram = self.projected(hypothesis.terms)[0][0]
        return float(np.sqrt(max(mean @ gram @ mean, 0.0) / (3.0 * len(self))))

    def posterior(self, terms, strengths, level):
        """Mean (k,) and covariance (k, k) of the coefficients of a set of terms at given strengths and discrepancy
        level (an index).

        The mean obeys the positive coefficients; the covariance does not know of them.
        """
        gram, moment, size, largest, positive, owner = self.projected(terms)
        scale = np.minimum(_with_laws(np.asarray(strengths)[None])[0, owner] * size, largest)
        precision = gram[level] + np.diag(scale**-2.0)
        covariance = np.linalg.inv(precision)
        mean = covariance @ moment[level]
        if (mean[positive] < 0.0).any():
            mean = _not_negative(precision, moment[level], positive)
        return mean, covariance


def averaged(value, terms):
    """Log evidence (levels,) averaged over the strengths of a number of terms from that of every combination (levels,
    m) of them.

    A grid that was cut short counts as the whole one.
    """
    return logsumexp(value, axis=1) - terms * np.log(len(STRENGTHS))


def _with_laws(strengths):
    """Strengths (m, terms) with the strength 1 of all laws' shapes appended: (m, terms + 1)."""
    return np.concatenate([strengths, np.ones((len(strengths), 1))], axis=1)


def _not_negative(precision, moment, positive):
    """The point (k,) of highest posterior density with no negative positive coefficient: bounded least squares on the
    Cholesky factor.
    """
    factor = np.linalg.cholesky(precision)
    low = np.where(positive, 0.0, -np.inf)
    return lsq_linear(factor.T, np.linalg.solve(factor, moment), bounds=(low, np.inf), method="bvls").x
