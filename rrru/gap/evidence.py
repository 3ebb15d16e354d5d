"""How well a hypothesis predicts the data, all its numbers averaged out: the marginal likelihood of linear models.

Along each run the data d (one axis, k points) are

    d = B b + X c + w + e,   w ~ N(0, level^2 sigma^2 K),   c ~ N(0, (strength sigma)^2 S)

with noise e as in `rrru.gap.noise_model`, of mean variance sigma^2, the calibration's deviations b (flat prior), the
effects' coefficients c, and a discrepancy w for whatever the library does not hold: K is diagonal in the cosine basis
of the run and falls with the frequency, so that w is smooth along the path, plus a small part that is not (Kennedy and
O'Hagan, Bayesian calibration of computer models, 2001). S is scaled so that `strength` is the rms of the effect's part
of the gap per axis over sigma, the calibration's share taken out; positive coefficients have the positive half of it.
Strengths are averaged over a grid, even in their logarithm; none makes a prior wider than its law's largest size.

A law's shape parameters may be off the grid on which they were tried: each has a coefficient N(0, 1) on
`Linear.shape_columns`.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import lsq_linear

from rrru.campaign.noise import along_runs
from rrru.gap import evidence_kernels as kernels
from rrru.gap.noise_model import NoiseModel, lengths
from rrru.gap.terms import EACH, SAME, per_leg, spread

LEVELS = np.array([0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0])
STRENGTHS = np.array([0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0])
# times that each of many strengths is found about the others
_SWEEPS = 2
# the discrepancy's spectrum: half its density is lost at this half-wave number along a run; share of it that is white
_HALF_WAVES, _WHITE = 3.0, 0.01
# a term of which the calibration leaves a smaller share of the mean square is not seen
_LEAST_VISIBLE = 1e-9


def spectrum(wave):
    """Variance (n,) of the discrepancy by half-wave number (n,), 1 on average."""
    density = 1.0 / (1.0 + (wave / _HALF_WAVES) ** 2) + _WHITE
    return density / density.mean()


class _Prior(NamedTuple):
    """Prior of k coefficients: their columns' numbers, sizes at strength 1, largest sizes, and which are positive."""

    index: np.ndarray
    size: np.ndarray
    largest: np.ndarray
    positive: np.ndarray


@dataclass(frozen=True)
class Projected:
    """Least squares of k coefficients with their priors, the calibration taken out.

    Those of the terms come first, those of their shapes, owned by nobody, last. gram (levels, k, k), moment (levels,
    k); size, largest, positive (k,): of the prior; owner (k,): number of the term, the terms' count for nobody.
    """

    gram: np.ndarray
    moment: np.ndarray
    size: np.ndarray
    largest: np.ndarray
    positive: np.ndarray
    owner: np.ndarray

    def scale(self, strengths):
        """Prior standard deviations (m, k) at strengths (m, terms)."""
        each = np.concatenate([strengths, np.ones((len(strengths), 1))], axis=1)
        return np.minimum(each[:, self.owner] * self.size, self.largest)


