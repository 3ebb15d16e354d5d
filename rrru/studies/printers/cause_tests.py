"""What a printer's readings say about a cause: how likely noise explains as much, whatever the noises' ratio is.

A cause adds columns to the linear fit about the answer, and F compares what they explain with what they leave (Cook and
Weisberg, Residuals and Influence in Regression, 1982, 2.2; a bad reading is a column with a single one). F needs the
ratio of a height's noise to a distance's, which few readings tell. So p is the mean of F's over ratios from 1/8 to 2,
each as likely as it makes what the cause cannot explain (restricted likelihood, Harville, Journal of the American
Statistical Association 72, 1977; the ratio's logarithm is uniform beforehand). What the cause explains is foretold from
the rest this way (a partial predictive p, Bayarri and Berger, ibid. 95, 2000), and a bad reading does not judge its own
noise. The level holds on the average over these ratios, and for every ratio from a quarter to 1 by simulation.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import optimize, special

from rrru.fit.identifiability import RANK_TOLERANCE
from rrru.studies.printers.printer_fit import PrinterFit

BAD_READING = "bad_reading"
# ASSUME noise of a height over that of a distance: a probe is a quarter as bad as calipers to as bad, and a factor of 2
# on either side so that the level holds at these ends too
_RATIOS = np.geomspace(0.125, 2.0, 9)
_POWER, _DRAWS, _SEED = 0.9, 500, 1
# Ptt3's numbers of a leg
_SLIDER, _ARM, _RISE, _SWING = 0, 1, 4, 5


def cause_columns(result):
    """Change (n, k) of the readings of a PrinterFit by each cause, and the unit of its number where k is 1, by name.

    Arms, towers that lean (three angles outwards, three sideways), and carriages' steps of other lengths, per tower.
    With distances: calipers with a wrong scale or offset, and a measured object that is stretched along x, shrunk along
    y, and skewed.
    """
    residuals, deviations = result.residuals, result.fit.deviations
    n, m = len(residuals.height_mm), len(residuals.distance_mm)
    places = residuals.places(deviations)
    gradient = residuals.gradient(places)
    moved = residuals.mechanism.leg_jacobian(places, residuals.actuators, deviations)
    by_leg = np.einsum("rna,nalc->rlc", gradient, moved)
    columns = {}
    if not m:
        columns["arms"] = by_leg[..., _ARM], ""
    else:
        distances = np.concatenate([np.zeros(n), residuals.distance_mm])[:, None]
        between = places[n : n + m] - places[n + m :]
        x, y, _ = between.T
        shape = np.stack([x**2 - y**2, 2.0 * x * y], axis=1) / np.linalg.norm(between, axis=1, keepdims=True)
        columns["caliper_scale"] = distances, "mm/mm"
        columns["caliper_offset"] = np.sign(distances), "mm"
        columns["object_shape"] = np.concatenate([np.zeros((n, 2)), shape]), ""
    columns["step_scale"] = np.einsum("rna,nal,nl->rl", gradient, moved[..., _SLIDER], residuals.actuators), ""
    columns["tower_lean"] = np.concatenate([by_leg[..., _RISE], by_leg[..., _SWING]], axis=1), ""
    return columns


@dataclass(frozen=True)
class Weighing:
    """Readings under one ratio of noises.

    weight (n,): of every reading; absorbed (n, a): orthonormal basis of weighted readings that the fit absorbs; volume:
    logarithm of the weights' product over the weighted columns' volume, the likelihood's factor without data.
    """

    weight: np.ndarray
    absorbed: np.ndarray
    volume: float

    @classmethod
    def of(cls, jacobian, weight):
        """The weighing of a fit with columns (n, p)."""
        basis, triangle = np.linalg.qr(jacobian * weight[:, None])
        return cls(weight, basis, np.log(weight).sum() - np.log(np.abs(np.diag(triangle))).sum())

    def left(self, readings):
        """Readings (..., n) weighted, less what the fit absorbs."""
        weighted = readings * self.weight
        return weighted - (weighted @ self.absorbed) @ self.absorbed.T

    def basis(self, columns):
        """Orthonormal basis (n, r) of what the fit does not absorb of columns (n, k), and its volume's logarithm."""
        scale = np.linalg.norm(columns * self.weight[:, None], axis=0)
        basis, size, _ = np.linalg.svd(self.left((columns / scale).T).T, full_matrices=False)
        kept = size > RANK_TOLERANCE
        return basis[:, kept], np.log(size[kept]).sum() + np.log(scale).sum()

    def single(self):
        """Bases (n, n, 1) of every reading by itself, zero for one that the fit absorbs whole, and their volumes'."""
        free = np.eye(len(self.weight)) - self.absorbed @ self.absorbed.T
        size = np.linalg.norm(free, axis=1, keepdims=True)
        seen = size > RANK_TOLERANCE
        volume = np.log(np.where(seen, size, 1.0)[:, 0] * self.weight)
        return np.where(seen, free / size, 0.0)[..., None], volume

    def beside(self, columns):
        """The weighing of a fit that has columns (n, k) too."""
        basis, volume = self.basis(columns)
        return Weighing(self.weight, np.concatenate([self.absorbed, basis], axis=1), self.volume - volume)

    def p(self, bases, volumes, readings):
        """Probabilities (..., b) that noise explains as much of readings (..., n) as bases (b, n, r), and the log
        likelihoods (..., b) of what they leave; NaN without freedom.
        """
        left, count = self.left(readings), bases.shape[-1]
        explained = (np.einsum("...n,bnr->...br", left, bases) ** 2).sum(axis=-1)
        freedom = len(self.weight) - self.absorbed.shape[1] - count
        if not count or freedom < 1:
            return np.full(explained.shape, np.nan), np.zeros(explained.shape)
        rest = (left**2).sum(axis=-1)[..., None] - explained
        likelihood = self.volume - volumes - 0.5 * freedom * np.log(rest)
        return special.fdtrc(count, freedom, explained / count * freedom / rest), likelihood


