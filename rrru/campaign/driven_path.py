"""The path behind a measurement table, as far as its columns determine it. Lengths in mm, times in s."""

from collections.abc import Iterator
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
# decimals of the shares of a run's way, far below what a drive resolves
_DIGITS_OF_SHARES = 12
# ASSUME a robot that rests at each reading and moves by less than this, in mm and rad, has not moved: its drive values
# are read back at each reading, with some noise
_STILL_MM, _STILL_RAD = 0.05, 5e-4


def driven_path(measurements: pd.DataFrame, degree: int = DEGREE) -> tuple[np.ndarray, Course]:
    """`_path_through` the rows of a measurement table; several reflectors measured at one pose are one stop."""
    stop = stops(measurements)
    at_stops = measurements[_first_rows(stop)]
    path, index = _path_through(at_stops, degree)
    course = _commanded(at_stops) | {"path_index": index}
    return path, {name: values[stop] for name, values in course.items()}


def path_through(measurements: pd.DataFrame, degree: int = DEGREE) -> np.ndarray:
    """The path (N, 3) of `driven_path` alone."""
    return _path_through(measurements[_first_rows(stops(measurements))], degree)[0]


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
    pieces = _runs(run)
    for piece, smooth in zip(pieces, _through_runs(drives, way, pieces, _corners(tool, run), degree), strict=True):
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


