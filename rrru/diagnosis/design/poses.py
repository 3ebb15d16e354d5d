"""Poses to drive for a diagnosis: short straight passes in the box about all that a campaign has measured.

A pose is passed in the middle of a straight line between rest and rest, since the effects of backlash, friction and lag
depend on how it is reached. A platform that the drives can orient keeps through a pass the orientation that was
commanded next to its start. Lengths in mm, speeds in mm/s.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import numpy.typing as npt
import pandas as pd

from rrru.arrays import BoolArray, FloatArray
from rrru.campaign import measurements as rows
from rrru.campaign.speed_profile import Trapezoid
from rrru.diagnosis.options import OPTIONS
from rrru.kinematics.inverse import inverse_kinematics
from rrru.kinematics.robot import Robot


@dataclass(frozen=True)
class Passes:
    """Passes of a robot.

    start_mm, end_mm (n, 3); drives (n, p, K): actuator values at the p points of each; turn (n, 3, 3): the platform's
    orientation, None where the drives cannot choose it; target: columns of a measurement table by name that say what is
    read; reads_turns: whether orientations are read.
    """

    start_mm: FloatArray
    end_mm: FloatArray
    drives: FloatArray
    turn: FloatArray | None = None
    target: Mapping[str, str | float] | None = None
    reads_turns: bool = False

    def __len__(self) -> int:
        return len(self.start_mm)

    def some(self, chosen: npt.ArrayLike) -> Self:
        """The passes that are flagged (n,)."""
        chosen = np.asarray(chosen, dtype=bool)
        turn = None if self.turn is None else self.turn[chosen]
        parts = {"start_mm": self.start_mm, "end_mm": self.end_mm, "drives": self.drives}
        return replace(self, turn=turn, **{name: values[chosen] for name, values in parts.items()})

    @property
    def rates_per_mm(self) -> FloatArray:
        """Largest changes (n, K) of the drives' values for a mm of way."""
        step = OPTIONS.pass_length_mm / (OPTIONS.points_per_pass - 1)
        return np.asarray(np.abs(np.diff(self.drives, axis=1)).max(axis=1) / step)

    def within(self, chosen: Sequence[int], speed_mm_s: float, seconds: float) -> int:
        """How many of the passes of some numbers, in this order, are driven in some seconds, with the ways between."""
        way = np.linalg.norm(self.start_mm[chosen[1:]] - self.end_mm[chosen[:-1]], axis=1)
        # a pass speeds up and slows down evenly, and so takes twice as long as at its full speed
        time = (2.0 * OPTIONS.pass_length_mm + np.concatenate([[0.0], way])) / speed_mm_s
        return int((~(np.cumsum(time) > seconds)).sum())

    def listed(self, chosen: Sequence[int]) -> pd.DataFrame:
        """Rows of `gap_next_poses` of the passes of some numbers, without speed and payload."""
        ends = rows.vector_columns("from", self.start_mm[chosen]) | rows.vector_columns("to", self.end_mm[chosen])
        turn = np.full((len(chosen), 3, 3), np.nan) if self.turn is None else self.turn[chosen]
        return pd.DataFrame({"pose": np.arange(1, len(chosen) + 1), **ends, **rows.turn_columns("command", turn)})

    def commands(self, mechanism: Robot, start_s: float, speed_mm_s: float, payload_kg: float) -> pd.DataFrame:
        """Table of the passes, numbered from 1, each a run that begins at one time of a campaign.

        The speed is that in the middle, to which each speeds up evenly; times are NaN where it is.
        """
        points, count = points_of(self.start_mm, self.end_mm).reshape(-1, 3), len(self)
        time = np.full(OPTIONS.points_per_pass, np.nan)
        if np.isfinite(speed_mm_s):
            profile = Trapezoid(OPTIONS.pass_length_mm, speed_mm_s, speed_mm_s**2 / OPTIONS.pass_length_mm)
            time = start_s + profile.time(np.linspace(0.0, OPTIONS.pass_length_mm, OPTIONS.points_per_pass))
        points_of_pass = np.arange(1, OPTIONS.points_per_pass + 1)
        numbers = {
            "run": np.repeat(np.arange(1, count + 1), len(points_of_pass)),
            "point": np.tile(points_of_pass, count),
        }
        drives = dict(zip(mechanism.parts.columns, self.drives.reshape(len(points), -1).T, strict=True))
        turn = self.turn if self.reads_turns else None
        return pd.DataFrame(numbers).assign(
            trajectory="poses",
            time_s=np.tile(time, count),
            speed_mm_s=speed_mm_s,
            payload_kg=payload_kg,
            status="ok",
            **rows.vector_columns("command", points),
            **rows.vector_columns("measured", points),
            **drives,
            **(self.target or {}),
            **({} if turn is None else rows.turn_columns("measured", np.repeat(turn, len(points_of_pass), axis=0))),
        )