@dataclass(frozen=True)
class CauseTests:
    """The readings of a PrinterFit as a linear model about its answer, under every ratio of noises."""

    result: PrinterFit

    @cached_property
    def columns(self):
        """See `cause_columns`."""
        return cause_columns(self.result)

    @cached_property
    def readings_mm(self):
        """Readings (n,) less those of the answer."""
        return self.result.residuals.measured_mm - self.result.residuals.predicted_mm(self.result.fit.deviations)

    @cached_property
    def own_weighing(self):
        """The weighing under the firmware's ratio."""
        return self._weighing(self.result.residuals.root_weight)

    @cached_property
    def weighings(self):
        """Under every ratio of noises; heights alone have one."""
        residuals = self.result.residuals
        height = np.arange(len(residuals)) < len(residuals.height_mm)
        if height.all():
            return [self.own_weighing]
        return [self._weighing(np.where(height, 1.0 / ratio, 1.0)) for ratio in _RATIOS]

    def _weighing(self, weight):
        residuals = self.result.residuals
        jacobian = residuals.jacobian(self.result.fit.deviations)[:, 0] / residuals.root_weight[:, None]
        return Weighing.of(jacobian, weight)

    def _bases(self, name, weighing):
        """Bases (b, n, r) of a cause, one, or of a bad reading one per reading, and their volumes'."""
        if name == BAD_READING:
            return weighing.single()
        basis, volume = weighing.basis(self.columns[name][0])
        return basis[None], volume

    @cached_property
    def bases(self):
        """Bases (b, n, r) of every cause by name, under the firmware's ratio."""
        return {name: self._bases(name, self.own_weighing)[0] for name in (*self.columns, BAD_READING)}

    @cached_property
    def _all_bases(self):
        """What `_bases` gives, of every cause by name, under each weighing."""
        return {name: [self._bases(name, one) for one in self.weighings] for name in (*self.columns, BAD_READING)}

    def p(self, name, readings=None, beside=None):
        """Mean p over the ratios for a cause, (...) for readings (..., n), by default its own.

        Of a bad reading it is (..., n), of every reading, times their number (Bonferroni). beside: columns (n, k) that
        are fitted too.
        """
        readings = self.readings_mm if readings is None else readings
        weighings, bases = self.weighings, self._all_bases[name]
        if beside is not None:
            weighings = [one.beside(beside) for one in weighings]
            bases = [self._bases(name, one) for one in weighings]
        parts = [one.p(*basis, readings) for one, basis in zip(weighings, bases, strict=True)]
        each, likelihood = (np.array(part) for part in zip(*parts, strict=True))
        mean = (each * special.softmax(likelihood, axis=0)).sum(axis=0)
        return np.minimum(mean * mean.shape[-1], 1.0) if name == BAD_READING else mean[..., 0]

    def p_without_any(self, name):
        """Largest p of a cause with any single reading left out."""
        return float(np.max([self.p(name, beside=column[:, None]) for column in np.eye(len(self.readings_mm))]))

    def imitators(self, name, share, reading=0):
        """Names of the other causes that hold a share of what a cause explains, under the firmware's ratio.

        reading: that of a bad reading.
        """
        basis = self.bases[name][reading if name == BAD_READING else 0]
        explained = basis @ (basis.T @ self.own_weighing.left(self.readings_mm))
        held = {
            other: (np.einsum("n,bnr->br", explained, bases) ** 2).sum(axis=-1).max()
            for other, bases in self.bases.items()
            if other != name
        }
        return tuple(other for other, part in held.items() if basis.size and part >= share * (explained @ explained))

    def always_imitated(self, name, share):
        """Whether another cause holds that share of everything that a cause can explain, under the firmware's ratio."""
        others = [self.bases[other][0] for other in self.columns if other != name]

        def imitated(basis):
            rank = basis.shape[1]
            able = [other for other in others if other.shape[1] >= rank > 0]
            return any(np.linalg.norm(other.T @ basis, -2) ** 2 >= share for other in able)

        return all(imitated(basis) for basis in self.bases[name])

    def estimate(self, name):
        """Number of a cause with a single column, and its standard error, under the firmware's ratio; else NaN."""
        one, (block, _) = self.own_weighing, self.columns[name]
        freedom = self.result.freedom - 1
        if block.shape[1] > 1 or freedom < 1:
            return np.nan, np.nan
        seen, left = one.left(block[:, 0]), one.left(self.readings_mm)
        value = seen @ left / (seen @ seen)
        return value, np.sqrt(((left - value * seen) ** 2).sum() / freedom / (seen @ seen))

    def detectable_mm(self, name, limit):
        """Rms in mm over the readings of what the calibration does not absorb of a cause that shows, 9 times of 10.

        That is, has p below a limit. By simulation with the fit's noise in the firmware's ratio and causes in random
        directions; of a bad reading the error of a random one. NaN where no size does.
        """
        generator, weight = np.random.default_rng(_SEED), self.own_weighing.weight
        noise = generator.normal(size=(_DRAWS, len(weight))) * self.result.fit.noise_mm / weight
        if name == BAD_READING:
            effect = generator.permuted(np.tile(np.eye(len(weight))[0], (_DRAWS, 1)), axis=1)
        else:
            (basis,) = self.bases[name]
            effect = generator.normal(size=(_DRAWS, basis.shape[1])) @ basis.T / weight
            effect /= np.sqrt((effect**2).mean(axis=1, keepdims=True))

        def surplus(log_size):
            p = self.p(name, noise + np.exp(log_size) * effect)
            return np.mean((p.min(axis=-1) if name == BAD_READING else p) < limit) - _POWER

        low, high = np.log(self.result.fit.noise_mm) + np.log([0.1, 1e4])
        return float(np.exp(optimize.bisect(surplus, low, high, xtol=1e-3))) if surplus(high) > 0.0 else np.nan
