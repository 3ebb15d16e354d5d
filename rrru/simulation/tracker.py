"""The instrument: a laser tracker that sees the tool or reflectors on it, and if asked the platform's orientation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from rrru.arrays import FloatArray, IntArray
from rrru.campaign import measurements as rows
from rrru.kinematics.chain import Poses
from rrru.kinematics.legs import TOOL
from rrru.kinematics.readings import orientation, turned_by
from rrru.kinematics.robot import Robot, into_frame


@dataclass(frozen=True)
class Sees:
    """Readings of the tracker besides the tool's position.

    targets: places (3,) in mm of reflectors on the platform by name, seen one after the other at every point instead of
    the tool; noise_rad: noise of the orientations that it reads, one sigma per axis, None where it reads none.
    """

    targets: Mapping[str, Sequence[float]] = field(default_factory=dict)
    noise_rad: float | None = None

    @property
    def only_tool(self) -> bool:
        """Whether it reads only the tool's position."""
        return not self.targets and self.noise_rad is None

    def rows(self, count: int) -> IntArray:
        """The commanded point (m,) of each row of a table of `count` points."""
        return np.repeat(np.arange(count), max(len(self.targets), 1))

    def positions(self, robot: Robot, poses: Poses, twists: FloatArray) -> FloatArray:
        """True positions (m, 3) of what it sees of a robot at n Poses under twists (n or 1, sites, 6)."""
        if not self.targets:
            return robot.measured(poses, twists)
        tool, seat = twists[:, robot.legs.site_numbers[TOOL]], np.asarray(robot.tool_mm)
        count = len(poses.position_mm)
        levers = (np.tile(np.asarray(place) - seat, (count, 1)) for place in self.targets.values())
        seen = [poses.point(seat + turned_by(tool[:, 3:], lever) + tool[:, :3]) for lever in levers]
        return np.stack([into_frame(place, twists[:, 0]) for place in seen], axis=1).reshape(-1, 3)

    def columns(
        self, robot: Robot, poses: Poses, twists: FloatArray, generator: np.random.Generator
    ) -> dict[str, npt.NDArray[Any]]:
        """Columns (m,) besides the positions: target, its place, orientations measured with noise."""
        count = len(poses.position_mm)
        result = {}
        if self.targets:
            result["target"] = np.array([*self.targets] * count, dtype=str)
            result |= rows.vector_columns("target", np.tile([*self.targets.values()], (count, 1)).astype(float))
        if self.noise_rad is not None:
            noise = Rotation.from_rotvec(self.noise_rad * generator.standard_normal((count, 3))).as_matrix()
            turns = noise @ orientation(robot, poses, twists)
            result |= rows.turn_columns("measured", turns[self.rows(count)])
        return result


def measure(position_mm: FloatArray, noise_mm: float, generator: np.random.Generator) -> FloatArray:
    """Positions (n, 3) with independent normal noise of `noise_mm` (1 sigma per axis, mm) from a numpy Generator."""
    return np.asarray(position_mm, dtype=float) + noise_mm * generator.standard_normal(np.shape(position_mm))
