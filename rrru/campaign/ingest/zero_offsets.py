"""Initial values of lost zero offsets, fitted together with frame and reflectors where these leave a large residual.

A robot that has lost its zero references is off by tens of millimetres. A frame fitted with the nominal drives is then
wrong, and good points look like outliers. Where frame and places of reflectors leave a large residual, the drives' zero
offsets are fitted with them: from the nominal zeros and, where that does not converge well, from other starts. For each
start the frame is fitted first. A zero offset that is confounded with a frame or a reflector, such as that of an arm's
first drive, stays nominal. Lengths in mm, angles in rad.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from scipy.optimize import least_squares

from rrru.kinematics.base_parameters import MeasurementConfig, candidates_of, choose, direction, open_numbers
from rrru.kinematics.chain import Poses
from rrru.kinematics.readings import Readings, reading_residual
from rrru.kinematics.robot import Robot

# shares of the robot's size: from the first on a residual may be due to zero offsets, above the second only to these;
# a fit that leaves less than the third share of the residual explains it
_MAY_BE, _LOST, _EXPLAINED = 5e-4, 2e-3, 0.5
# an assembly sets zeros better than this, in rad and in mm
LARGE = {"rad": 5e-3, "mm": 2.0}
# ASSUME a zero that was set by eye at marks of the axis, about a degree, is better than this: beyond, it is lost
LOST = {"rad": np.radians(1.0), "mm": 5.0}
# other starts, drawn so far from the nominal zeros; a fit this good needs no other
_STARTS, _SPREAD, _ENOUGH = 16, {"rad": 0.4, "mm": 80.0}, 0.1
# evaluations of a fit: one that ends well needs twenty
_EVALUATIONS = 60
# residual from which on a reading counts less
_LOOSE_MM = 5.0
# residual over the least, up to which two starts have ended at the same zeros
_SAME = 1.01
# residual of a reading whose pose does not close
_LOST_MM = 1e4
# actuator values (n, K) and nominal positions (n, 3)
_Driven: TypeAlias = tuple[np.ndarray, np.ndarray]
# share of a zero offset's effect that must be independent of frame and reflectors
_LEAST = 1e-2


def found_zeros(
    robot: Robot, driven: _Driven, seen: Readings, frames: Callable[[Poses], "Framed"]
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Zero offsets (K,) of the actuator values that explain the residual of the frames; zero where they do not.

    And how far they are off over LOST (K,), see `_far_off`, and whether they are lost: the nominal zeros are no start
    that leads to them, or one is off by more than LOST.

    driven: actuator values (n, K) and nominal positions (n, 3); seen: Readings in the instrument's frame; frames: from
    Poses to a Framed.
    """
    units, nothing = robot.parts.units, np.zeros(len(robot.parts.drives))
    before = _off(robot, driven, frames, nothing)
    if before <= _MAY_BE * robot.size_mm:
        return nothing, nothing, False
    generator, best, least, first_left = np.random.default_rng(0), nothing, before, np.inf
    spread = np.array([_SPREAD[unit] for unit in units])
    for start in range(_STARTS):
        first = nothing if start == 0 else spread * generator.uniform(-1.0, 1.0, len(units))
        found = _fitted(robot, driven, seen, frames, first)
        left = np.inf if found is None else _off(robot, driven, frames, found)
        if start == 0:
            first_left = left
        if found is not None and left < least:
            best, least = found, left
        if least <= max(_ENOUGH * before, _LOST * robot.size_mm):
            break
    if least >= _EXPLAINED * before:
        return nothing, nothing, False
    far = _far_off(robot, driven, frames, best)
    # several starts end at the same zeros to rounding
    return best, far, bool((far > 1.0).any() or first_left > _SAME * least)


