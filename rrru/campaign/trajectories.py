"""Trajectories: curves that the robot is commanded along, and their sampling points. Lengths in mm, robot frame."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from rrru.errors import ConfigError


@dataclass(frozen=True)
class Line:
    """Straight line from start to end (3,) in mm with equally spaced points."""

    name: str
    start_mm: tuple[float, float, float]
    end_mm: tuple[float, float, float]
    count: int

    def __post_init__(self) -> None:
        _require_count(self.name, self.count)
        if np.allclose(self.start_mm, self.end_mm):
            raise ConfigError(f"trajectory {self.name}: start_mm and end_mm are the same point {tuple(self.start_mm)}")

    def curve(self, share: npt.ArrayLike) -> np.ndarray:
        """Positions (n, 3) in mm at shares (n,) of the curve's parameter, 0 at the start and 1 at the end."""
        start, end = np.asarray(self.start_mm, dtype=float), np.asarray(self.end_mm, dtype=float)
        positions: np.ndarray = start + np.asarray(share, dtype=float)[:, None] * (end - start)
        return positions


@dataclass(frozen=True)
class Spiral:
    """Conical spiral: radius and height grow linearly with the angle; points equally spaced in angle.

    # ASSUME paper A draws the spiral (Fig. 11a) without giving one dimension; 40 points are stated.
    """

    name: str
    centre_mm: tuple[float, float]
    radius_mm: tuple[float, float]
    z_mm: tuple[float, float]
    turns: float
    count: int
    start_deg: float = 0.0

    def __post_init__(self) -> None:
        _require_count(self.name, self.count)
        if not self.turns > 0.0 or min(self.radius_mm) < 0.0 or max(self.radius_mm) == 0.0:
            raise ConfigError(
                f"trajectory {self.name}: turns {self.turns} and radius_mm {tuple(self.radius_mm)}; allowed: positive"
            )

    def curve(self, share: npt.ArrayLike) -> np.ndarray:
        """Positions (n, 3) in mm at shares (n,) of the curve's parameter, 0 at the start and 1 at the end."""
        share = np.asarray(share, dtype=float)
        angle = np.radians(self.start_deg) + 2.0 * np.pi * self.turns * share
        radius = self.radius_mm[0] + share * (self.radius_mm[1] - self.radius_mm[0])
        height = self.z_mm[0] + share * (self.z_mm[1] - self.z_mm[0])
        x, y = self.centre_mm[0] + radius * np.cos(angle), self.centre_mm[1] + radius * np.sin(angle)
        return np.stack([x, y, height], axis=-1)


Trajectory: TypeAlias = Line | Spiral


def sample(trajectory: Trajectory) -> np.ndarray:
    """Sampling points (count, 3) of a trajectory in mm."""
    return trajectory.curve(np.linspace(0.0, 1.0, trajectory.count))


def line_groups(
    start_mm: Sequence[float], end_mm: Sequence[float], offsets_y_mm: Iterable[float], count: int
) -> tuple[Line, ...]:
    """Parallel lines `line_1`, `line_2`, ...: the line from start to end (3,) in mm, shifted in y by each offset."""
    return tuple(
        Line(f"line_{k}", (start_mm[0], start_mm[1] + dy, start_mm[2]), (end_mm[0], end_mm[1] + dy, end_mm[2]), count)
        for k, dy in enumerate(offsets_y_mm, start=1)
    )


def from_config(section: Mapping[str, Any]) -> tuple[Trajectory, ...]:
    """Trajectories of one `trajectories:` entry of the configuration: line groups first, then the spiral."""
    result: tuple[Trajectory, ...] = ()
    if "lines" in section:
        lines = dict(section["lines"])
        result += line_groups(count=lines.pop("points"), **lines)
    if "spiral" in section:
        spiral = {key: tuple(value) if isinstance(value, list) else value for key, value in section["spiral"].items()}
        result += (Spiral(**{"name": "spiral", "count": spiral.pop("points")} | spiral),)
    return result


def _require_count(name: str, count: int) -> None:
    """Raise ConfigError for fewer than two points."""
    if count < 2:
        raise ConfigError(f"trajectory {name}: {count} points; allowed: at least 2")
