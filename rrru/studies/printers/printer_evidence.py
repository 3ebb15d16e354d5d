"""What a printer's readings say about a cause: how likely noise explains as much, whatever the noise of a height is
beside that of a distance.

A cause adds columns to the linear fit about the answer, and F compares what they explain with what they leave (Cook and
Weisberg, Residuals and Influence in Regression, 1982, 2.2; a bad reading is a column with a single one). F needs the
noises' ratio, which seven heights do not give: false alarms are up to six times too many where the firmware's ratio is
wrong. So p is the largest over all ratios, which holds the level wherever between a quarter and 1 the true one is.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import optimize, stats

from rrru.fit.identifiability import RANK_TOLERANCE

BAD_READING = "bad_reading"
# ASSUME noise of a height over that of a distance: a probe is at best four times as good as calipers, at worst no
# better
_RATIOS = np.geomspace(0.25, 1.0, 4)
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
    heights, between = len(residuals.height_mm), _between(residuals, deviations)
    places = residuals.mechanism.forward(residuals.actuators, deviations)
    moved = residuals.mechanism.leg_jacobian(places, residuals.actuators, deviations)
    by_leg = np.einsum("rna,nalc->rlc", residuals.gradient(deviations), moved)
    steps = np.einsum("rna,nal,nl->rl", residuals.gradient(deviations), moved[..., _SLIDER], residuals.actuators)
    found = {}
    if result.printer.parameter_set == "heights":
        found["arms"] = by_leg[..., _ARM], ""
    else:
        distances = np.concatenate([np.zeros(heights), residuals.distance_mm])[:, None]
        x, y = between[:, 0], between[:, 1]
        shape = np.stack([x**2 - y**2, 2.0 * x * y], axis=1) / np.linalg.norm(between, axis=1, keepdims=True)
        found["caliper_scale"] = distances, "mm/mm"
        found["caliper_offset"] = np.sign(distances), "mm"
        found["object_shape"] = np.concatenate([np.zeros((heights, 2)), shape]), ""
    found["step_scale"] = steps, ""
    found["tower_lean"] = np.concatenate([by_leg[..., _RISE], by_leg[..., _SWING]], axis=1), ""
    return found


def _between(residuals, deviations):
    """Vectors (m, 3) between the places of each distance in mm."""
    first, second = (residuals.mechanism.forward(residuals.distance_actuators[:, k], deviations) for k in (0, 1))
    return first - second


@dataclass(frozen=True)
class _Weighing:
    """Readings under one ratio of noises: their weights (n,), and what the fit absorbs as orthonormal basis (n, a) of
    weighted readings.
    """

    weight: np.ndarray
    absorbed: np.ndarray

    def left(self, readings):
        """Readings (..., n) weighted, less what the fit absorbs."""
        return self._free(readings * self.weight)

    def basis(self, columns):
        """Orthonormal basis (n, r) of what the fit does not absorb of columns (n, k)."""
        weighted = columns * self.weight[:, None]
        free = self._free((weighted / np.linalg.norm(weighted, axis=0)).T).T
        basis, size, _ = np.linalg.svd(free, full_matrices=False)
        return basis[:, size > RANK_TOLERANCE]

    def _free(self, weighted):
        """Weighted readings (..., n) less what the fit absorbs."""
        return weighted - (weighted @ self.absorbed) @ self.absorbed.T

    def beside(self, columns):
        """The weighing of a fit that has columns (n, k) too."""
        return _Weighing(self.weight, np.concatenate([self.absorbed, self.basis(columns)], axis=1))

    def p(self, basis, readings):
        """Probabilities (...) that noise explains as much of readings (..., n) as a basis (n, r) does; NaN without
        freedom.
        """
        left, count = self.left(readings), basis.shape[1]
        explained, freedom = ((left @ basis) ** 2).sum(axis=-1), len(self.weight) - self.absorbed.shape[1] - count
        if not count or freedom < 1:
            return np.full(explained.shape, np.nan)
        return stats.f.sf(explained / count * freedom / ((left**2).sum(axis=-1) - explained), count, freedom)


@dataclass(frozen=True)
class Evidence:
    """The readings of a PrinterFit as a linear model about its answer, under every ratio of noises."""

    result: object

    @cached_property
    def columns(self):
        """See `cause_columns`."""
        return cause_columns(self.result)

    @cached_property
    def readings_mm(self):
        """Readings (n,) less those of the answer."""
        return self.result.residuals.measured_mm - self.result.residuals.predicted_mm(self.result.fit.deviations)

    @cached_property
    def weighings(self):
        """Under the firmware's ratio, and where there are distances under the others."""
        residuals = self.result.residuals
        jacobian = -residuals.jacobian(self.result.fit.deviations)[:, 0] / residuals.root_weight[:, None]
        weights = [residuals.root_weight]
        if len(residuals.distance_mm):
            weights += [
                np.where(np.arange(len(residuals)) < len(residuals.height_mm), 1.0 / ratio, 1.0) for ratio in _RATIOS
            ]
        return [_Weighing(weight, np.linalg.qr(jacobian * weight[:, None])[0]) for weight in weights]

    @cached_property
    def bases(self):
        """Bases of every cause by name, under each weighing; of a bad reading one per reading."""
        single = np.eye(len(self.readings_mm))[:, :, None]
        found = {name: [[one.basis(block)] for one in self.weighings] for name, (block, _) in self.columns.items()}
        return found | {BAD_READING: [[one.basis(column) for column in single] for one in self.weighings]}

    def p(self, name, readings=None, beside=None):
        """Largest p over the ratios, of readings (..., n), by default its own, for a cause, where columns (n, k) are
        fitted too.
        """
        readings = self.readings_mm if readings is None else readings
        block = self.columns[name][0]
        if beside is None:
            return np.max(
                [one.p(basis, readings) for one, (basis,) in zip(self.weighings, self.bases[name], strict=True)], axis=0
            )
        weighings = [one.beside(beside) for one in self.weighings]
        return np.max([one.p(one.basis(block), readings) for one in weighings], axis=0)

    def reading_p(self, readings=None, beside=None):
        """Largest p (..., n) over the ratios that a reading is bad, times the number of readings (Bonferroni)."""
        readings = self.readings_mm if readings is None else readings
        single, found = np.eye(len(self.readings_mm))[:, :, None], []
        for one, bases in zip(self.weighings, self.bases[BAD_READING], strict=True):
            if beside is not None:
                one = one.beside(beside)
                bases = [one.basis(column) for column in single]
            found.append(np.stack([one.p(basis, readings) for basis in bases], axis=-1))
        return np.minimum(np.max(found, axis=0) * len(single), 1.0)

    def p_without_any(self, name):
        """Largest p of a cause over the ratios with any single reading left out."""
        return float(np.max([self.p(name, beside=column[:, None]) for column in np.eye(len(self.readings_mm))]))

    def imitators(self, name, share, reading=0):
        """Names of the other causes that hold a share of what a cause explains, under the firmware's ratio; reading:
        that of a bad reading.
        """
        basis = self.bases[name][0][reading if name == BAD_READING else 0]
        explained = basis @ (basis.T @ self.weighings[0].left(self.readings_mm))
        held = {
            other: max(((explained @ rival) ** 2).sum() for rival in bases[0])
            for other, bases in self.bases.items()
            if other != name
        }
        return tuple(other for other, part in held.items() if basis.size and part >= share * (explained @ explained))

    def always_imitated(self, name, share):
        """Whether another cause holds that share of everything that a cause can explain, under the firmware's ratio."""
        others = [self.bases[other][0][0] for other in self.columns if other != name]
        return all(
            any(
                other.shape[1] >= basis.shape[1] > 0 and np.linalg.norm(other.T @ basis, -2) ** 2 >= share
                for other in others
            )
            for basis in self.bases[name][0]
        )

    def estimate(self, name):
        """Number of a cause with a single column, and its standard error, under the firmware's ratio; else NaN."""
        one, (block, _) = self.weighings[0], self.columns[name]
        freedom = self.result.freedom - 1
        if block.shape[1] > 1 or freedom < 1:
            return np.nan, np.nan
        seen, left = one.left(block[:, 0]), one.left(self.readings_mm)
        value = seen @ left / (seen @ seen)
        return value, np.sqrt(((left - value * seen) ** 2).sum() / freedom / (seen @ seen))

    def detectable_mm(self, name, limit):
        """Rms in mm over the readings, of what the calibration does not absorb of a cause, that has p below a limit 9
        times of 10.

        By simulation with the fit's noise in the firmware's ratio and causes in random directions; of a bad reading the
        error of a random one. NaN where no size does.
        """
        generator, one = np.random.default_rng(_SEED), self.weighings[0]
        noise = generator.normal(size=(_DRAWS, len(one.weight))) * self.result.fit.noise_mm / one.weight
        if name == BAD_READING:
            effect = generator.permuted(np.tile(np.eye(len(one.weight))[0], (_DRAWS, 1)), axis=1)
        else:
            (basis,) = self.bases[name][0]
            effect = generator.normal(size=(_DRAWS, basis.shape[1])) @ basis.T / one.weight
            effect /= np.sqrt((effect**2).mean(axis=1, keepdims=True))

        def surplus(log_size):
            readings = noise + np.exp(log_size) * effect
            p = self.reading_p(readings).min(axis=-1) if name == BAD_READING else self.p(name, readings)
            return np.mean(p < limit) - _POWER

        low, high = np.log(self.result.fit.noise_mm) + np.log([0.1, 1e4])
        return float(np.exp(optimize.bisect(surplus, low, high, xtol=1e-3))) if surplus(high) > 0.0 else np.nan