@dataclass(frozen=True)
class ModelEvidence:
    """Evidence of sets of terms on one linearisation.

    library: effects by name; linear: `rrru.gap.case.Linear`; run (n,): the series of each row; noise: a NoiseModel.
    """

    library: dict
    linear: object
    run: np.ndarray
    noise: NoiseModel

    def __len__(self):
        return len(self.run)

    @cached_property
    def _layout(self):
        """Numbers of all columns but the calibration's by (effect, shape, "each" or "same") and effect.

        With the matrix (K, k) that makes them, those of one value on all legs being sums, of the linearisation's.
        """
        linear = self.linear
        blocks = [((*key, EACH), columns.shape[-1]) for key, columns in linear.columns.items()]
        blocks += [(name, columns.shape[-1]) for name, columns in linear.shape_columns.items()]
        ends = np.cumsum([0, *(size for _, size in blocks)])
        numbers = {key: np.arange(first, first + size) for (key, size), first in zip(blocks, ends, strict=False)}
        every, made = np.eye(ends[-1]), [np.eye(ends[-1])]
        for name, shape in linear.columns:
            if per_leg(self.library[name]):
                sums = every[:, numbers[name, shape, EACH]] @ spread(self.library[name].coordinates, SAME)
                numbers[name, shape, SAME] = sum(map(np.size, made)) // len(every) + np.arange(sums.shape[1])
                made.append(sums)
        return numbers, np.concatenate(made, axis=1)

    @cached_property
    def _grams(self):
        """Gram matrices (levels, k, k) of the whitened columns, their moments (levels, k) with the data, constants.

        The calibration is projected out; of the last matrix (k, k), without discrepancy, it is not.
        """
        linear, (_, join) = self.linear, self._layout
        p = linear.base.shape[-1]
        blocks = (linear.base, *linear.columns.values(), *linear.shape_columns.values(), linear.data[..., None])
        together = np.concatenate(blocks, axis=-1)
        cosines, wave = along_runs(together.reshape(len(self), -1), self.run)
        cosines, shape = cosines.reshape(together.shape), spectrum(wave)
        unit, own = self.noise.mean_mm, self.noise.variance(wave, lengths(self.run)) / self.noise.mean_mm**2
        join = block_diag(join, 1.0)
        grams, constants = [], []
        for level in LEVELS:
            variance = own + level**2 * shape[:, None]
            white = (cosines / (unit * np.sqrt(variance))[..., None]).reshape(-1, together.shape[-1])
            basis, triangle = np.linalg.qr(white[:, :p])
            rest = white[:, p:] - basis @ (basis.T @ white[:, p:])
            gram = rest.T @ rest
            grams.append(join.T @ gram @ join)
            constants.append(
                -0.5 * np.log(variance).sum() - np.log(np.abs(np.diag(triangle))).sum() - 0.5 * gram[-1, -1]
            )
        grams, whole = np.array(grams), (together[..., p:] / unit).reshape(-1, together.shape[-1] - p)
        whole = join.T @ (whole.T @ whole) @ join
        return grams[:, :-1, :-1], grams[:, :-1, -1], np.array(constants), whole[:-1, :-1]

    @property
    def none(self):
        """Log evidence (levels,) of no effect at all."""
        return self._grams[2]

    @cached_property
    def _priors(self):
        """Priors by term and by effect whose shape parameters are fitted, made when they are asked for."""
        numbers = {name: self._layout[0][name] for name in self.linear.shape_columns}
        return {name: _Prior(k, np.ones(len(k)), np.full(len(k), np.inf), k < 0) for name, k in numbers.items()}

    def _prior(self, term):
        """The prior of one term's coefficients."""
        if term not in self._priors:
            coordinates, (grams, _, _, whole) = self.library[term.effect].coordinates, self._grams
            matrix = spread(coordinates, term.legs)
            index = self._layout[0][term.effect, term.shape, SAME if term.legs == SAME else EACH]
            index = index if term.legs in (EACH, SAME) else index[coordinates.legs == term.legs]
            size = matrix.T @ coordinates.typical / matrix.sum(axis=0)
            power, total = ((gram[index, index] * size**2).sum() / (3.0 * len(self)) for gram in (grams[0], whole))
            # of what the calibration takes up, rounding is left: it must not be blown up to the size of an effect
            size /= np.sqrt(max(power, _LEAST_VISIBLE * total, 1e-30))
            most = np.broadcast_to(coordinates.most, len(coordinates))
            largest = np.array([most[column > 0.0].max() for column in matrix.T])
            self._priors[term] = _Prior(index, size, largest, matrix.T @ coordinates.positive > 0)
        return self._priors[term]

    def projected(self, terms, levels=slice(None)):
        """The projected problem of a set of terms at discrepancy levels (indices)."""
        priors = [self._prior(term) for term in terms]
        priors += [self._priors[t.effect] for t in terms if t.effect in self.linear.shape_columns]
        owner = np.repeat(np.minimum(np.arange(len(priors)), len(terms)), [len(prior.index) for prior in priors])
        index, *rest = (np.concatenate(parts) for parts in zip(*priors, strict=True))
        grams, moments, *_ = self._grams
        return Projected(grams[levels][:, index[:, None], index], moments[levels][:, index], *rest, owner)

    def over_strengths(self, terms, strengths=None, levels=slice(None)):
        """Log evidence (levels, m) over every combination of the terms' strengths, and the combinations (m, terms).

        strengths: grids, one per term, by default STRENGTHS for each.
        """
        problem = self.projected(terms, levels)
        combinations = np.array(list(product(*(strengths or (STRENGTHS,) * len(terms)))))
        scale = np.ascontiguousarray(problem.scale(combinations))
        gram, moment = np.ascontiguousarray(problem.gram), np.ascontiguousarray(problem.moment)
        return self.none[levels, None] + kernels.log_evidence(gram, moment, scale, problem.positive), combinations

    def independent(self, terms, levels):
        """Log evidence (l,) of many terms at levels (indices), and their best strengths (l, terms).

        Averaged over each strength about the others' best, as if they were independent of each other.
        """
        evidence, best = np.empty(len(levels)), np.ones((len(levels), len(terms)))
        for row, level in enumerate(levels):
            losses = np.zeros(len(terms))
            for _ in range(_SWEEPS):
                for k, term in enumerate(terms):
                    # what is tried comes last: the others' part stands
                    others = *terms[:k], *terms[k + 1 :]
                    grids = *([strength] for strength in np.delete(best[row], k)), STRENGTHS
                    value, _ = self.over_strengths((*others, term), grids, [level])
                    best[row, k], highest = STRENGTHS[value[0].argmax()], value.max()
                    losses[k] = averaged(value, 1)[0] - highest
            evidence[row] = highest + losses.sum()
        return evidence, best

    def scales(self, terms, strengths):
        """Prior standard deviations (k,) of the terms' coefficients at given strengths."""
        if not terms:
            return np.zeros(0)
        problem = self.projected(terms, [0])
        return problem.scale(np.asarray(strengths)[None])[0, problem.owner < len(terms)]

    def explained(self, hypothesis, effects):
        """Rms per axis, over sigma, of what some effects of a hypothesis explain at its best, calibration taken out."""
        if hypothesis.effects.isdisjoint(effects):
            return 0.0
        level = int(hypothesis.evidence.argmax())
        mean, _ = self.coefficients(hypothesis.terms, hypothesis.strengths[level], level)
        problem = self.projected(hypothesis.terms, [0])
        chosen = np.array([*(term.effect in effects for term in hypothesis.terms), True])
        mean = np.where(chosen[problem.owner], mean, 0.0)
        return float(np.sqrt(max(mean @ problem.gram[0] @ mean, 0.0) / (3.0 * len(self))))

    def coefficients(self, terms, strengths, level):
        """Mean (k,) and covariance (k, k) of the coefficients of a set of terms at strengths and a level (an index).

        The mean obeys the positive coefficients; the covariance does not know of them.
        """
        problem = self.projected(terms, [level])
        moment, positive = problem.moment[0], problem.positive
        precision = problem.gram[0] + np.diag(problem.scale(np.asarray(strengths)[None])[0] ** -2.0)
        covariance = np.linalg.inv(precision)
        mean = covariance @ moment
        if (mean[positive] < 0.0).any():
            mean = _not_negative(precision, moment, positive)
        return mean, covariance


def averaged(value, terms):
    """Log evidence (levels,) over some terms' strengths from (levels, m); a grid cut short counts as the whole one."""
    return kernels.log_sum_exp(value) - terms * np.log(len(STRENGTHS))


def _not_negative(precision, moment, positive):
    """The most probable point (k,) without negative positive coefficients: bounded least squares."""
    factor = np.linalg.cholesky(precision)
    low = np.where(positive, 0.0, -np.inf)
    return lsq_linear(factor.T, np.linalg.solve(factor, moment), bounds=(low, np.inf), method="bvls").x
