"""Settings of the genetic algorithm, as the configuration names them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from numbers import Integral, Real
from typing import Any, Self

import numpy as np

from rrru.arrays import FloatArray
from rrru.errors import ConfigError
from rrru.genetic.plan import elite_count

# values (m,) of individuals (m, p)
Objective = Callable[[FloatArray], FloatArray]
# readings of the paper: MATLAB's step with its Gaussian or its adaptive feasible mutation, and PyGAD's own operators;
# and CMA-ES, which needs a fraction of the evaluations
OPERATORS = ("matlab_gaussian", "matlab_adaptive", "pygad", "cma_es")
_ALLOWED = {
    "crossover_fraction": (Real, 0.0, 1.0, "0 to 1"),
    "migration_fraction": (Real, 0.0, 1.0, "0 to 1"),
    "migration_interval": (Integral, 1, np.inf, "a whole number from 1"),
    "elite_share": (Real, 0.0, 1.0, "above 0, below 1"),
    "generations": (Integral, 1, np.inf, "a whole number from 1"),
    "stall_generations": (Integral, 0, np.inf, "a whole number from 0; 0 never stops early"),
    "stall_tolerance": (Real, 0.0, np.inf, "0 or more"),
    "mutation_scale": (Real, 0.0, np.inf, "0 or more"),
    "mutation_shrink": (Real, 0.0, 1.0, "0 to 1"),
}


@dataclass(frozen=True)
class GeneticSettings:
    """Settings of one run, named as MATLAB's; see `operators`, `plan`, `pygad_run` and `cma_es` for what each does.

    operators: one of OPERATORS; "pygad" takes of the others only the crossover fraction, as its crossover probability,
    and those of islands, generations and stalling; "cma_es" only the whole population, generations and stalling.
    crossover_fraction: P_c, share of the non-elite children made by crossover, the others by mutation.
    migration_fraction: P_m, share of the smaller island that migrates every `migration_interval` generations.
    populations: sizes of the islands. elite_share: elites per island are ceil(share size). stall_generations,
    stall_tolerance: see `operators.has_stalled`; 0 generations never stop early. mutation_scale, mutation_shrink: see
    `plan.mutation_sigma`. Raises ConfigError for a value that is not allowed.
    """

    crossover_fraction: float = 0.8
    migration_fraction: float = 0.7
    populations: tuple[int, ...] = (30,)
    migration_interval: int = 20
    elite_share: float = 0.05
    generations: int = 1400
    stall_generations: int = 50
    stall_tolerance: float = 1e-6
    mutation_scale: float = 1.0
    mutation_shrink: float = 1.0
    operators: str = "matlab_gaussian"

    def __post_init__(self) -> None:
        if self.operators not in OPERATORS:
            raise ConfigError(f"operators is {self.operators!r}; allowed: {', '.join(OPERATORS)}")
        for name, (kind, lowest, highest, allowed) in _ALLOWED.items():
            value = getattr(self, name)
            if not is_number(value, kind) or not np.isfinite(value) or not lowest <= value <= highest:
                raise ConfigError(f"{name} is {value!r}; allowed: {allowed}")
        sizes = self.populations
        several = isinstance(sizes, tuple | list) and sizes
        if not several or not all(is_number(size, Integral) and size >= 2 for size in sizes):
            allowed = "one whole number from 2 per island, at least one island"
            raise ConfigError(f"populations is {sizes!r}; allowed: {allowed}")
        object.__setattr__(self, "populations", tuple(int(size) for size in sizes))
        if not all(0 < elite_count(size, self.elite_share) < size for size in sizes):
            allowed = f"above 0, and leaving a place in each of the islands of {sizes}"
            raise ConfigError(f"elite_share is {self.elite_share!r}; allowed: {allowed}")

    @classmethod
    def from_config(cls, section: Mapping[str, Any], **changes: Any) -> Self:
        """From the configuration's `genetic` section with some values replaced."""
        return cls(**{item.name: section[item.name] for item in fields(cls) if item.name in section} | changes)


def is_number(value: Any, kind: type) -> bool:
    """Whether the value is a number of the kind; a truth value is not a number."""
    return isinstance(value, kind) and not isinstance(value, bool)
