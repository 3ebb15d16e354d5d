"""Readings of an instrument: places of reflectors on a robot's tool, and the orientation of its platform.

A residual has m = n + k rows of three numbers. The first n rows are of the positions, in mm. After them come the rows
of the k orientations read: rotation vectors in rad times a characteristic length in mm. All rows have the same noise.
"""

from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from rrru.arrays import BoolArray, FloatArray, IntArray, Rows
from rrru.kinematics.chain import Poses
from rrru.kinematics.legs import TOOL, WORLD, Legs

if TYPE_CHECKING:
    from rrru.kinematics.robot import Robot

_EYE = np.eye(3)


@dataclass(frozen=True, eq=False)
class Readings:
    """Readings at n poses.

    position_mm (n, 3): measured positions, world frame.
    reflectors (n,): names of the sites of the reflectors read, None where the tool itself was read.
    place_mm (n, 3): nominal positions of these reflectors in the platform's frame, None where `reflectors` is.
    turn (n, 3, 3): measured orientations of the platform, NaN where not read, None where none was.
    characteristic_length_mm: noise of the positions over that of the orientations, mm per rad; it turns the residuals
        of orientations into mm of the same noise.
    on_world (n,): which reflectors are fixed to the world instead, with `place_mm` in the robot's frame; None if none
        is.

    Raises ValueError for reflectors without places, or places without reflectors.
    """

    position_mm: FloatArray
    reflectors: npt.NDArray[np.str_] | None = None
    place_mm: FloatArray | None = None
    turn: FloatArray | None = None
    characteristic_length_mm: float = np.nan
    on_world: BoolArray | None = None

    def __post_init__(self) -> None:
        if (self.reflectors is None) != (self.place_mm is None):
            given = "places without reflectors" if self.reflectors is None else "reflectors without places"
            raise ValueError(f"readings have {given}; allowed: both or none")

    def __len__(self) -> int:
        return len(self.position_mm)

    @property
    def tool_positions_only(self) -> bool:
        """Whether only positions of the tool were read."""
        return self.reflectors is None and self.turn is None

    @cached_property
    def oriented(self) -> IntArray:
        """Poses (k,) whose orientation was read."""
        return np.flatnonzero(_known(self.turn)) if self.turn is not None else np.zeros(0, dtype=int)

    @cached_property
    def rows(self) -> IntArray:
        """Pose (m,) of each row of a residual."""
        return np.concatenate([np.arange(len(self)), self.oriented])

    def of(self, rows: Rows) -> "Readings":
        """The readings of some poses."""
        parts = {f.name: getattr(self, f.name) for f in fields(self)}
        # arrays and a number
        cut: dict[str, Any] = {
            name: part[rows] if isinstance(part, np.ndarray) else part for name, part in parts.items()
        }
        return Readings(**cut)


def place_on_platform(robot: "Robot", twists: FloatArray, readings: Readings | None = None) -> FloatArray:
    """Positions (n or 1, 3) of what is read, in the platform's frame, under twists (n or 1, sites, 6).

    Reflectors that are fixed to the world have positions in the robot's frame.
    """
    numbers, tool_mm = robot.legs.site_numbers, np.asarray(robot.tool_mm)
    tool = twists[:, numbers[TOOL]]
    if readings is None or readings.reflectors is None or readings.place_mm is None:
        return tool_mm + tool[:, :3]
    count = len(readings)
    every = np.broadcast_to(twists, (count, *twists.shape[1:]))
    reflector = every[np.arange(count), reflector_numbers(robot.legs, readings.reflectors)]
    on_tool = tool_mm + turned_by(tool[:, 3:], readings.place_mm - tool_mm) + tool[:, :3]
    if readings.on_world is not None:
        on_tool = np.where(readings.on_world[:, None], readings.place_mm, on_tool)
    return on_tool + reflector[:, :3]


def points_read(robot: "Robot", poses: Poses, twists: FloatArray, readings: Readings | None = None) -> FloatArray:
    """Positions (n, 3) of what is read at Poses, in the robot's frame, under twists (n or 1, sites, 6)."""
    place = place_on_platform(robot, twists, readings)
    if readings is None or readings.on_world is None:
        return poses.point(place)
    return np.where(readings.on_world[:, None], place, poses.point(place))


def reflector_numbers(legs: Legs, reflectors: npt.NDArray[np.str_]) -> IntArray:
    """Site's number (n,) of each of reflectors (n,), names of their sites."""
    return np.array([legs.site_numbers[name] for name in reflectors])


def orientation(robot: "Robot", poses: Poses, twists: FloatArray) -> FloatArray:
    """Orientations (n, 3, 3) of the platform as an instrument in the world's frame reads them."""
    numbers = robot.legs.site_numbers
    world, tool = (_turn(twists[:, numbers[site], 3:]) for site in (WORLD, TOOL))
    return world @ poses.turn @ tool


def reading_residual(robot: "Robot", readings: Readings, poses: Poses, twists: FloatArray) -> FloatArray:
    """Residual (m, 3) of readings at Poses under twists (n or 1, sites, 6): what was read minus the model."""
    position = readings.position_mm - robot.measured(poses, twists, readings)
    if not len(readings.oriented):
        return position
    return np.concatenate(
        [position, readings.characteristic_length_mm * orientation_residual(robot, readings, poses, twists)]
    )


def orientation_residual(robot: "Robot", readings: Readings, poses: Poses, twists: FloatArray) -> FloatArray:
    """Rotation vectors (k, 3) from the model's orientations to those that were read; NaN where the model has none."""
    result = np.full((len(readings.oriented), 3), np.nan)
    if readings.turn is None:
        return result
    model = orientation(robot, poses, twists)[readings.oriented]
    good = _known(model)
    off = readings.turn[readings.oriented[good]] @ model[good].transpose(0, 2, 1)
    result[good] = Rotation.from_matrix(off).as_rotvec() if good.any() else 0.0
    return result


def inverse_right_jacobian(vectors: FloatArray) -> FloatArray:
    """Inverse right Jacobians (k, 3, 3) of SO(3) at rotation vectors v (k, 3), to second order in v.

        Jr^-1(v) = I + [v]x / 2 + [v]x^2 / 12

    A small rotation w of the model changes the residual v = log(R_read R_model^T) by -Jr^-1(v) w. Source: Sola, Deray
    and Atchuthan, A micro Lie theory for state estimation in robotics, arXiv:1812.01537, appendix B.
    """
    cross = np.cross(vectors[:, None, :], _EYE).transpose(0, 2, 1)
    return np.asarray(_EYE + 0.5 * cross + cross @ cross / 12.0)


def turned_by(vectors: FloatArray, points: FloatArray) -> FloatArray:
    """Points (n, 3) turned by rotation vectors (n or 1, 3)."""
    if not np.any(vectors):
        return points
    turned: FloatArray = np.einsum("nij,nj->ni", np.broadcast_to(_turn(vectors), (len(points), 3, 3)), points)
    return turned


def _turn(vectors: FloatArray) -> FloatArray:
    """Rotation matrices (n, 3, 3) of rotation vectors (n, 3), which may be read-only."""
    return np.asarray(Rotation.from_rotvec(np.array(vectors)).as_matrix())


def _known(matrices: FloatArray) -> BoolArray:
    """Which (n,) of matrices (n, 3, 3) are known."""
    known: BoolArray = np.all(np.isfinite(matrices), axis=(1, 2))
    return known