def passes(measurements: pd.DataFrame, mechanism: Robot) -> Passes:
    """The Passes that a robot can drive in the box about its measured points.

    They go from one point of the box towards another, both of Sobol's sequence (Joe and Kuo, SIAM J. Sci. Comput. 30,
    2008), keep within the drives' ranges and clear of singularities. Of several targets the one that was read most is
    read. None for a robot with several end effectors, and none where no target is on the platform.
    """
    # loading takes as long as some diagnoses, and few advise poses
    from scipy.stats import qmc

    used = measurements[rows.usable(measurements)]
    target, known = _target(used), rows.command(used)
    drives = rows.actuators(used, mechanism)
    finite = np.isfinite(known).all(axis=1) & np.isfinite(drives).all(axis=1)
    known, drives = known[finite], drives[finite]
    if mechanism.legs.end_effectors or target is None or not len(known):
        return _none(mechanism)
    _, first = np.unique(known, axis=0, return_index=True)
    known, drives = known[first], drives[first]
    low, high = known.min(axis=0), known.max(axis=0)
    shares = qmc.Sobol(6, scramble=False).random_base2(OPTIONS.tried_passes_log2)
    start, other = low + shares[:, :3] * (high - low), low + shares[:, 3:] * (high - low)
    distance = np.linalg.norm(other - start, axis=1, keepdims=True)
    far = distance[:, 0] > OPTIONS.pass_length_mm
    if not far.any():
        # the box is smaller than a pass
        return _none(mechanism)
    start = start[far]
    end = start + OPTIONS.pass_length_mm * (other[far] - start) / distance[far]
    turn, reached = None, mechanism.planned(points_of(start, end).reshape(-1, 3))
    if mechanism.orients:
        turn, reached = _oriented(start, end, (known, drives), mechanism)
    reached = reached.reshape(len(start), OPTIONS.points_per_pass, -1)
    if read := rows.has_turns(measurements):
        turn = mechanism.solve(reached[:, 0], start).turn if turn is None else turn
    found = Passes(start, end, reached, turn, target, read)
    turning = np.array(mechanism.parts.units) == "rad"
    step = np.abs(np.diff(reached, axis=1)).max(axis=1)[:, turning].max(axis=1, initial=0.0)
    smooth = step < OPTIONS.max_pass_step_rad
    return found.some(smooth & _clear((known, drives), points_of(start, end), reached, mechanism))


def points_of(start_mm: FloatArray, end_mm: FloatArray) -> FloatArray:
    """Points (n, p, 3) of passes, p of each, from starts to ends (n, 3)."""
    return start_mm[:, None] + np.linspace(0.0, 1.0, OPTIONS.points_per_pass)[:, None] * (end_mm - start_mm)[:, None]


def _none(mechanism: Robot) -> Passes:
    """No Passes."""
    nothing = np.zeros((0, 3))
    return Passes(nothing, nothing, np.zeros((0, OPTIONS.points_per_pass, len(mechanism.parts.drives))))


def _target(used: pd.DataFrame) -> dict[str, str | float] | None:
    """Columns of the target on the platform that most rows read, {} where none is named, None where none is there."""
    if "target" not in used:
        return {}
    on_world = rows.on_the_world(used)
    on_robot = used if on_world is None else used[~on_world]
    if not len(on_robot):
        return None
    row = on_robot[on_robot["target"] == on_robot["target"].mode().iloc[0]].iloc[0]
    names = ("target", "target_on", *(f"target_{axis}_mm" for axis in "xyz"))
    return {name: row[name] for name in names if name in on_robot}


def _oriented(
    start_mm: FloatArray, end_mm: FloatArray, known: tuple[FloatArray, FloatArray], mechanism: Robot
) -> tuple[FloatArray, FloatArray]:
    """Orientations (n, 3, 3) of passes, and actuator values (n p, K) within the drives' ranges that reach them.

    The orientations are those commanded next to the starts. The solution begins at the drive values of the same pose;
    values are NaN out of reach. known: positions (m, 3) and actuator values (m, K) that were commanded.
    """
    from scipy.spatial import cKDTree

    position, drives = known
    turn = mechanism.solve(drives, position).turn
    fine = np.isfinite(turn).all(axis=(1, 2))
    nearest = np.flatnonzero(fine)[cKDTree(position[fine]).query(start_mm)[1]]
    at_points = np.repeat(nearest, OPTIONS.points_per_pass)
    place = points_of(start_mm, end_mm).reshape(-1, 3), turn[at_points]
    start = drives[at_points], position[at_points]
    reached = inverse_kinematics(mechanism, place, start, mechanism.twists(), False)
    return turn[nearest], mechanism.in_range(reached)


def _clear(
    known: tuple[FloatArray, FloatArray], points: FloatArray, reached: FloatArray, mechanism: Robot
) -> BoolArray:
    """Passes (n,) whose points (n, p, 3) at drives (n, p, K) are nearly as far from singularities as known ones."""
    flat, drive = points.reshape(-1, 3), reached.reshape(points.shape[0] * points.shape[1], -1)
    fine = np.asarray(np.isfinite(drive).all(axis=1))
    for measure, limit in zip(_measures(mechanism, flat, drive), _measures(mechanism, *known), strict=True):
        fine &= measure > OPTIONS.min_singularity_distance_ratio * np.nanmin(limit)
    return np.asarray(fine.reshape(points.shape[:2]).all(axis=1))


def _measures(mechanism: Robot, position_mm: FloatArray, drive: FloatArray) -> FloatArray:
    """Translational and constraint measure (n,) of poses, NaN out of reach."""
    result, fine = np.full((2, len(drive)), np.nan), np.isfinite(drive).all(axis=1)
    result[:, fine] = mechanism.singularities(position_mm[fine], drive[fine])[:2]
    return result
