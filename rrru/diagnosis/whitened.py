"""The columns of calibration and effects along the runs, whitened at every level of the discrepancy.

The discrepancy's covariance along a run is diagonal in its cosine basis, as is that of the noise; see
`rrru.diagnosis.evidence`. Lengths in mm.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from rrru.arrays import FloatArray, IntArray
from rrru.campaign.noise import along_runs
from rrru.diagnosis.discrepancy_basis import Library
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.payload_nuisance import WEIGHT
from rrru.diagnosis.state import LinearizedProblem
from rrru.diagnosis.terms import EACH, SAME, legs_alike, spread
from rrru.estimation.noise_model import NoiseModel, lengths

DISCREPANCY_SCALES = np.array([0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0])


def discrepancy_scales(noise: NoiseModel) -> FloatArray:
    """Deviations (levels,) of the discrepancy over those of a NoiseModel: DISCREPANCY_SCALES, moved so that one is what
    it found.

    Between two levels intervals would be up to 1.8 times too wide or too narrow.
    """
    if not noise.discrepancy:
        return DISCREPANCY_SCALES
    nearest = DISCREPANCY_SCALES[1 + np.abs(np.log(DISCREPANCY_SCALES[1:] / noise.discrepancy)).argmin()]
    return np.asarray(DISCREPANCY_SCALES * noise.discrepancy / nearest)


def spectrum(wave: FloatArray) -> FloatArray:
    """Variance (n,) of the discrepancy by half-wave number (n,), 1 on average."""
    density = 1.0 / (1.0 + (wave / OPTIONS.discrepancy_half_density_wave_number) ** 2) + OPTIONS.discrepancy_white_share
    return np.asarray(density / density.mean())


# columns of an effect in a shape on "each" leg, the "same" on all, or of "weight"; of the shape of an effect
ColumnKey: TypeAlias = tuple[str, int, str] | str


@dataclass(frozen=True)
class Whitened:
    """Gram matrices of all columns of a linearisation, made when they are asked for.

    library: effects by name; linear: `rrru.diagnosis.state.LinearizedProblem`; run (n,): the series of each row; noise:
    a NoiseModel.
    """

    library: Library
    linear: LinearizedProblem
    run: IntArray
    noise: NoiseModel

    def __len__(self) -> int:
        return len(self.run)

    @cached_property
    def layout(self) -> tuple[dict[ColumnKey, IntArray], FloatArray]:
        """Numbers of all columns but the calibration's by (effect, shape, "each" or "same") and effect.

        With the matrix (K, k) that makes them, those of one value on all legs being sums, of the linearisation's.
        """
        linear = self.linear
        blocks: list[tuple[ColumnKey, int]] = [
            ((*key, EACH), columns.shape[-1]) for key, columns in linear.columns.items()
        ]
        blocks += [(name, columns.shape[-1]) for name, columns in linear.shape_columns.items()]
        blocks += [((*key, WEIGHT), columns.shape[-1]) for key, columns in linear.by_weight.items()]
        ends = np.cumsum([0, *(size for _, size in blocks)])
        numbers = {key: np.arange(first, first + size) for (key, size), first in zip(blocks, ends, strict=False)}
        made = [np.zeros((ends[-1], 0))]
        for name, shape in linear.columns:
            if legs_alike(self.library[name]):
                of_legs, sums = numbers[name, shape, EACH], spread(self.library[name].coordinates, SAME)
                numbers[name, shape, SAME] = ends[-1] + sum(part.shape[1] for part in made) + np.arange(sums.shape[1])
                made.append(np.zeros((ends[-1], sums.shape[1])))
                made[-1][of_legs] = sums
        return numbers, np.concatenate(made, axis=1)

    @cached_property
    def _together(self) -> tuple[FloatArray, FloatArray]:
        """Columns of calibration and effects, and the data, (m, 3, k), by the runs' cosines; waves (m,)."""
        linear = self.linear
        nuisance = *linear.shape_columns.values(), *linear.by_weight.values()
        blocks = linear.base, *linear.columns.values(), *nuisance, linear.data[..., None]
        return along_runs(np.concatenate(blocks, axis=-1), self.run)

    @cached_property
    def whole(self) -> FloatArray:
        """Sum of squares (k,) of each column over the noise, the calibration not projected out."""
        # cosines change no sum of squares
        columns = self._together[0][..., self.linear.base.shape[-1] : -1].reshape(3 * len(self), -1)
        sums = columns @ self.layout[1]
        return np.concatenate([np.einsum("ij,ij->j", part, part) for part in (columns, sums)]) / self.noise.mean_mm**2

    @cached_property
    def _made(self) -> dict[int, tuple[FloatArray, FloatArray]]:
        """Grams of the levels that have been asked for."""
        return {}

    @cached_property
    def _calibration(self) -> tuple[FloatArray, FloatArray]:
        """Columns of the calibration, and the data, (m, 3, p + 1), by the runs' cosines; waves (m,)."""
        return along_runs(np.concatenate([self.linear.base, self.linear.data[..., None]], axis=-1), self.run)

    def none(self, level: int) -> tuple[float, float]:
        """Log evidence of no effect at all at a level (an index), and the limit of that of any effects there.

        The limit is that of effects which explain everything, and whose coefficients cost nothing.
        """
        white, variance = self._white(level, self._calibration)
        basis, triangle = np.linalg.qr(white[:, :-1])
        left = white[:, -1] - basis @ (basis.T @ white[:, -1])
        limit = -0.5 * np.log(variance).sum() - np.log(np.abs(np.diag(triangle))).sum()
        return float(limit - 0.5 * left @ left), float(limit)

    def _white(self, level: int, by_cosines: tuple[FloatArray, FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Columns (m, 3, k) by the runs' cosines, whitened (m, k), and their variances.

        The calibration's columns come first, the data last. The last rows are the priors of the calibration's
        parameters.
        """
        (cosines, wave), p, unit = by_cosines, self.linear.base.shape[-1], self.noise.mean_mm
        own = self.noise.variance(wave, lengths(self.run)) / unit**2
        variance = own + discrepancy_scales(self.noise)[level] ** 2 * spectrum(wave)[:, None]
        prior = np.zeros((0, cosines.shape[-1]))
        if self.linear.base_prior is not None:
            sd, mean = self.linear.base_prior
            stated = np.isfinite(sd)
            prior = np.zeros((p, cosines.shape[-1]))
            prior[:, :p], prior[:, -1] = np.diag(1.0 / sd), np.where(stated, mean, 0.0) / sd
            prior = prior[stated]
        # one array of all readings by all columns, since it is large
        white = np.empty((variance.size + len(prior), cosines.shape[-1]))
        np.divide(cosines, (unit * np.sqrt(variance))[..., None], out=white[: variance.size].reshape(cosines.shape))
        white[variance.size :] = prior
        return white, variance

    def gram(self, level: int) -> tuple[FloatArray, FloatArray]:
        """Gram matrix (k, k) of the whitened columns at a level (an index), and their moments (k,).

        The calibration is projected out.
        """
        if level not in self._made:
            white, p = self._white(level, self._together)[0], self.linear.base.shape[-1]
            basis = np.linalg.qr(white[:, :p])[0]
            rest = white[:, p:]
            rest -= basis @ (basis.T @ rest)
            gram, sums = rest.T @ rest, self.layout[1]
            gram, moment = gram[:-1, :-1], gram[:-1, -1]
            k, across = len(gram), gram @ sums
            whole = np.empty((k + sums.shape[1], k + sums.shape[1]))
            whole[:k, :k], whole[:k, k:], whole[k:, :k], whole[k:, k:] = gram, across, across.T, sums.T @ across
            self._made[level] = whole, np.concatenate([moment, sums.T @ moment])
        return self._made[level]
