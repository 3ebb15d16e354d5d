"""Input of the solver: readings and the model that predicts them, their whitening, and the parameters' priors."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rrru.arrays import FloatArray
from rrru.errors import FitError
from rrru.estimation.parameters import Parameters

Whiten = Callable[[FloatArray], FloatArray]


class Observations(Protocol):
    """Readings y of one kind or of several and their prediction h(x): n rows of `a` numbers each, in mm."""

    def residual(self, values: FloatArray, /) -> FloatArray:
        """Readings minus prediction (n, a) at parameter values (p,); NaN where the model predicts nothing."""

    def jacobian(self, values: FloatArray, /) -> FloatArray:
        """Derivative (n, a, p) of the residual by the parameters."""


def unweighted(values: FloatArray) -> FloatArray:
    """Values (n, a, ...) as they are: readings that are independent and have unit variance."""
    return values


def log_determinant(whiten: Whiten) -> float:
    """Logarithm of the determinant of a whitening; raises FitError for one that does not state its own."""
    log = 0.0 if whiten is unweighted else getattr(whiten, "log_determinant", None)
    if log is None:
        raise FitError("the whitening states no log_determinant; allowed: one that does, as Whitening")
    return float(log)


@dataclass(frozen=True, eq=False)
class WhiteNoise:
    """Whitening of readings with independent errors of standard deviations sd (n, a) in the readings' unit, or one."""

    sd: float | FloatArray

    @property
    def log_determinant(self) -> float | None:
        """Logarithm of the determinant of the map; None for a single sd, which does not say of how many readings."""
        return -float(np.log(self.sd).sum()) if np.ndim(self.sd) else None

    def __call__(self, values: FloatArray) -> FloatArray:
        """Whitened values (n, a, ...)."""
        sd = np.asarray(self.sd)
        return np.asarray(values / sd.reshape(*sd.shape, *[1] * (values.ndim - sd.ndim)))


@dataclass(frozen=True, eq=False)
class Problem:
    """Maximum a posteriori estimation of parameters x from readings y = h(x) + e.

        minimise  1/2 |W (y - h(x))|^2 - log p(x)

    observations: y and h; parameters: x with priors p(x) and bounds.
    whiten: the linear map W that makes the errors e independent with unit variance, (n, a, ...) to (n, a, ...).
    loss: "linear", or a robust loss of `scipy.optimize.least_squares` for rows with gross errors, which replaces the
        square of a row's whitened residual beyond `loss_scale`.
    """

    observations: Observations
    parameters: Parameters
    whiten: Whiten = unweighted
    loss: str = "linear"
    loss_scale: float = 1.0