def _far_off(robot: Robot, driven: _Driven, frames: Callable[[Poses], "Framed"], zeros: np.ndarray) -> np.ndarray:
    """Sizes (K,) of zero offsets (K,) over LOST, 0 for those that move what is read by less than LARGE in mm.

    As much may be an error of tool or links: a zero whose drive moves what is read on a small radius makes up for it.
    Without a zero that is not small the robot may have no pose at some stop.
    """
    with_all = frames(robot.solve(driven[0] + zeros, driven[1])).model_mm
    sizes: np.ndarray = np.abs(zeros) / np.array([LOST[unit] for unit in robot.parts.units])
    for k in np.flatnonzero(sizes):
        nominal = zeros * (np.arange(len(zeros)) != k)
        poses = robot.solve(driven[0] + nominal, driven[1])
        if not poses.closed.all():
            continue
        moved = frames(poses).model_mm - with_all
        if np.sqrt((moved**2).sum(axis=1).mean()) < LARGE["mm"]:
            sizes[k] = 0.0
    return sizes


@dataclass(frozen=True)
class Framed:
    """Poses in a fitted frame: readings (n, 3) in the robot's frame, those of the model (n, 3), places (n, 3) of the
    reflectors read, and names of the reflectors whose places are not known.
    """

    position_mm: np.ndarray
    model_mm: np.ndarray
    place_mm: np.ndarray
    unknown: tuple[str, ...]

    @property
    def off_mm(self) -> float:
        """Median distance of the readings from the model."""
        return float(np.median(np.linalg.norm(self.position_mm - self.model_mm, axis=1)))


def _off(robot: Robot, driven: _Driven, frames: Callable[[Poses], "Framed"], zeros: np.ndarray) -> float:
    """Median distance in mm that frames leave at other zeros (K,) of the drives; inf where a pose is lost."""
    poses = robot.solve(driven[0] + zeros, driven[1])
    return frames(poses).off_mm if poses.closed.all() else np.inf


def _fitted(
    robot: Robot, driven: _Driven, seen: Readings, frames: Callable[[Poses], "Framed"], zeros: np.ndarray
) -> np.ndarray | None:
    """Zeros (K,) fitted with frame and reflectors from a start, None where a pose is lost."""
    values, near = driven[0] + zeros, driven[1]
    poses = robot.solve(values, near)
    if not poses.closed.all():
        return None
    framed = frames(poses)
    reflectors = () if seen.reflectors is None else tuple(dict.fromkeys(seen.reflectors.tolist()))
    config = MeasurementConfig(reflectors, framed.unknown, frame=True)
    robot = robot.with_measurement_config(config)
    readings = replace(seen, position_mm=framed.position_mm, place_mm=framed.place_mm)
    # frame and reflectors first: the drives explain the remainder
    opened = open_numbers(config)
    numbers = (*opened, *candidates_of(robot.legs, robot.parts)[: len(robot.parts.drives)])
    scale = np.array([1.0 if number.unit == "mm" else 1.0 / robot.characteristic_length_mm for number in numbers])
    directions = scale * np.stack([direction(robot.legs, number) for number in numbers], axis=-1)
    columns = robot.map(values, poses, robot.twists(), readings).columns(directions)
    chosen, _ = choose(columns.reshape(-1, len(numbers)), [True] * len(numbers), _LEAST)
    directions = directions[..., chosen]

    def residual(sizes: np.ndarray) -> np.ndarray:
        twists = (directions @ sizes)[None]
        left = reading_residual(robot, readings, robot.solve(values, near, twists), twists)
        return np.where(np.isfinite(left), left, _LOST_MM).ravel()

    def slope(sizes: np.ndarray) -> np.ndarray:
        twists = (directions @ sizes)[None]
        at = robot.map(values, robot.solve(values, near, twists), twists, readings)
        return np.asarray(-np.nan_to_num(at.columns(directions)).reshape(-1, len(chosen)))

    loose = {"loss": "soft_l1", "f_scale": _LOOSE_MM}
    solution = least_squares(residual, np.zeros(len(chosen)), jac=slope, max_nfev=_EVALUATIONS, **loose)
    sizes = np.zeros(len(numbers))
    sizes[chosen] = solution.x * scale[chosen]
    return zeros + sizes[len(opened) :]
