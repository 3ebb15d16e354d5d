"""The commanded motion: runs along trajectories with times, speed, payload and path. Lengths mm, times s."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from rrru.campaign.measurements import vector_columns
from rrru.campaign.speed_profile import Trapezoid
from rrru.campaign.trajectories import Trajectory, sample
from rrru.kinematics.robot import Robot

# Points of the path between two sampled points: enough for `backlash` to see a drive that turns back between them.
_PATH_STEPS = 16
_CURVE_SHARES = np.linspace(0.0, 1.0, 401)


@dataclass(frozen=True)
class Run:
    """One pass along a trajectory.

    points_mm (n, 3): sampled points in order, with time_s (n,), velocity_mm_s and acceleration_mm_s2 (n, 3) there;
    path_mm (N, 3): the finer path, in whose rows path_index (n,) the points are; speed_mm_s: of the profile.
    """

    trajectory: str
    points_mm: np.ndarray
    path_mm: np.ndarray
    path_index: np.ndarray
    time_s: np.ndarray
    velocity_mm_s: np.ndarray
    acceleration_mm_s2: np.ndarray
    speed_mm_s: float
    payload_kg: float

    def resting(self, settle_s: float) -> "Run":
        """The run of a robot that waits at every point until it rests, and is read then."""
        still, waited = np.zeros_like(self.points_mm), settle_s * np.arange(len(self.points_mm))
        return replace(self, time_s=self.time_s + waited, velocity_mm_s=still, acceleration_mm_s2=still)


@dataclass(frozen=True)
class Plan:
    """Runs in the order in which they are driven, with the rest between them."""

    runs: tuple[Run, ...]
    dwell_s: float

    def commands(self, mechanism: Robot) -> pd.DataFrame:
        """Table of the commanded points: run, trajectory, point, time, position, actuator values, speed, payload.

        Raises UnreachableError where a point is out of the mechanism's reach.
        """
        target, counts = self.targets(), [len(run.points_mm) for run in self.runs]
        runs = [(k, run.trajectory, run.speed_mm_s, run.payload_kg) for k, run in enumerate(self.runs, start=1)]
        by_run = pd.DataFrame(runs, columns=["run", "trajectory", "speed_mm_s", "payload_kg"])
        table = by_run.loc[np.repeat(by_run.index, counts)].reset_index(drop=True)
        table.insert(2, "point", np.concatenate([np.arange(1, count + 1) for count in counts]))
        values = mechanism.require_reachable(target)
        drives = dict(zip(mechanism.parts.columns, values.T, strict=True))
        return table.assign(time_s=self.time_s(), **vector_columns("command", target), **drives)

    def resting(self, settle_s: float) -> "Plan":
        """The plan of a robot that waits at every point until it rests, and is read then; itself if it does."""
        moving = any(run.velocity_mm_s.any() for run in self.runs)
        return replace(self, runs=tuple(run.resting(settle_s) for run in self.runs)) if moving else self

    def time_s(self) -> np.ndarray:
        """Times (n,) of all sampled points since the campaign's start, the rests between the runs included."""
        ends = np.array([run.time_s[-1] + self.dwell_s for run in self.runs])
        starts = np.concatenate([[0.0], np.cumsum(ends)[:-1]])
        return np.concatenate([start + run.time_s for start, run in zip(starts, self.runs, strict=True)])

    def targets(self) -> np.ndarray:
        """Commanded positions (n, 3) of all sampled points in order."""
        return np.concatenate([run.points_mm for run in self.runs])

    def path(self) -> tuple[np.ndarray, np.ndarray]:
        """Positions (N, 3) along all that is driven, transfers included, and the rows (n,) of the sampled points.

        The robot is assumed to go straight from the end of a run to the start of the next.
        """
        return connect([run.path_mm for run in self.runs], [run.path_index for run in self.runs], 2 * _PATH_STEPS)


def connect(paths: Iterable[np.ndarray], rows: Iterable[np.ndarray], steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions (N, 3) along paths (k, 3) with straight transfers between them, and where their rows (m,) are in it.

    A transfer has `steps` points with its two ends; there is none where a path begins at the end of the one before.
    """
    pieces, index, length, last = [], [], 0, None
    shares = np.linspace(0.0, 1.0, steps)[1:-1, None]
    for path, row in zip(paths, rows, strict=True):
        # the elementwise test of numpy.allclose, without its overhead
        if last is not None and not (np.abs(last - path[0]) <= 1e-8 + 1e-5 * np.abs(path[0])).all():
            pieces.append(last + shares * (path[0] - last))
            length += steps - 2
        pieces.append(path)
        index.append(length + row)
        length, last = length + len(path), path[-1]
    return np.concatenate(pieces), np.concatenate(index)


def make_run(
    trajectory: Trajectory, speed_mm_s: float, acceleration_mm_s2: float, payload_kg: float = 0.0, reverse: bool = False
) -> Run:
    """One pass along a trajectory, forward or in reverse, with the trapezoidal profile over its arc length."""
    from scipy.interpolate import CubicSpline

    shares = _CURVE_SHARES[::-1] if reverse else _CURVE_SHARES
    curve = CubicSpline(_CURVE_SHARES, trajectory.curve(shares))
    arc = CubicSpline(_CURVE_SHARES, np.linalg.norm(curve(_CURVE_SHARES, 1), axis=1)).antiderivative()
    profile = Trapezoid(float(arc(1.0)), speed_mm_s, acceleration_mm_s2)
    at = np.linspace(0.0, 1.0, trajectory.count)
    path_shares = np.linspace(0.0, 1.0, (trajectory.count - 1) * _PATH_STEPS + 1)
    time = profile.time(arc(at))
    speed, along = profile.speed(time)[:, None], profile.acceleration(time)[:, None]
    first, second = curve(at, 1), curve(at, 2)
    stretch = np.linalg.norm(first, axis=1, keepdims=True)
    tangent = first / stretch
    curvature = (second - (second * tangent).sum(axis=1, keepdims=True) * tangent) / stretch**2
    return Run(
        trajectory=trajectory.name,
        points_mm=sample(trajectory)[::-1] if reverse else sample(trajectory),
        path_mm=trajectory.curve(1.0 - path_shares if reverse else path_shares),
        path_index=np.arange(trajectory.count) * _PATH_STEPS,
        time_s=time,
        velocity_mm_s=speed * tangent,
        acceleration_mm_s2=along * tangent + speed**2 * curvature,
        speed_mm_s=speed_mm_s,
        payload_kg=payload_kg,
    )


def make_plan(
    trajectories: Sequence[Trajectory],
    passes: Iterable[Mapping[str, Any]],
    speed_mm_s: float,
    acceleration_mm_s2: float,
    dwell_s: float,
) -> Plan:
    """Plan of a campaign: every pass drives its trajectories one after another.

    passes: mappings with the keys `reverse`, `speed_mm_s` and `acceleration_mm_s2` (absent: the campaign's),
    `payload_kg` and `trajectories` (absent: all).
    """
    by_name = {trajectory.name: trajectory for trajectory in trajectories}
    runs = []
    for entry in passes:
        for name in entry.get("trajectories", list(by_name)):
            speed = entry.get("speed_mm_s", speed_mm_s)
            acceleration = entry.get("acceleration_mm_s2", acceleration_mm_s2)
            runs.append(make_run(by_name[name], speed, acceleration, entry["payload_kg"], entry["reverse"]))
    return Plan(tuple(runs), dwell_s)
