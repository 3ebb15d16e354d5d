"""The path behind a measurement table, as far as its columns determine it. Lengths in mm, times in s."""

from itertools import pairwise
from typing import TypeAlias

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.campaign.plan import connect
from rrru.campaign.stated_motion import rests, stated_motion

# points of the path from one commanded point to the next, and of a transfer between runs with its ends
STEPS, _TRANSFER_STEPS = 8, 30
# of splines through points: where a drive turns back has to be known to a fraction of its backlash
DEGREE = 5
# of the drives where the tool hardly moves, both in shares of their extents
_DRIVES_WAY = 0.1
# a path turns by more than a right angle at fewer of its points than this; poses in random order do so at three of four
_MOST_TURNS = 0.5
# the commanded course by name, see `_path_through`
Course: TypeAlias = dict[str, np.ndarray]

# a bend above the first limit next to a bend below the second is a corner, in rad
_CORNER, _STRAIGHT = 0.2, 0.02
# an interval at a run's end or a corner that is this much slower than the next leads to rest
_SLOWER = 0.9
# ASSUME a robot that rests at each reading and moves by less than this, in mm and rad, has not moved: its drive values
# are read back at each reading, with some noise
_STILL_MM, _STILL_RAD = 0.05, 5e-4


def driven_path(measurements: pd.DataFrame, degree: int = DEGREE) -> tuple[np.ndarray, Course]:
    """`_path_through` the rows of a measurement table; several reflectors measured at one pose are one stop."""
    stop = stops(measurements)
    path, course = _path_through(measurements[_first_rows(stop)], degree)
    return path, {name: values[stop] for name, values in course.items()}


