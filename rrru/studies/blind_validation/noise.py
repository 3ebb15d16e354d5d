"""Noises of the check on withheld effects that are not what is stated: white, Gaussian and alike on all axes.

Sizes are over the stated noise, one sigma per axis. Light to import: the workflow asks for the noises' names.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class NoiseLaw:
    """size: of the instrument's noise; axes: its share per axis; correlation: of a first-order autoregression along
    each run; freedom: of Student's t, infinite for Gaussian noise, sigma kept; scatter: of what the robot does not
    repeat, white; runs: of offsets from run to run.
    """

    size: float = 1.0
    axes: tuple = (1.0, 1.0, 1.0)
    correlation: float = 0.0
    freedom: float = np.inf
    scatter: float = 0.0
    runs: float = 0.0

    @property
    def beyond(self):
        """Rms of what does not repeat from point to point beyond the stated noise, over that noise."""
        more = (self.size * np.array(self.axes)) ** 2 + self.scatter**2 - 1.0
        return float(np.sqrt(np.maximum(more, 0.0).mean()))

    def draw(self, measurements, noise_mm, generator):
        """Noise (n, 3) in mm of the rows of a measurement table."""
        run = measurements["run"].to_numpy()
        white = self._white(generator, (len(run), 3))
        scatter = generator.standard_normal((len(run), 3))
        offset = generator.standard_normal((run.max() + 1, 3))[run]
        own = self.size * np.array(self.axes) * self._correlated(white, run)
        return noise_mm * (own + self.scatter * scatter + self.runs * offset)

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
    "stated_90": NoiseLaw(size=1.0 / 0.9),
    "stated_80": NoiseLaw(size=1.0 / 0.8),
    "stated_125": NoiseLaw(size=0.8),
    "along_20": NoiseLaw(correlation=0.2),
    "along_50": NoiseLaw(correlation=0.5),
    "along_80": NoiseLaw(correlation=0.8),
    "axes": NoiseLaw(axes=(0.5, 1.0, 2.5)),
    "scatter": NoiseLaw(scatter=1.5),
    "runs": NoiseLaw(runs=0.5),
    "tails": NoiseLaw(freedom=3.0),
}


def with_noise(measurements, law, noise_mm, generator):
    """A measurement table with noise of a law added to its measured positions."""
    from rrru.campaign import measurements as rows

    read = rows.measured(measurements) + law.draw(measurements, noise_mm, generator)
    return measurements.assign(**rows.vector_columns("measured", read))
