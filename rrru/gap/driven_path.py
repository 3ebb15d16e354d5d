"""The motion behind a measurement table, as far as its columns tell: what the effects' laws are evaluated on. Lengths
mm, angles rad.
"""

from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline, make_interp_spline

from rrru.campaign import measurements as rows
from rrru.effects.motion import Course, make_motion

# points of the path between two commanded ones, and along a transfer between runs
_STEPS, _TRANSFER_STEPS = 8, 30
# an interval at a run's end that is this much slower than the next leads to rest
_SLOWER = 0.9
# nearer than this to a turning point the interpolated path may be on the wrong side of it
_TURN = {"rad": 3e-4, "mm": 0.1}


def motion_of(measurements, mechanism, masses):
    """Motion at the n rows of a measurement table, all of them in the order driven.

    # ASSUME the robot passes smoothly through a run's commanded points, rests where it slows down at an end, and goes
    straight to the next run. Speeds and accelerations come from the times; where a run has no increasing times they are
    NaN.
    """
    position, drive = rows.command(measurements), rows.actuators(measurements)
    run = measurements["run"].to_numpy()
    time = measurements["time_s"].to_numpy(dtype=float)
    velocity, acceleration = np.full_like(position, np.nan), np.full_like(position, np.nan)
    pieces, index, length, last = [], [], 0, None
    edges = [*np.flatnonzero(starts_of_runs(run)), len(run)]
    for first, end in pairwise(edges):
        points = position[first:end]
        velocity[first:end], acceleration[first:end] = _derivatives(points, time[first:end])
        path, at = _path(points)
        if last is not None:
            transfer = last + np.linspace(0.0, 1.0, _TRANSFER_STEPS)[1:-1, None] * (points[0] - last)
            pieces.append(transfer)
            length += len(transfer)
        pieces.append(path)
        index.append(length + at)
        length += len(path)
        last = points[-1]
    path_drive = _known(mechanism.inverse(np.concatenate(pieces)))
    index = np.concatenate(index)
    # the file's own values stand where it has them
    path_drive[index] = drive
    payload = measurements["payload_kg"].to_numpy(dtype=float)
    course = Course(position, drive, path_drive, index, time, velocity, acceleration, payload)
    return make_motion(mechanism, masses, course)


def at_turn_back(motion, drive_unit):
    """Rows (n,) at which a drive turns back: whether it is on its way up or down there the commanded points alone do
    not tell.
    """
    path, result = motion.path_drive, np.zeros(len(motion.drive), dtype=bool)
    for leg in range(3):
        step = np.diff(path[:, leg])
        turns = np.flatnonzero(step[:-1] * step[1:] < 0.0) + 1
        if len(turns):
            nearest = turns[np.abs(turns[:, None] - motion.path_index).argmin(axis=0)]
            close = np.abs(nearest - motion.path_index) <= _STEPS
            result |= close & (np.abs(path[nearest, leg] - motion.drive[:, leg]) < _TURN[drive_unit])
    return result


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
    spline = CubicSpline(time, points, bc_type=tuple("clamped" if here else "not-a-knot" for here in rest))
    acceleration = spline(time, 2)
    for end, here in zip((0, -1), rest, strict=True):
        if here:
            acceleration[end] = 0.0
    return spline(time, 1), acceleration


def _path(points):
    """Points (N, 3) of a smooth path through the points (k, 3) of one run and the rows (k,) of these in it."""
    at = np.arange(len(points)) * _STEPS
    if len(points) == 1:
        return points, at
    chord = np.linalg.norm(np.diff(points, axis=0), axis=1)
    # points of no distance still follow one another
    length = np.concatenate([[0.0], np.cumsum(np.maximum(chord, 1e-6 * max(chord.max(), 1e-6)))])
    fine = np.interp(np.arange(at[-1] + 1), at, length)
    if len(points) == 2:
        return points[0] + (fine / length[-1])[:, None] * (points[1] - points[0]), at
    # of fifth degree, since where a drive turns back has to be known to a fraction of its play
    return make_interp_spline(length, points, k=min(5, len(points) - 1 - len(points) % 2))(fine), at


def _known(drive):
    """The actuator values (N, 3) with those of unreachable points taken from the last reachable one before."""
    bad = ~np.isfinite(drive).all(axis=1)
    if bad.any():
        good = np.flatnonzero(~bad)
        nearest = good[np.maximum(np.searchsorted(good, np.arange(len(drive)), side="right") - 1, 0)]
        drive = drive[nearest]
    return drive
