"""Noises of the check on withheld effects that differ from the stated one: white, Gaussian, equal on all axes.

Sizes are relative to the stated noise, 1 sigma per axis. The workflow imports this module for the names alone, so it is
light to import.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class NoiseModel:
    """size: of the instrument's noise; axes: its share per axis; correlation: of a first-order autoregression along
    each run; freedom: degrees of freedom of Student's t of the same sigma, infinite for Gaussian noise; scatter:
    white non-repeatability of the robot; runs: offsets per run.
    """

    size: float = 1.0
    axes: tuple = (1.0, 1.0, 1.0)
    correlation: float = 0.0
    freedom: float = np.inf
    scatter: float = 0.0
    runs: float = 0.0

    @property
    def beyond(self):
        """Rms of the non-repeatability from point to point beyond the stated noise, relative to that noise."""
        more = (self.size * np.array(self.axes)) ** 2 + self.scatter**2 - 1.0
        return float(np.sqrt(np.maximum(more, 0.0).mean()))

    def draw(self, measurements, noise_mm, generator):
        """Noise (n, 3) in mm of the rows of a measurement table."""
        run = measurements["run"].to_numpy()
        white = self._white(generator, (len(run), 3))
        scatter = generator.standard_normal((len(run), 3))
        offset = generator.standard_normal((run.max() + 1, 3))[run]
        instrument = self.size * np.array(self.axes) * self._correlated(white, run)
        return noise_mm * (instrument + self.scatter * scatter + self.runs * offset)

    def _white(self, generator, size):
        """Independent noise of unit variance."""
        if np.isinf(self.freedom):
            return generator.standard_normal(size)
        return generator.standard_t(self.freedom, size) * np.sqrt((self.freedom - 2.0) / self.freedom)

    def _correlated(self, white, run):
        """The autoregression (n, 3) of unit variance of each run from white noise (n, 3)."""
        from scipy.signal import lfilter

        result = white.copy()
        for number in np.unique(run):
            own = white[run == number] * np.sqrt(1.0 - self.correlation**2)
            own[0] = white[run == number][0]
            result[run == number] = lfilter([1.0], [1.0, -self.correlation], own, axis=0)
        return result


NOISES = {
    "stated_90": NoiseModel(size=1.0 / 0.9),
    "stated_80": NoiseModel(size=1.0 / 0.8),
    "stated_125": NoiseModel(size=0.8),
    "along_20": NoiseModel(correlation=0.2),
    "along_50": NoiseModel(correlation=0.5),
    "along_80": NoiseModel(correlation=0.8),
    "axes": NoiseModel(axes=(0.5, 1.0, 2.5)),
    "scatter": NoiseModel(scatter=1.5),
    "runs": NoiseModel(runs=0.5),
    "tails": NoiseModel(freedom=3.0),
}


def with_noise(measurements, noise, noise_mm, generator):
    """A measurement table with noise of a NoiseModel added to its measured positions."""
    from rrru.campaign import measurements as rows

    read = rows.measured(measurements) + noise.draw(measurements, noise_mm, generator)
    return measurements.assign(**rows.vector_columns("measured", read))
