"""Named parameters of a robot or an effect, and the map between mappings by name and vectors."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from rrru.errors import ConfigError


@dataclass(frozen=True)
class Parameter:
    """One parameter of a model: name, unit, nominal value, bounds, source of these, number of its leg (0: all legs)."""

    name: str
    unit: str
    nominal: float = 0.0
    low: float = -np.inf
    high: float = np.inf
    source: str = ""
    leg: int = 0

    def __post_init__(self) -> None:
        if not self.low <= self.nominal <= self.high:
            bounds = f"[{self.low}, {self.high}]"
            raise ConfigError(
                f"parameter {self.name}: nominal {self.nominal} {self.unit} lies outside its bounds {bounds}"
            )


@dataclass(frozen=True)
class ParameterSet:
    """An ordered set of parameters: the meaning of a parameter vector's entries."""

    parameters: tuple[Parameter, ...]

    def __post_init__(self) -> None:
        if len(set(self.names)) != len(self.names):
            raise ConfigError(f"parameter names are not unique: {self.names}")

    def __len__(self) -> int:
        return len(self.parameters)

    def __iter__(self) -> Iterator[Parameter]:
        return iter(self.parameters)

    def __getitem__(self, name: str) -> Parameter:
        return self.parameters[self.index(name)]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names in the order of the vector."""
        return tuple(p.name for p in self.parameters)

    @property
    def units(self) -> tuple[str, ...]:
        """Units in the order of the vector."""
        return tuple(p.unit for p in self.parameters)

    @property
    def legs(self) -> np.ndarray:
        """Numbers (p,) of the legs that the parameters belong to, from 1; 0 for all legs."""
        return np.array([p.leg for p in self.parameters])

    @property
    def nominal(self) -> np.ndarray:
        """Nominal values, shape (p,)."""
        return np.array([p.nominal for p in self.parameters], dtype=float)

    @property
    def low(self) -> np.ndarray:
        """Lower bounds, shape (p,)."""
        return np.array([p.low for p in self.parameters], dtype=float)

    @property
    def high(self) -> np.ndarray:
        """Upper bounds, shape (p,)."""
        return np.array([p.high for p in self.parameters], dtype=float)

    def index(self, name: str) -> int:
        """Position of a name in the vector; raises ConfigError for an unknown name."""
        if name not in self._places:
            raise ConfigError(f"unknown parameter {name!r}; known: {', '.join(self.names)}")
        return self._places[name]

    @cached_property
    def _places(self) -> dict[str, int]:
        return {name: place for place, name in enumerate(self.names)}

    def vector(self, values: Mapping[str, float] | None = None) -> np.ndarray:
        """Vector, shape (p,), from a mapping of names to values; absent names are nominal."""
        result = self.nominal
        for name, value in dict(values or {}).items():
            result[self.index(name)] = value
        return result

    def mapping(self, vector: npt.ArrayLike) -> dict[str, float]:
        """Dict of names to values from a vector of shape (p,)."""
        vector = np.asarray(vector, dtype=float)
        if vector.shape != (len(self),):
            raise ConfigError(f"expected {len(self)} values for {', '.join(self.names)}, got shape {vector.shape}")
        return dict(zip(self.names, vector.tolist(), strict=True))

    def contains(self, vector: np.ndarray) -> bool:
        """Whether a vector (p,) lies within the bounds."""
        return bool(((vector >= self.low) & (vector <= self.high)).all())

    def clipped_inside(self, vector: np.ndarray, margin: float = 1e-6) -> np.ndarray:
        """Nearest vector (p,) within the bounds, off them by a share `margin` of their width."""
        inset = margin * (self.high - self.low)
        return np.clip(vector, self.low + inset, self.high - inset)

    def at_bound(self, vector: np.ndarray, share: float = 1e-6) -> np.ndarray:
        """Flags (p,) of entries at a bound, or beyond it, within a share of the bounds' width."""
        inset = share * (self.high - self.low)
        return (vector <= self.low + inset) | (vector >= self.high - inset)