def drive_rates(measurements: pd.DataFrame, actuators: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives (n, K) by the time, first and second, of actuator values (n, K) as `rates` of each stop has them."""
    stop = stops(measurements)
    first = _first_rows(stop)
    return tuple(values[stop] for values in rates(measurements[first], actuators[first]))


def smooth_drives(
    measurements: pd.DataFrame, path: np.ndarray, path_index: np.ndarray, degree: int = DEGREE
) -> np.ndarray:
    """Actuator values (N, K) along the path of `driven_path`: in each run a spline through the measured points.

    path (N, K): their values from run to run, and where the points follow no path; path_index (n,): its rows at the
    points; degree: odd, of the splines.

    # ASSUME where the tool passes smoothly through a run's points, its drives do so, too.
    """
    if not passes_points(measurements):
        return path
    first = _first_rows(stops(measurements))
    index, run, result = path_index[first], measurements["run"].to_numpy()[first], path.copy()
    tool, drives = rows.command(measurements)[first], path[index]
    reach, span = np.ptp(tool, axis=0).max(), np.ptp(drives, axis=0)
    # a tool that only turns has no way, but its drives have one
    turned = _chords(drives / np.where(span > 0.0, span, 1.0))
    way = np.maximum(_chords(tool), _DRIVES_WAY * reach * turned)
    for piece in _runs(run):
        smooth, _ = _through(drives[piece], way[piece.start : piece.stop - 1], _corners(tool[piece]), degree)
        result[index[piece][0] : index[piece][-1] + 1] = smooth
    return result


def stops(measurements: pd.DataFrame) -> np.ndarray:
    """Number (n,) from 0 on of the stop at which each row was measured: several reflectors may be seen at one.

    Rows at one command are one stop, too, where the campaign states that the robot rests at each reading.
    """
    at_rest = rests(measurements)
    if "target" not in measurements and not at_rest:
        return np.arange(len(measurements))
    names = [name for name in measurements if name.startswith("command_")]
    still = np.array([_STILL_MM if name.endswith("_mm") else _STILL_RAD for name in names]) if at_rest else 0.0
    commanded, run = np.nan_to_num(measurements[names].to_numpy(dtype=float)), measurements["run"].to_numpy()
    moved = (np.abs(np.diff(commanded, axis=0)) > still).any(axis=1) | (np.diff(run) != 0)
    return np.cumsum(np.concatenate([[False], moved]))


def _first_rows(stop: np.ndarray) -> np.ndarray:
    """Which rows (n,) are the first ones of their stops (n,)."""
    return np.diff(stop, prepend=-1) > 0


def _path_through(measurements: pd.DataFrame, degree: int) -> tuple[np.ndarray, Course]:
    """The path (N, 3) of everything that is driven, transfers included, and what the robot was commanded to do on it.

    degree: odd, of the splines through a run's points. The commanded course is by name, of the n rows of a measurement
    table in the order driven: position_mm, velocity_mm_s, acceleration_mm_s2 (n, 3), time_s, payload_kg, temperature_c
    and path_index, their rows of the path (n,); NaN where unknown.

    # ASSUME the robot passes smoothly through a run's commanded points, except at corners between straight parts. It
    rests where it slows down towards an end or a corner. Speeds and accelerations come from the times; where a run has
    no increasing times, or its points follow no path, they are NaN.
    """
    position, run = rows.command(measurements), measurements["run"].to_numpy()
    named = measurements.reindex(columns=("time_s", "payload_kg", "temperature_c"))
    course = {name: named[name].to_numpy(dtype=float) for name in named}
    pieces = _runs(run)
    velocity, acceleration = rates(measurements, position)
    parts = [position[piece] for piece in pieces]
    smooth = [_through(part, _chords(part), _corners(part), degree) for part in parts]
    path, index = connect([points for points, _ in smooth], [at for _, at in smooth], _TRANSFER_STEPS)
    course |= {"position_mm": position, "velocity_mm_s": velocity, "acceleration_mm_s2": acceleration}
    return path, course | {"path_index": index}


def rates(measurements: pd.DataFrame, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First and second derivative (n, k) by the time of values (n, k) at the rows of a measurement table, run by run.

    Zero where the campaign states that the robot rests at each reading; NaN where a run has no increasing times or it
    is not known to pass its points.
    """
    run, time = measurements["run"].to_numpy(), measurements["time_s"].to_numpy(dtype=float)
    position = rows.command(measurements)
    if rests(measurements):
        return np.zeros_like(values), np.zeros_like(values)
    if not passes_points(measurements):
        return np.full_like(values, np.nan), np.full_like(values, np.nan)
    derivatives = [_run_rates(values[piece], time[piece], _corners(position[piece])) for piece in _runs(run)]
    first, second = zip(*derivatives, strict=True)
    return np.concatenate(first), np.concatenate(second)


def passes_points(measurements: pd.DataFrame) -> bool:
    """Whether the robot passes the rows of a measurement table without a stop: as stated, else by `follows_path`."""
    stated = stated_motion(measurements)
    if stated is not None:
        return not stated.stops
    return follows_path(rows.command(measurements), measurements["run"].to_numpy())


def follows_path(position_mm: np.ndarray, run: np.ndarray) -> bool:
    """Whether positions (n, 3) in runs (n,) are along paths; otherwise each is a stop, reached from the one before."""
    moved = np.concatenate([[True], (np.diff(position_mm, axis=0) != 0.0).any(axis=1)])
    position_mm, run = position_mm[moved], np.asarray(run)[moved]
    step, same = np.diff(position_mm, axis=0), run[1:] == run[:-1]
    turns = (np.einsum("na,na->n", step[1:], step[:-1]) < 0.0)[same[1:] & same[:-1]]
    return not len(turns) or turns.mean() <= _MOST_TURNS


def _runs(run: np.ndarray) -> list[slice]:
    """Slices of the rows of each run, from the rows' run numbers (n,)."""
    return [slice(*ends) for ends in pairwise([*np.flatnonzero(starts_of_runs(run)), len(run)])]


def starts_of_runs(run: np.ndarray) -> np.ndarray:
    """Rows (m,) that begin a run, from the rows' run numbers (m,)."""
    return np.concatenate([[True], np.diff(run) != 0])


def _corners(position_mm: np.ndarray) -> np.ndarray:
    """Points (c,) of the path (k, 3) of one run at which it has a corner, after its first and before its last point.

    # ASSUME a path that is straight at three points is straight between them, and a bend next to it is a corner. One
    smooth curve through both would oscillate about the straight part, and drives that hold there would turn back.
    """
    moved = np.flatnonzero(np.concatenate([[True], _chords(position_mm) > 0.0]))
    step = np.diff(position_mm[moved], axis=0)
    if len(step) < 3:
        return np.zeros(0, dtype=int)
    step /= np.linalg.norm(step, axis=1)[:, None]
    bend = 2.0 * np.arcsin(np.clip(0.5 * np.linalg.norm(np.diff(step, axis=0), axis=1), 0.0, 1.0))
    # the bend beyond an end is unknown
    next_to_straight = (np.array([np.inf, *bend[:-1]]) < _STRAIGHT) | (np.array([*bend[1:], np.inf]) < _STRAIGHT)
    return np.asarray(moved[1:-1][(bend > _CORNER) & next_to_straight])


def _run_rates(values: np.ndarray, time: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`_derivatives` of values (k, j) of one run at times (k,); at corners (c,) the mean of those of both sides."""
    result = np.full((2, *values.shape), np.nan)
    for first, last in pairwise([0, *corners, len(values) - 1]):
        piece = slice(first, last + 1)
        before, after = result[:, piece].copy(), np.array(_derivatives(values[piece], time[piece]))
        mean = np.where(np.isnan(after), before, 0.5 * (before + after))
        result[:, piece] = np.where(np.isnan(before), after, mean)
    return tuple(result)


def _derivatives(points: np.ndarray, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First and second derivative (k, j) along the points (k, j) of a run or a part of it.

    NaN without increasing times. An end is one of rest where the robot slows down towards it; else the recording
    stopped or began on the way.
    """
    from scipy.interpolate import CubicSpline

    nothing = np.full_like(points, np.nan)
    if len(points) < 3 or not np.isfinite(time).all() or not (np.diff(time) > 0.0).all():
        return nothing, nothing
    speed = np.linalg.norm(np.diff(points, axis=0), axis=1) / np.diff(time)
    at_rest = (speed[0] < _SLOWER * speed[1], speed[-1] < _SLOWER * speed[-2])
    spline = CubicSpline(time, points, bc_type=tuple("clamped" if still else "not-a-knot" for still in at_rest))
    acceleration = spline(time, 2)
    acceleration[[end for end, still in zip((0, -1), at_rest, strict=True) if still]] = 0.0
    return spline(time, 1), acceleration


def _chords(points: np.ndarray) -> np.ndarray:
    """Distances (k - 1,) from each of points (k, j) to the next."""
    return np.asarray(np.linalg.norm(np.diff(points, axis=0), axis=1))


def _through(points: np.ndarray, way: np.ndarray, corners: np.ndarray, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, j) of a path through the points (k, j) of one run, smooth from corner to corner (c,) of them, and the
    rows (k,) of these in it.

    way (k - 1,): how far it is from each to the next.
    """
    parts = [_smooth(points[a : b + 1], way[a:b], degree) for a, b in pairwise([0, *corners, len(points) - 1])]
    path = np.concatenate([parts[0], *(part[1:] for part in parts[1:])])
    return path, np.arange(len(points)) * STEPS


def _smooth(points: np.ndarray, way: np.ndarray, degree: int) -> np.ndarray:
    """Points (N, j) of a smooth path through points (k, j), way (k - 1,) apart."""
    from scipy.interpolate import make_interp_spline

    at = np.arange(len(points)) * STEPS
    if len(points) == 1:
        return points
    # points of no distance still follow one another
    length = np.concatenate([[0.0], np.cumsum(np.maximum(way, 1e-6 * max(way.max(), 1e-6)))])
    fine = np.interp(np.arange(at[-1] + 1), at, length)
    if len(points) == 2:
        return np.asarray(points[0] + (fine / length[-1])[:, None] * (points[1] - points[0]))
    path = make_interp_spline(length, points, k=min(degree, len(points) - 1 - len(points) % 2))(fine)
    path[at] = points
    return np.asarray(path)
