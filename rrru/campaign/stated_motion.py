"""Motion from one measured point to the next, as far as a campaign states it with its key `motion`."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import pandas as pd

from rrru.errors import ConfigError

STOP_AND_GO, CONTINUOUS = "stop_and_go", "continuous"
# what is straight from stop to stop: the tool's path, its orientation turning about one axis (LIN), or the drives (PTP)
TOOL, DRIVES = "tool", "drives"
KINDS, BETWEEN = (STOP_AND_GO, CONTINUOUS), (TOOL, DRIVES)


@dataclass(frozen=True)
class StatedMotion:
    """kind: "stop_and_go" of a robot that rests at each reading, "continuous" of one that is measured while it moves.

    between: what is straight from stop to stop, "tool" or "drives"; None where it is not stated. Raises ConfigError for
    other values, and for `between` of a robot that does not stop.
    """

    kind: str
    between: str | None = None

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ConfigError(f"motion is {self.kind!r}; allowed: {', '.join(KINDS)}")
        if self.between is not None and self.between not in BETWEEN:
            raise ConfigError(f"motion.between is {self.between!r}; allowed: {', '.join(BETWEEN)}")
        if self.between is not None and self.kind != STOP_AND_GO:
            raise ConfigError(f"motion.between of {self.kind} motion; allowed: with kind {STOP_AND_GO}")

    @property
    def stops(self) -> bool:
        """Whether the robot rests at each reading."""
        return self.kind == STOP_AND_GO

    @property
    def words(self) -> str:
        """The statement in words."""
        return self.kind + (f", straight in the {self.between}" if self.between else "")

    @classmethod
    def from_config(cls, value: str | Mapping[str, Any]) -> Self:
        """From the value of a campaign's key: a kind, or a mapping of `kind` and `between`."""
        if not isinstance(value, Mapping):
            return cls(value)
        if unknown := [key for key in value if key not in ("kind", "between")]:
            raise ConfigError(f"motion has the key {unknown[0]!r}; allowed: kind, between")
        given: dict[str, Any] = {"kind": None, **value}
        return cls(**given)

    def columns(self) -> dict[str, str]:
        """Columns of a measurement table by name, each of one value, from which `stated_motion` reads it."""
        return {"motion": self.kind} | ({"motion_between": self.between} if self.between else {})


def stated_motion(measurements: pd.DataFrame) -> StatedMotion | None:
    """Motion stated by the columns of a measurement table, None where they are missing."""
    if "motion" not in measurements or not len(measurements):
        return None
    first = measurements.iloc[0]
    return StatedMotion(first["motion"], first.get("motion_between"))


def rests(measurements: pd.DataFrame) -> bool:
    """Whether a measurement table states that the robot rests at each reading."""
    stated = stated_motion(measurements)
    return stated is not None and stated.stops
