"""What a printer's readings say about a cause: how likely noise explains as much, whatever the noises' ratio is.

A cause adds columns to the linear fit about the answer, and F compares what they explain with what they leave (Cook and
Weisberg, Residuals and Influence in Regression, 1982, 2.2; a bad reading is a column with a single one). F needs the
ratio of a height's noise to a distance's, which few readings tell: false alarms are up to six times too many where the
firmware's ratio is wrong. For causes of the machine p is the largest over all ratios, which holds the level wherever
between a quarter and 1 the true one is.

For a bad reading that would hide most of them: under a ratio that the other readings exclude, even one far off is
likely. There p is the mean over ratios from 1/8 to 2, each as likely as the other readings make it (restricted
likelihood, Harville, Journal of the American Statistical Association 72, 1977; the ratio's logarithm is uniform
beforehand). A reading is foretold from the others this way (a partial predictive p, Bayarri and Berger, ibid. 95, 2000)
and does not judge its own noise. The level holds on the average over these ratios, and for each from a quarter to 1 by
simulation.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import optimize

from rrru.studies.printers.cause_columns import cause_columns
from rrru.studies.printers.printer_fit import PrinterFit
from rrru.studies.printers.weighing import largest_p, mean_p

BAD_READING = "bad_reading"
# ASSUME noise of a height over that of a distance: a probe is at best four times as good as calipers, at worst as bad
_RATIOS = np.geomspace(0.25, 1.0, 4)
# the same with a factor of 2 on either side, so that a mean holds the level at these ends too
_LIKELY_RATIOS = np.geomspace(0.125, 2.0, 9)
_POWER, _DRAWS, _SEED = 0.9, 500, 1


@dataclass(frozen=True)
class CauseTests:
    """The readings of a PrinterFit as a linear model about its answer, under every ratio of noises."""

    result: PrinterFit

    @cached_property
    def columns(self):
        """See `cause_columns`."""
        return cause_columns(self.result)

    @cached_property
    def own_weighing(self):
        """The weighing under the firmware's ratio."""
        return self.result.weighing(self.result.residuals.root_weight)

    @cached_property
    def weighings(self):
        """Under the firmware's ratio, and where there are distances under the others."""
        return [self.own_weighing, *self._under(_RATIOS)]

    @cached_property
    def _likely(self):
        """Under every ratio that a bad reading is judged by."""
        return self._under(_LIKELY_RATIOS) or [self.own_weighing]

    def _under(self, ratios):
        """Weighings under ratios of noises; heights alone have none."""
        residuals = self.result.residuals
        height = np.arange(len(residuals)) < len(residuals.height_mm)
        return [] if height.all() else [self.result.weighing(np.where(height, 1.0 / ratio, 1.0)) for ratio in ratios]

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
        return {name: [self._bases(name, one) for one in self.weighings] for name in self.columns}

    @cached_property
    def _bad_bases(self):
        """What `_bases` gives of a bad reading under each of its weighings."""
        return [self._bases(BAD_READING, one) for one in self._likely]

    def p(self, name, readings=None, beside=None):
        """Largest p over the ratios for a cause, (...) for readings (..., n), by default its own.

        Of a bad reading it is the mean (..., n), of every reading, times their number (Bonferroni). beside: columns
        (n, k) that are fitted too.
        """
        readings = self.result.residual_mm if readings is None else readings
        bad = name == BAD_READING
        weighings, bases = (self._likely, self._bad_bases) if bad else (self.weighings, self._all_bases[name])
        if beside is not None:
            weighings = [one.beside(beside) for one in weighings]
            bases = [self._bases(name, one) for one in weighings]
        if not bad:
            return largest_p(weighings, bases, readings)[..., 0]
        return np.minimum(mean_p(weighings, bases, readings) * readings.shape[-1], 1.0)

    def p_without_any(self, name):
        """Largest p of a cause with any single reading left out."""
        return float(np.max([self.p(name, beside=column[:, None]) for column in np.eye(len(self.result.residual_mm))]))

    def imitators(self, name, share, reading=0):
        """Names of the other causes that hold a share of what a cause explains, under the firmware's ratio.

        reading: that of a bad reading.
        """
        basis = self.bases[name][reading if name == BAD_READING else 0]
        explained = basis @ (basis.T @ self.own_weighing.left(self.result.residual_mm))
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
        seen, left = one.left(block[:, 0]), one.left(self.result.residual_mm)
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
