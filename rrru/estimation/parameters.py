"""Parameters of an estimation: named blocks, each parameter with its unit, prior and bounds."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Self

import numpy as np
import numpy.typing as npt
from scipy.special import logsumexp

from rrru.arrays import BoolArray, FloatArray
from rrru.parameters import ParameterSet


@dataclass(frozen=True, eq=False)
class Block:
    """k parameters of one kind, with independent priors.

    names, units: one each.
    mean, sd (k,): of the normal prior, in the parameter's unit; sd inf for a flat one.
    low, high (k,): bounds.
    wide_sd (k,): NaN for a normal prior; else the prior is the mixture of N(mean, sd^2) and N(mean, wide_sd^2) in equal
        parts. Parameters of one unit have the narrow or the wide one together.
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

    @cached_property
    def mixed(self) -> BoolArray:
        """Which parameters (p,) have a prior that is a mixture."""
        return np.isfinite(self.wide_sd)

    @cached_property
    def cases(self) -> tuple[Self, ...]:
        """The Parameters with normal priors, all equally probable, of which these are the mixture, narrow ones first.

        These alone where no prior is a mixture.
        """
        if not self.mixed.any():
            return (self,)
        owners = [(number, unit) for number, block in enumerate(self.blocks) for unit in block.units]
        groups = list(dict.fromkeys(owner for owner, mixed in zip(owners, self.mixed.tolist(), strict=True) if mixed))
        result = []
        for wide in product((False, True), repeat=len(groups)):
            chosen = {group for group, is_wide in zip(groups, wide, strict=True) if is_wide}
            sd = np.where(self.mixed & [owner in chosen for owner in owners], self.wide_sd, self.sd)
            parts = [(block, sd[self.slices[block.name]]) for block in self.blocks]
            blocks = (replace(block, sd=own, wide_sd=np.full(len(own), np.nan)) for block, own in parts)
            result.append(replace(self, blocks=tuple(blocks)))
        return tuple(result)

    @cached_property
    def prior_precision(self) -> FloatArray:
        """Precisions (p,) of the priors, 0 for a flat one, of the narrow one of a mixture."""
        with np.errstate(divide="ignore"):
            return np.asarray(self.sd**-2.0)

    def prior_cost(self, values: FloatArray) -> float:
        """Negative log prior density of values (p,), up to a constant."""
        if self.mixed.any():
            costs = [case.prior_cost(values) + float(np.log(case.sd[self.mixed]).sum()) for case in self.cases]
            return -float(logsumexp(-np.array(costs)))
        known = np.isfinite(self.sd)
        return 0.5 * float((((values - self.mean)[known] / self.sd[known]) ** 2).sum())
