"""Readings with linear effects of more parameters: y = h(x) + C c, the effects' columns C fixed beforehand."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from rrru.errors import FitError
from rrru.estimation.problem import Observations

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class WithColumns:
    """Readings of another kind with k more linear parameters; the values are those of the readings, then these k.

    columns (n, a, k): change of the readings, in their unit, per unit of each parameter. Raises FitError where one is
    not finite.
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
