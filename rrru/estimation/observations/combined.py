"""Observations made of others: of several kinds in one problem, or with linear effects of more parameters."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from rrru.arrays import FloatArray
from rrru.errors import FitError
from rrru.estimation.problem import Observations


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
    """Parts one after the other, each whitened by its own noise: N rows with one number each, in standard deviations.

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


@dataclass(frozen=True, eq=False)
class WithColumns:
    """Readings of another kind with k more linear parameters: y = h(x) + C c. The values are x, then these k.

    columns (n, a, k): C, change of the readings, in their unit, per unit of each parameter. Raises FitError where one
    is not finite.
    """

    observations: Observations
    columns: FloatArray

    unit: ClassVar[str] = "as of its readings"

    def __post_init__(self) -> None:
        if not np.isfinite(self.columns).all():
            raise FitError("the columns of an effect are not finite; leave out readings for which it has no value")

    @cached_property
    def default_sd(self) -> float:
        """That of its readings."""
        return float(getattr(self.observations, "default_sd", 1.0))

    def _split(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The readings' own values (p,) and those of the columns (k,)."""
        count = len(values) - self.columns.shape[-1]
        return values[:count], values[count:]

    def residual(self, values: FloatArray, /) -> FloatArray:
        """Readings minus prediction (n, a) at values (p + k,)."""
        parameters, effects = self._split(values)
        return self.observations.residual(parameters) - self.columns @ effects

    def jacobian(self, values: FloatArray, /) -> FloatArray:
        """Derivative (n, a, p + k) of the residual by the values."""
        parameters, _ = self._split(values)
        return np.concatenate([self.observations.jacobian(parameters), -self.columns], axis=-1)