def _path_through(measurements: pd.DataFrame, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """The path (N, 3) of everything that is driven, transfers included, and its rows (n,) at those of the table.

    degree: odd, of the splines through a run's points.

    # ASSUME the robot passes smoothly through a run's commanded points, except at corners between straight parts.
    """
    position, run = rows.command(measurements), measurements["run"].to_numpy()
    pieces, way = _runs(run), _chords(position)
    smooth = _through_runs(position, way, pieces, _corners(position, run), degree)
    return connect(smooth, [np.arange(piece.stop - piece.start) * STEPS for piece in pieces], _TRANSFER_STEPS)


def _commanded(measurements: pd.DataFrame) -> Course:
    """What the robot was commanded to do at the n rows of a measurement table in the order driven.

    By name: position_mm, velocity_mm_s, acceleration_mm_s2 (n, 3), time_s, payload_kg, temperature_c; NaN where
    unknown.

    # ASSUME the robot rests where it slows down towards an end or a corner. Speeds and accelerations come from the
    times; where a run has no increasing times, or its points follow no path, they are NaN.
    """
    position = rows.command(measurements)
    named = measurements.reindex(columns=("time_s", "payload_kg", "temperature_c"))
    course = {name: named[name].to_numpy(dtype=float) for name in named}
    velocity, acceleration = rates(measurements, position)
    return course | {"position_mm": position, "velocity_mm_s": velocity, "acceleration_mm_s2": acceleration}


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
    corners = _corners(position, run)
    result = np.full((2, *values.shape), np.nan)
    parts = [part for piece in _runs(run) for part in _parts(piece, corners)]
    for times, index in _alike(parts, [time[part] for part in parts]):
        before, after = result[:, index], np.array(_derivatives(values[index], times))
        # at a corner, where two parts meet, the mean of both sides
        mean = np.where(np.isnan(after), before, 0.5 * (before + after))
        result[:, index] = np.where(np.isnan(before), after, mean)
    return result[0], result[1]


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


def _corners(position_mm: np.ndarray, run: np.ndarray) -> np.ndarray:
    """Rows (c,) of a path (n, 3) in runs (n,) at which it has a corner, after a run's first and before its last row.

    # ASSUME a path that is straight at three points is straight between them, and a bend next to it is a corner. One
    smooth curve through both would oscillate about the straight part, and drives that hold there would turn back.
    """
    moved = np.flatnonzero(starts_of_runs(run) | np.concatenate([[True], _chords(position_mm) > 0.0]))
    if len(moved) < 4:
        return np.zeros(0, dtype=int)
    run = run[moved]
    step, same = np.diff(position_mm[moved], axis=0), run[1:] == run[:-1]
    step /= np.maximum(_lengths(step), 1e-300)[:, None]
    bend = 2.0 * np.arcsin(np.clip(0.5 * _lengths(np.diff(step, axis=0)), 0.0, 1.0))
    # at a run's ends, and beyond them, the bend is unknown
    within = np.concatenate([[False], same[:-1] & same[1:], [False]])
    bend = np.where(within, np.concatenate([[np.inf], bend, [np.inf]]), np.inf)
    straight = np.concatenate([[False], bend < _STRAIGHT, [False]])
    return np.asarray(moved[within & (bend > _CORNER) & (straight[:-2] | straight[2:])])


def _parts(piece: slice, corners: np.ndarray) -> list[slice]:
    """Slices of a run's rows from corner to corner (c,); two that meet at a corner both have its row."""
    first, last = np.searchsorted(corners, (piece.start, piece.stop))
    return [slice(a, b + 1) for a, b in pairwise([piece.start, *corners[first:last].tolist(), piece.stop - 1])]


def _alike(parts: list[slice], keys: list[np.ndarray]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Each different key (k,) and the rows (r, k) of the parts that have it: one spline serves all of them."""
    groups: dict[bytes, tuple[np.ndarray, list[np.ndarray]]] = {}
    for part, key in zip(parts, keys, strict=True):
        groups.setdefault(key.tobytes(), (key, []))[1].append(np.arange(part.start, part.stop))
    for key, index in groups.values():
        yield key, np.stack(index)


def _derivatives(points: np.ndarray, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First and second derivative (r, k, j) along the points (r, k, j) of r runs, or parts of them, at times (k,).

    NaN without increasing times. An end is one of rest where the robot slows down towards it; else the recording
    stopped or began on the way.
    """
    from scipy.interpolate import CubicSpline

    first, second = np.full_like(points, np.nan), np.full_like(points, np.nan)
    if len(time) < 3 or not np.isfinite(time).all() or not (np.diff(time) > 0.0).all():
        return first, second
    speed = _lengths(np.diff(points, axis=1)) / np.diff(time)
    at_rest = np.stack([speed[:, 0] < _SLOWER * speed[:, 1], speed[:, -1] < _SLOWER * speed[:, -2]], axis=1)
    for ends in np.unique(at_rest, axis=0):
        alike = (at_rest == ends).all(axis=1)
        kinds = tuple("clamped" if still else "not-a-knot" for still in ends)
        spline = CubicSpline(time, points[alike], axis=1, bc_type=kinds)
        first[alike], acceleration = spline(time, 1), spline(time, 2)
        acceleration[:, [end for end, still in zip((0, -1), ends, strict=True) if still]] = 0.0
        second[alike] = acceleration
    return first, second


def _lengths(vectors: np.ndarray) -> np.ndarray:
    """Lengths (..) of vectors (.., j)."""
    return np.asarray(np.sqrt(np.einsum("...j,...j->...", vectors, vectors)))


def _chords(points: np.ndarray) -> np.ndarray:
    """Distances (k - 1,) from each of points (k, j) to the next."""
    return np.asarray(np.linalg.norm(np.diff(points, axis=0), axis=1))


def _through_runs(
    points: np.ndarray, way: np.ndarray, pieces: list[slice], corners: np.ndarray, degree: int
) -> list[np.ndarray]:
    """Paths (N, j) through points (n, j) of each run, smooth from corner to corner (c,).

    way (n - 1,): how far it is from each to the next.
    """
    of_runs = [_parts(piece, corners) for piece in pieces]
    parts = [part for of_run in of_runs for part in of_run]
    smooth: dict[int, np.ndarray] = {}
    for shares, index in _alike(parts, [_shares(way[part.start : part.stop - 1]) for part in parts]):
        smooth |= zip(index[:, 0].tolist(), _smooth(points[index], shares, degree), strict=True)
    # the row of a corner is the last of one part and the first of the next
    return [
        np.concatenate([smooth[first.start], *(smooth[part.start][1:] for part in more)]) for first, *more in of_runs
    ]


def _shares(way: np.ndarray) -> np.ndarray:
    """Shares (k,) of the whole way at k points, way (k - 1,) apart.

    They are rounded, so that passes of equal steps have equal shares.
    """
    # points of no distance still follow one another
    length = np.concatenate([[0.0], np.cumsum(np.maximum(way, 1e-6 * max(way.max(initial=0.0), 1e-6)))])
    return np.asarray(np.round(length / max(length[-1], 1e-300), _DIGITS_OF_SHARES))


def _smooth(points: np.ndarray, shares: np.ndarray, degree: int) -> np.ndarray:
    """Points (r, N, j) of smooth paths through points (r, k, j) at shares (k,) of their ways."""
    from scipy.interpolate import make_interp_spline

    count = len(shares)
    at = np.arange(count) * STEPS
    if count == 1:
        return points
    fine = np.interp(np.arange(at[-1] + 1), at, shares)
    if count == 2:
        return np.asarray(points[:, :1] + fine[:, None] * (points[:, 1:] - points[:, :1]))
    path = make_interp_spline(shares, points, k=min(degree, count - 1 - count % 2), axis=1)(fine)
    path[:, at] = points
    return np.asarray(path)
