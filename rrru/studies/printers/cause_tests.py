"""Tests of causes on a printer's readings: probability that noise explains as much, for an unknown ratio of noises.

A cause adds columns to the linear model about the answer, see `rrru.estimation.f_test`. The test needs the ratio of the
noise of a height to that of a distance, which few readings determine poorly. With a wrong ratio in the firmware, false
alarms are up to six times too frequent. For causes of the machine p is the largest over all ratios. This holds the
level for every true ratio from 0.25 to 1.

For a bad reading the largest p would hide most of them: with a ratio that the other readings exclude, even a large
error is likely. There p is the mean over ratios from 1/8 to 2, weighted by their likelihood from the other readings;
the prior of the ratio's logarithm is uniform. In this way a reading is predicted from the others and does not affect
its own noise. By simulation, the level holds for each ratio from 0.25 to 1.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import optimize

from rrru.estimation.f_test import largest_p, mean_p
from rrru.studies.printers.printer_fit import PrinterFit

# indices of Ptt3's parameters of a leg
_SLIDER, _ARM, _RISE, _SWING = 0, 1, 4, 5
BAD_READING = "bad_reading"
# ASSUME noise of a height over that of a distance: a probe is one to four times as accurate as calipers
_RATIOS = np.geomspace(0.25, 1.0, 4)
# wider by a factor of 2 on either side, so that a mean holds the level at these ends too
_LIKELY_RATIOS = np.geomspace(0.125, 2.0, 9)
_POWER, _DRAWS, _SEED = 0.9, 500, 1


def cause_columns(result):
    """Derivatives (n, k) of the readings of a PrinterFit by each cause, and the unit where k is 1, by name.

    Arms, towers that lean (three angles outwards, three sideways), and carriages' steps of other lengths, per tower.
    With distances: calipers with a wrong scale or offset, and a measured object that is stretched along x, shrunk along
    y, and skewed.
    """
    residuals = result.residuals
    n, m = len(residuals.height_mm), len(residuals.distance_mm)
    by_place, columns = _by_place(result), {}
    if not m:
        columns["arms"] = arm_columns(result), ""
    else:
        distances = np.concatenate([np.zeros(n), residuals.distance_mm])[:, None]
        places = residuals.places(result.fit.deviations)
        between = places[n : n + m] - places[n + m :]
        x, y, _ = between.T
        shape = np.stack([x**2 - y**2, 2.0 * x * y], axis=1) / np.linalg.norm(between, axis=1, keepdims=True)
        columns["caliper_scale"] = distances, "mm/mm"
        columns["caliper_offset"] = np.sign(distances), "mm"
        columns["object_shape"] = np.concatenate([np.zeros((n, 2)), shape]), ""
    columns["step_scale"] = np.einsum("rnl,nl->rl", by_place[..., _SLIDER], residuals.actuators), ""
    columns["tower_lean"] = lean_columns(result), ""
    return columns


def arm_columns(result):
    """Derivatives (n, 3) of the readings by the arms' lengths."""
    return _by_place(result)[..., _ARM].sum(axis=1)


def lean_columns(result):
    """Derivatives (n, 6) of the readings by leaning towers: three angles outwards, three sideways."""
    by_leg = _by_place(result).sum(axis=1)
    return np.concatenate([by_leg[..., _RISE], by_leg[..., _SWING]], axis=1)


def _by_place(result):
    """Derivatives (n, places, 3, 6) of the readings by the legs' parameters, at every place separately."""
    residuals, deviations = result.residuals, result.fit.deviations
    places = residuals.places(deviations)
    moved = residuals.mechanism.leg_jacobian(places, residuals.actuators, deviations)
    return np.einsum("rna,nalc->rnlc", residuals.gradient(places), moved)


def noise_sds(residuals, ratios=_RATIOS):
    """Standard deviations (n,) of ProbedHeights in proportion: with the firmware's ratio, then with others.

    Heights alone need no ratio.
    """
    height = np.arange(len(residuals)) < len(residuals.height_mm)
    return [1.0 / residuals.root_weight, *(np.where(height, ratio, 1.0) for ratio in ratios if not height.all())]


