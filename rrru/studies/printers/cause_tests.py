"""What a printer's readings say about a cause: how likely noise explains as much, whatever the noises' ratio is.

A cause adds columns to the linear model about the answer, see `rrru.estimation.f_test`. The test needs the ratio of a
height's noise to a distance's, which few readings tell: false alarms are up to six times too many where the firmware's
ratio is wrong. For causes of the machine p is the largest over all ratios, which holds the level wherever between a
quarter and 1 the true one is.

For a bad reading that would hide most of them: under a ratio that the other readings exclude, even one far off is
likely. There p is the mean over ratios from 1/8 to 2, each as likely as the other readings make it; the ratio's
logarithm is uniform beforehand. A reading is predicted from the others this way and does not judge its own noise. For
each ratio from a quarter to 1 the level holds by simulation.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import optimize

from rrru.estimation.f_test import largest_p, mean_p
from rrru.studies.printers.cause_columns import cause_columns
from rrru.studies.printers.printer_fit import PrinterFit

BAD_READING = "bad_reading"
# ASSUME noise of a height over that of a distance: a probe is at best four times as good as calipers, at worst as bad
_RATIOS = np.geomspace(0.25, 1.0, 4)
# the same with a factor of 2 on either side, so that a mean holds the level at these ends too
_LIKELY_RATIOS = np.geomspace(0.125, 2.0, 9)
_POWER, _DRAWS, _SEED = 0.9, 500, 1


def noise_sds(residuals, ratios=_RATIOS):
    """Standard deviations (n,) of ProbedHeights in proportion: by the firmware's ratio, then by others.

    Heights alone have one ratio.
    """
    height = np.arange(len(residuals)) < len(residuals.height_mm)
    return [1.0 / residuals.root_weight, *(np.where(height, ratio, 1.0) for ratio in ratios if not height.all())]


@dataclass(frozen=True)
class CauseTests:
    """The readings of a PrinterFit as a linear model about its answer, under every ratio of noises."""

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
        """LinearizedModels of all ratios by which a cause is judged, and by which a bad reading is."""
        likely = noise_sds(self.result.residuals, _LIKELY_RATIOS)
        both = noise_sds(self.result.residuals), likely[len(likely) > 1 :]
        return tuple([self.result.linearized(sd) for sd in sds] for sds in both)

    @property
    def _own(self):
        """The LinearizedModel of the firmware's ratio."""
        return self._models[0][0]

    @cached_property
    def added(self):
        """AddedColumns of every cause by name, those of a bad reading last, under the firmware's ratio."""
        return {name: self._own.add(block) for name, block in self._blocks.items()}

    def p(self, name, readings=None, beside=None):
        """Largest p over the ratios for a cause, (...) for readings (..., n), by default its own.

        Of a bad reading it is the mean (..., n), of every reading, times their number (Bonferroni). beside: columns
        (n, k) that are fitted too.
        """
        readings = self.result.in_mm.residual if readings is None else np.moveaxis(readings, -1, 0)[:, None]
        bad, block = name == BAD_READING, self._blocks[name]
        models = self._models[bad]
        if beside is not None:
            models = [one.with_columns(beside[:, None]) for one in models]
        if not bad:
            return largest_p(models, block, readings)[0]
        return np.minimum(np.moveaxis(mean_p(models, block, readings), 0, -1) * len(readings), 1.0)

    def p_without_any(self, name):
        """Largest p of a cause with any single reading left out."""
        return float(np.max([self.p(name, beside=column[:, None]) for column in np.eye(len(self.result.residuals))]))

    def explained_share(self, name, reading=0):
        """Share of the sum of squares left that a cause holds, under the firmware's ratio; reading: as below."""
        explained = self.added[name].explained(self._own.residual)[reading]
        return min(explained / (self._own.residual**2).sum(), 1.0)

    def imitators(self, name, share, reading=0):
        """Names of the other causes that hold a share of what a cause explains, under the firmware's ratio.

        reading: that of a bad reading.
        """
        basis = self.added[name].basis[reading]
        explained = basis @ (basis.T @ self._own.residual)
        held = {other: one.explained(explained).max() for other, one in self.added.items() if other != name}
        return tuple(other for other, part in held.items() if basis.size and part >= share * (explained @ explained))

    def always_imitated(self, name, share):
        """Whether another cause holds that share of everything that a cause can explain, under the firmware's ratio."""
        others = [self.added[other].basis[0] for other in self.columns if other != name]
        wide = [one for one in others if one.shape[1] >= self.added[name].rank > 0]
        bases = self.added[name].basis
        return all(any(np.linalg.norm(one.T @ basis, -2) ** 2 >= share for one in wide) for basis in bases)

    def estimate(self, name):
        """Number of a cause with a single column, and its standard error, under the firmware's ratio; else NaN."""
        added = self.added[name]
        if self._blocks[name].shape[2] > 1 or not added.rank or added.freedom < 1:
            return np.nan, np.nan
        return tuple(one.item() for one in added.estimates())

    def detectable_mm(self, name, limit):
        """Rms in mm over the readings of what the calibration does not absorb of a cause that shows, 9 times of 10.

        That is, has p below a limit. By simulation with the fit's noise in the firmware's ratio and causes in random
        directions; of a bad reading the error of a random one. NaN where no size does.
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
