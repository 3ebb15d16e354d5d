"""Readings of several kinds in one problem, each whitened by its own noise."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from rrru.estimation.problem import Observations

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Part:
    """Readings of one kind in a joint problem.

    observations: with residuals (n, a) in their own unit; whiten: makes their errors independent with unit variance,
    from (n, a, ...) to (n, a, ...), such as a `WhiteNoise` of their standard deviation; places: where in the joint
    values the values are that these readings depend on, None for all.
    """

    observations: Observations
    whiten: Callable[[FloatArray], FloatArray]
    places: slice | None = None

    @property
    def columns(self) -> slice:
        """Where in the joint values its values are."""
        return slice(None) if self.places is None else self.places


@dataclass(frozen=True, eq=False)
class Joined:
    """Parts one after the other: N rows with one number each, in standard deviations of its noise.

    A joint problem needs no further whitening.
    """

    parts: tuple[Part, ...]

    default_sd: ClassVar[float] = 1.0
    unit: ClassVar[str] = "standard deviations"

    def residual(self, values: FloatArray, /) -> FloatArray:
        """Whitened readings minus predictions (N, 1) at values (p,)."""
        rows = [part.whiten(part.observations.residual(values[part.columns])).reshape(-1, 1) for part in self.parts]
        return np.concatenate(rows)

    def jacobian(self, values: FloatArray, /) -> FloatArray:
        """Derivative (N, 1, p) of the residual by the values (p,)."""
        rows = []
        for part in self.parts:
            white = part.whiten(part.observations.jacobian(values[part.columns]))
            padded = np.zeros((white.shape[0] * white.shape[1], 1, len(values)))
            padded[:, 0, part.columns] = white.reshape(len(padded), -1)
            rows.append(padded)
        return np.concatenate(rows)
