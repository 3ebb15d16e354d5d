"""The path behind a measurement table, as far as its columns tell. Lengths in mm, times in s."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline, make_interp_spline

from rrru.campaign import measurements as rows

# points of the path from one commanded point to the next, and of a transfer between runs
STEPS, _TRANSFER_POINTS = 8, 28
# an interval at a run's end that is this much slower than the next leads to rest
_SLOWER = 0.9


@dataclass(frozen=True)
class DrivenPath:
    """What a robot was told to do at n points, in the order driven, and on the way between them; NaN where unknown.

    position_mm, velocity_mm_s, acceleration_mm_s2: (n, 3); time_s, payload_kg: (n,); path_mm (N, 3): everything that is
    driven, transfers included, with the n points in its rows path_index.
    """

    position_mm: np.ndarray
    velocity_mm_s: np.ndarray
    acceleration_mm_s2: np.ndarray
    time_s: np.ndarray
    payload_kg: np.ndarray
    path_mm: np.ndarray
    path_index: np.ndarray


def joined(paths, indices, transfer_points):
    """Points (N, 3) of runs' paths, one after another, and the rows (n,) of their sampled points; indices: per run.

    # ASSUME the robot goes straight from the end of a run to the start of the next, by so many points in between.
    """
    pieces, rows_of, length = [], [], 0
    share = np.linspace(0.0, 1.0, transfer_points + 2)[1:-1, None]
    for path, index in zip(paths, indices, strict=True):
        if pieces:
            last = pieces[-1][-1]
            pieces.append(last + share * (path[0] - last))
            length += transfer_points
        pieces.append(path)
        rows_of.append(length + index)
        length += len(path)
    return np.concatenate(pieces), np.concatenate(rows_of)


def driven_path(measurements):
    """The path driven at the n rows of a measurement table, all of them in the order driven.

    # ASSUME the robot passes smoothly through a run's commanded points and rests where it slows down at an end. Speeds
    and accelerations come from the times; where a run has no increasing times they are NaN.
    """
    position = rows.command(measurements)
    time, payload = (measurements[name].to_numpy(dtype=float) for name in ("time_s", "payload_kg"))
    run = measurements["run"].to_numpy()
    pieces = [slice(*ends) for ends in pairwise([*np.flatnonzero(starts_of_runs(run)), len(run)])]
    derivatives = [_derivatives(position[piece], time[piece]) for piece in pieces]
    velocity, acceleration = (np.concatenate(parts) for parts in zip(*derivatives, strict=True))
    path, index = joined(*zip(*(_smooth(position[piece]) for piece in pieces), strict=True), _TRANSFER_POINTS)
    return DrivenPath(position, velocity, acceleration, time, payload, path, index)


def starts_of_runs(run):
    """Rows (m,) that begin a run, from the rows' run numbers (m,)."""
    return np.concatenate([[True], np.diff(run) != 0])


def _derivatives(points, time):
    """Velocity and acceleration (k, 3) along the points of one run, NaN without increasing times.

    An end is one of rest where the robot slows down towards it; else the recording stopped or began on the way.
    """
    nothing = np.full_like(points, np.nan)
    if len(points) < 3 or not np.isfinite(time).all() or not (np.diff(time) > 0.0).all():
        return nothing, nothing
    speed = np.linalg.norm(np.diff(points, axis=0), axis=1) / np.diff(time)
    rest = (speed[0] < _SLOWER * speed[1], speed[-1] < _SLOWER * speed[-2])
    spline = CubicSpline(time, points, bc_type=tuple("clamped" if still else "not-a-knot" for still in rest))
    acceleration = spline(time, 2)
    acceleration[[end for end, still in zip((0, -1), rest, strict=True) if still]] = 0.0
    return spline(time, 1), acceleration


def _smooth(points):
    """Points (N, 3) of a smooth path through the points (k, 3) of one run and the rows (k,) of these in it."""
    at = np.arange(len(points)) * STEPS
    if len(points) == 1:
        return points, at
    chord = np.linalg.norm(np.diff(points, axis=0), axis=1)
    # points of no distance still follow one another
    length = np.concatenate([[0.0], np.cumsum(np.maximum(chord, 1e-6 * max(chord.max(), 1e-6)))])
    fine = np.interp(np.arange(at[-1] + 1), at, length)
    if len(points) == 2:
        return points[0] + (fine / length[-1])[:, None] * (points[1] - points[0]), at
    # of fifth degree, since where a drive turns back has to be known to a fraction of its play
    path = make_interp_spline(length, points, k=min(5, len(points) - 1 - len(points) % 2))(fine)
    path[at] = points
    return path, at
