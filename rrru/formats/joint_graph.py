"""Joint graph of a mechanism: seams of placements (4, 4) and moves join its rigid parts, for `rrru.formats.robot_file`.

Lengths in mm, angles in rad.
"""

from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation


@dataclass(frozen=True, eq=False)
class Move:
    """One freedom of a seam: "R" about or "P" along axis (3,), at home at the value `home`.

    joint: MuJoCo's number of its joint, None for a connect; origin: the joint's or connect's name in the file.
    """

    name: str
    kind: str
    axis: np.ndarray
    origin: str
    joint: int | None = None
    home: float = 0.0


# what a seam has in a row: a placement (4, 4) or a freedom
Item: TypeAlias = np.ndarray | Move


@dataclass(frozen=True, eq=False)
class Seam:
    """An edge of the graph: placements and Moves, in their order from the part `near` to the part `far`.

    body: MuJoCo's number of the body whose joints these are, None for connects, whose numbers are `connects`.
    """

    near: int
    far: int
    items: tuple[Item, ...]
    body: int | None = None
    connects: tuple[int, ...] = ()

    def other(self, part: int) -> int:
        """The other one of both parts."""
        return self.far if part == self.near else self.near

    def placement(self, number: int) -> np.ndarray:
        """The item of a number, which is a placement, as the first and the last one are."""
        item = self.items[number]
        if isinstance(item, Move):
            raise TypeError(f"item {number} of a seam is {item.name}; allowed: a placement")
        return item

    def items_from(self, part: int) -> tuple[Item, ...]:
        """The items in their order from one of both parts to the other."""
        if part == self.near:
            return self.items
        return tuple(
            inverse_placement(item) if isinstance(item, np.ndarray) else replace(item, axis=-item.axis)
            for item in reversed(self.items)
        )


def placed(shift_mm: npt.ArrayLike = (0.0, 0.0, 0.0), turn: np.ndarray | None = None) -> np.ndarray:
    """The placement of a shift (3,) and a turn (3, 3)."""
    result = np.eye(4)
    result[:3, 3] = shift_mm
    if turn is not None:
        result[:3, :3] = turn
    return result


def inverse_placement(placement: np.ndarray) -> np.ndarray:
    """The inverse of a placement."""
    turn = placement[:3, :3].T
    return placed(-turn @ placement[:3, 3], turn)


def turn_of(quaternion: np.ndarray) -> np.ndarray:
    """Rotation matrix (3, 3) of MuJoCo's quaternion (4,), of any length."""
    return np.asarray(Rotation.from_quat(quaternion, scalar_first=True).as_matrix())