@dataclass(frozen=True)
class CauseTests:
    """The readings of a PrinterFit as a linear model about its answer, for every ratio of noises."""

    result: PrinterFit

    @cached_property
    def columns(self):
        """See `cause_columns`."""
        return cause_columns(self.result)

    @cached_property
    def _blocks(self):
        """Columns (n, 1, k) of every cause by name, and (n, 1, 1, n) of a bad reading, a block for each."""
        blocks = {name: columns[:, None] for name, (columns, _) in self.columns.items()}
        return blocks | {BAD_READING: np.eye(len(self.result.residuals))[:, None, None]}

    @cached_property
    def _models(self):
        """LinearizedModels of all ratios for a cause, and of all ratios for a bad reading."""
        likely = noise_sds(self.result.residuals, _LIKELY_RATIOS)
        both = noise_sds(self.result.residuals), likely[len(likely) > 1 :]
        return tuple([self.result.linearized(sd) for sd in sds] for sds in both)

    @property
    def _firmware_model(self):
        """The LinearizedModel of the firmware's ratio."""
        return self._models[0][0]

    @cached_property
    def added(self):
        """AddedColumns of every cause by name, those of a bad reading last, for the firmware's ratio."""
        return {name: self._firmware_model.add(block) for name, block in self._blocks.items()}

    def p(self, name, readings=None, with_columns=None):
        """Largest p over the ratios for a cause, (...) for readings (..., n), by default those of the printer.

        Of a bad reading it is the mean (..., n), of every reading, times their number (Bonferroni). with_columns:
        columns (n, k) that are also fitted.
        """
        readings = self.result.in_mm.residual if readings is None else np.moveaxis(readings, -1, 0)[:, None]
        bad, block = name == BAD_READING, self._blocks[name]
        models = self._models[bad]
        if with_columns is not None:
            models = [model.with_columns(with_columns[:, None]) for model in models]
        if not bad:
            return largest_p(models, block, readings)[0]
        return np.minimum(np.moveaxis(mean_p(models, block, readings), 0, -1) * len(readings), 1.0)

    def p_without_any(self, name):
        """Largest p of a cause with any single reading left out."""
        return float(
            np.max([self.p(name, with_columns=column[:, None]) for column in np.eye(len(self.result.residuals))])
        )

    def explained_share(self, name, reading=0):
        """Fraction of the residual sum of squares that a cause explains, firmware's ratio; reading: as below."""
        explained = self.added[name].explained(self._firmware_model.residual)[reading]
        return min(explained / (self._firmware_model.residual**2).sum(), 1.0)

    def confounded_causes(self, name, share, reading=0):
        """Names of the other causes that explain a share of what a cause explains, for the firmware's ratio.

        reading: number of a bad reading.
        """
        basis = self.added[name].basis[reading]
        explained = basis @ (basis.T @ self._firmware_model.residual)
        held = {other: added.explained(explained).max() for other, added in self.added.items() if other != name}
        return tuple(other for other, part in held.items() if basis.size and part >= share * (explained @ explained))

    def always_confounded(self, name, share):
        """Whether another cause explains that share of all that a cause can explain, for the firmware's ratio."""
        others = [self.added[other].basis[0] for other in self.columns if other != name]
        wide = [basis for basis in others if basis.shape[1] >= self.added[name].rank > 0]
        bases = self.added[name].basis
        return all(any(np.linalg.norm(other.T @ basis, -2) ** 2 >= share for other in wide) for basis in bases)

    def estimate(self, name):
        """Estimate of a cause with a single parameter, and its standard error, for the firmware's ratio; else NaN."""
        added = self.added[name]
        if self._blocks[name].shape[2] > 1 or not added.rank or added.freedom < 1:
            return np.nan, np.nan
        return tuple(one.item() for one in added.estimates())

    def detectable_mm(self, name, limit):
        """Smallest size of a cause with a power of 0.9: rms in mm over the readings, without its absorbed part.

        The power is the probability of p below a limit. By simulation with the fit's noise in the firmware's ratio and
        causes in random directions; for a bad reading the error of a random one. NaN where no size has this power.
        """
        generator, sd = np.random.default_rng(_SEED), noise_sds(self.result.residuals)[0]
        noise = generator.normal(size=(_DRAWS, len(sd))) * self.result.fit.noise_mm * sd
        if name == BAD_READING:
            effect = generator.permuted(np.tile(np.eye(len(sd))[0], (_DRAWS, 1)), axis=1)
        else:
            (basis,) = self.added[name].basis
            effect = generator.normal(size=(_DRAWS, basis.shape[1])) @ basis.T * sd
            effect /= np.sqrt((effect**2).mean(axis=1, keepdims=True))

        def surplus(log_size):
            p = self.p(name, noise + np.exp(log_size) * effect)
            return np.mean((p.min(axis=-1) if name == BAD_READING else p) < limit) - _POWER

        low, high = np.log(self.result.fit.noise_mm) + np.log([0.1, 1e4])
        return float(np.exp(optimize.bisect(surplus, low, high, xtol=1e-3))) if surplus(high) > 0.0 else np.nan
