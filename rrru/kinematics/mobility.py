"""Mobility of a robot's platform with locked drives (null space of its constraints), in words. mm, rad."""

from collections.abc import Sequence

import numpy as np

from rrru.arrays import FloatArray
from rrru.kinematics.chain import PoseGuess, Twists, walks
from rrru.kinematics.closure_kernel import CHARACTERISTIC_LENGTH_MM
from rrru.kinematics.legs import Legs
from rrru.kinematics.wrenches import by_group, spare_joints, wrenches_of

# singular values below this share of the largest are none
_NONE = 1e-6
_SCALE = np.repeat([CHARACTERISTIC_LENGTH_MM, 1.0], 3)


def free_motions(legs: Legs, up: Sequence[float] | FloatArray = (0.0, 0.0, 1.0)) -> list[str]:
    """The motions in words, at the home pose of Legs, such as "turn about the vertical axis through the platform"."""
    free = _free_twists(legs)
    # at the platform's centre: shifts, turns about it, then the remaining screws
    free[:, :3] += np.cross(free[:, 3:], legs.home_mm / CHARACTERISTIC_LENGTH_MM)
    shifts, turns = _without(free, slice(3, 6)), _without(free, slice(0, 3))
    pure = np.concatenate([shifts, turns])
    left = np.linalg.svd(free - free @ np.linalg.pinv(pure) @ pure)[2][: len(free) - len(pure)]
    words = [f"shift along {_direction(one[:3], up)}" for one in shifts]
    words += [f"turn about {_direction(one[3:], up)} through the platform" for one in turns]
    return words + [_screw(one, legs.home_mm, up) for one in left]


def _free_twists(legs: Legs) -> FloatArray:
    """Twists (k, 6) at the world's origin, lengths counted in the arm, that no leg resists."""
    twists, actuators = Twists(legs), legs.home_drives[None]
    home = PoseGuess(legs.home_mm[None], legs.home_turn[None], legs.home_passive[None])
    ways = walks(legs, actuators, home, twists)
    rows = by_group(legs, wrenches_of(legs, spare_joints(legs), ways))
    wrenches = np.concatenate([np.zeros((6, 6)), *(one[0] for one in rows)]) * _SCALE
    _, size, vectors = np.linalg.svd(wrenches / np.maximum(np.linalg.norm(wrenches, axis=1, keepdims=True), 1e-300))
    return np.asarray(vectors[size <= _NONE * size[0]])


def _without(twists: FloatArray, part: slice) -> FloatArray:
    """Twists (m, 6) that span those of a space (k, 6) of which a part is zero, simple ones by elimination."""
    _, size, vectors = np.linalg.svd(np.concatenate([twists[:, part].T, np.zeros((len(twists), len(twists)))]))
    result = vectors[size < _NONE] @ twists
    for row in range(len(result)):
        pivot, column = (int(k) for k in np.unravel_index(np.abs(result[row:]).argmax(), result[row:].shape))
        result[[row, row + pivot]] = result[[row + pivot, row]]
        result[row] /= result[row, column]
        further = np.arange(len(result)) != row
        result[further] -= np.outer(result[further, column], result[row])
    return result


def _direction(vector: FloatArray, up: Sequence[float] | FloatArray) -> str:
    """A direction (3,) in words."""
    unit = vector / np.linalg.norm(vector)
    if abs(unit @ np.asarray(up)) > 1.0 - _NONE:
        return "the vertical"
    for name, axis in zip("xyz", np.eye(3), strict=True):
        if abs(unit @ axis) > 1.0 - _NONE:
            return f"the direction {name}"
    unit = unit * np.sign(unit[np.abs(unit).argmax()])
    return "the direction ({:.3f}, {:.3f}, {:.3f})".format(*unit)


def _screw(twist: FloatArray, centre_mm: FloatArray, up: Sequence[float] | FloatArray) -> str:
    """A twist (6,) at the platform's centre, lengths counted in the arm, in words."""
    shift, turn = twist[:3] * CHARACTERISTIC_LENGTH_MM, twist[3:]
    square = turn @ turn
    x, y, z = centre_mm + np.cross(turn, shift) / square
    pitch = shift @ turn / square
    screw = (
        f" while shifting along it by {pitch:.3g} mm per rad" if abs(pitch) > CHARACTERISTIC_LENGTH_MM * _NONE else ""
    )
    return f"turn about {_direction(turn, up)} through ({x:.3f}, {y:.3f}, {z:.3f}) mm{screw}"
