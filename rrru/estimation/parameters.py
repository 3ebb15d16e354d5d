"""Parameters of an estimation: named blocks, each parameter with its unit, prior and bounds."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt
from scipy.special import expit, logsumexp

from rrru.arrays import FloatArray
from rrru.parameters import ParameterSet


@dataclass(frozen=True, eq=False)
class Block:
    """k parameters of one kind, with independent priors.

    names, units: one each.
    mean, sd (k,): of the normal prior, in the parameter's unit; sd inf for a flat one.
    low, high (k,): bounds.
    wide_sd (k,): NaN for a normal prior; else the prior is the mixture of N(mean, sd^2) and N(mean, wide_sd^2) in equal
        parts.
    """

    name: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    mean: FloatArray
    sd: FloatArray
    low: FloatArray
    high: FloatArray
    wide_sd: FloatArray

    def __len__(self) -> int:
        return len(self.names)

    @classmethod
    def of(
        cls,
        name: str,
        names: Iterable[str],
        units: Iterable[str],
        sd: npt.ArrayLike,
        mean: npt.ArrayLike = 0.0,
        bounds: tuple[npt.ArrayLike, npt.ArrayLike] = (-np.inf, np.inf),
        wide_sd: npt.ArrayLike = np.nan,
    ) -> Self:
        """Block of parameters; each number is given once for all of them, or as (k,)."""
        names, given = tuple(names), (mean, sd, *bounds, wide_sd)
        arrays = (np.broadcast_to(np.asarray(values, dtype=float), len(names)) for values in given)
        return cls(name, names, tuple(units), *arrays)

    @classmethod
    def geometry(cls, parameters: ParameterSet, name: str = "geometry") -> Self:
        """Block of a robot's geometric errors under the weak prior that their bounds state.

        The prior's standard deviation is that of a uniform distribution between the bounds, their width over the root
        of 12; flat where a bound is infinite. A robot's parameters and bounds come from the configuration.
        """
        sd = (parameters.high - parameters.low) / np.sqrt(12.0)
        return cls.of(
            name, parameters.names, parameters.units, sd, parameters.nominal, (parameters.low, parameters.high)
        )


@dataclass(frozen=True, eq=False)
class Parameters:
    """Blocks one after the other: the meaning of a parameter vector (p,)."""

    blocks: tuple[Block, ...]

    def __len__(self) -> int:
        return sum(map(len, self.blocks))

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Slice of each block in the vector, by the block's name."""
        ends = np.cumsum([0, *map(len, self.blocks)]).tolist()
        return {block.name: slice(*ends[k : k + 2]) for k, block in enumerate(self.blocks)}

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names (p,)."""
        return tuple(name for block in self.blocks for name in block.names)

    def _joined(self, field: str) -> FloatArray:
        """One array (p,) of all blocks."""
        return np.concatenate([np.zeros(0), *(getattr(block, field) for block in self.blocks)])

    @cached_property
    def mean(self) -> FloatArray:
        """Prior means (p,)."""
        return self._joined("mean")

    @cached_property
    def sd(self) -> FloatArray:
        """Prior standard deviations (p,), the narrow one of a mixture; inf for a flat prior."""
        return self._joined("sd")

    @cached_property
    def wide_sd(self) -> FloatArray:
        """Wide standard deviations (p,) of priors that are mixtures, NaN for the others."""
        return self._joined("wide_sd")

    @cached_property
    def low(self) -> FloatArray:
        """Lower bounds (p,)."""
        return self._joined("low")

    @cached_property
    def high(self) -> FloatArray:
        """Upper bounds (p,)."""
        return self._joined("high")

    def clipped(self, values: FloatArray) -> FloatArray:
        """The nearest vector (p,) within the bounds."""
        return np.clip(values, self.low, self.high)

    def prior_precision(self, values: FloatArray) -> FloatArray:
        """Precisions (p,) of normal priors whose costs majorize those of the priors at values (p,), 0 for a flat one.

        A normal prior's cost, up to a constant, is at least that of the mixture everywhere and equal to it at `values`.

        For a mixture of normal distributions with one mean: its components' precisions, weighted by their
        responsibilities (the expectation step of Dempster, Laird and Rubin, 1977).
        """
        with np.errstate(divide="ignore"):
            result = self.sd**-2.0
        mixed = np.isfinite(self.wide_sd)
        narrow, wide = result[mixed], self.wide_sd[mixed] ** -2.0
        # of the narrow component
        log_odds = 0.5 * np.log(narrow / wide) - 0.5 * (narrow - wide) * (values - self.mean)[mixed] ** 2
        responsibility = expit(log_odds)
        result[mixed] = responsibility * narrow + (1.0 - responsibility) * wide
        return result

    def prior_cost(self, values: FloatArray) -> float:
        """Negative log prior density of values (p,), up to a constant."""
        off = values - self.mean
        plain = np.isfinite(self.sd) & np.isnan(self.wide_sd)
        cost = 0.5 * float(((off[plain] / self.sd[plain]) ** 2).sum())
        mixed = np.isfinite(self.wide_sd)
        if not mixed.any():
            return cost
        sds = np.stack([self.sd[mixed], self.wide_sd[mixed]])
        return cost - float(logsumexp(-0.5 * (off[mixed] / sds) ** 2 - np.log(sds), axis=0).sum())
