"""Paths with corners inside a run: rectangles, zigzags, there and back, and smooth paths that have none."""

from itertools import pairwise

import numpy as np
import pandas as pd
import pytest

from rrru.campaign.driven_path import STEPS, driven_path, smooth_drives

_AROUND = np.array([[0.0, 0.0], [300.0, 0.0], [300.0, 200.0], [0.0, 200.0], [0.0, 0.0]])


def _along(ends, count):
    """Points (n, 3) evenly along straight lines through ends (k, 2 or 3), `count` steps each."""
    ends = np.pad(ends, [(0, 0), (0, 3 - np.shape(ends)[1])], constant_values=400.0)
    share = np.arange(count)[:, None] / count
    return np.concatenate([*(a + share * (b - a) for a, b in pairwise(ends)), ends[-1:]])


def _table(command, time=np.nan):
    """A measurement table of one run."""
    columns = {f"command_{axis}_mm": column for axis, column in zip("xyz", command.T, strict=True)}
    return pd.DataFrame(columns | {"run": 1, "time_s": time})


def _farthest_from_lines(path, command):
    """Largest distance in mm of a path (N, 3) from the straight lines between the commanded points."""
    lines = np.concatenate([_along(pair, 200) for pair in pairwise(command)])
    return max(np.linalg.norm(lines - point, axis=1).min() for point in path)


@pytest.mark.parametrize("degree", [3, 5, 7])
@pytest.mark.parametrize("count", [2, 3, 12])
@pytest.mark.parametrize("turned", [0.0, 0.7])
def test_a_rectangle_driven_in_one_run_stays_a_rectangle(degree, count, turned):
    turn = np.array([[np.cos(turned), -np.sin(turned)], [np.sin(turned), np.cos(turned)]])
    command = _along(_AROUND @ turn.T, count)
    path, course = driven_path(_table(command), degree)
    np.testing.assert_array_equal(path[course["path_index"]], command)
    assert _farthest_from_lines(path, command) < 1.0
    # a drive along one side stands still on the next one
    if not turned:
        side = slice(count * STEPS, 2 * count * STEPS + 1)
        np.testing.assert_allclose(path[side, 0], 300.0, atol=1e-9)


@pytest.mark.parametrize("degree", [3, 5, 7])
@pytest.mark.parametrize("count", [2, 9])
def test_rows_driven_to_and_fro_in_one_run_stay_rows(degree, count):
    """A grid of rows: from one to the next it is a single step."""
    rows = [_along([[0.0, y], [300.0, y]], count)[:: 1 - 2 * (k % 2)] for k, y in enumerate((0.0, 40.0, 80.0, 120.0))]
    command = np.concatenate(rows)
    path, course = driven_path(_table(command), degree)
    np.testing.assert_array_equal(path[course["path_index"]], command)
    assert _farthest_from_lines(path, command) < 1.0
    # what drives along y stands still in every row
    along = slice((count + 1) * STEPS, (2 * count + 1) * STEPS + 1)
    np.testing.assert_allclose(path[along, 1], 40.0, atol=1e-9)


def test_a_path_of_sharp_turns_alone_tells_of_no_corner():
    """Four points of which no three lie on a line may be of any path."""
    command = np.array([[0.0, 0.0, 400.0], [100.0, 0.0, 400.0], [100.0, 100.0, 400.0], [0.0, 100.0, 400.0]])
    path, _ = driven_path(_table(command))
    assert _farthest_from_lines(path, command) > 5.0


def test_there_and_back_in_one_run_turns_at_the_tip():
    command = _along([[0.0, 0.0], [250.0, 100.0], [0.0, 0.0]], 10)
    path, _ = driven_path(_table(command))
    np.testing.assert_allclose(path[10 * STEPS :], path[: 10 * STEPS + 1][::-1], atol=1e-9)
    assert path[:, 0].max() == pytest.approx(250.0)


def test_a_stop_of_several_readings_at_a_corner_changes_nothing():
    command = _along(_AROUND, 8)
    twice = np.insert(command, 9, command[8], axis=0)
    path, _ = driven_path(_table(twice))
    assert _farthest_from_lines(path, command) < 0.1


@pytest.mark.parametrize("count", [9, 13, 25, 60])
def test_a_smooth_path_has_no_corner(count):
    angle = np.linspace(0.0, 2.0 * np.pi, count)
    circle = np.stack([100.0 * np.cos(angle), 100.0 * np.sin(angle), 0.0 * angle], axis=1)
    path, _ = driven_path(_table(circle))
    radius = np.linalg.norm(path[:, :2], axis=1)
    assert np.abs(radius - 100.0).max() < (1.5 if count == 9 else 0.5)


@pytest.mark.parametrize("steps", [1, 2, 3, 4, 6, 8])
def test_straight_parts_before_and_after_an_arc_stay_straight(steps):
    """A quarter of a circle of so many steps of 50 mm between straight parts."""
    radius = 50.0 * steps / (np.pi / 2.0)
    way = 50.0 * np.arange(1, 9)
    angle = np.linspace(0.0, np.pi / 2.0, steps + 1)
    parts = (
        np.stack([np.full(8, radius), -way[::-1]], axis=1),
        radius * np.stack([np.cos(angle), np.sin(angle)], axis=1),
        np.stack([-way, np.full(8, radius)], axis=1),
    )
    command = np.pad(np.concatenate(parts), [(0, 0), (0, 1)])
    path, course = driven_path(_table(command))
    first, last = course["path_index"][[7, -8]]
    np.testing.assert_allclose(path[: first + 1, 0], radius, atol=0.15)
    np.testing.assert_allclose(path[last:, 1], radius, atol=0.15)
    # an arc of one step is its chord
    off = np.abs(np.linalg.norm(path[first + STEPS : last - STEPS, :2], axis=1) - radius)
    assert off.max(initial=0.0) < {1: 10.0, 2: 5.0}.get(steps, 0.5)


@pytest.mark.parametrize("cut", [0.1, 0.3, 0.5])
def test_a_corner_that_no_point_lies_at_leaves_the_sides_straight(cut):
    side = 40.0 * np.arange(10)
    first = np.stack([side - side[-1] - cut * 40.0, 0.0 * side], axis=1)
    second = np.stack([0.0 * side, side + (1.0 - cut) * 40.0], axis=1)
    path, course = driven_path(_table(np.pad(np.concatenate([first, second]), [(0, 0), (0, 1)])))
    last, begin = course["path_index"][[9, 10]]
    np.testing.assert_allclose(path[: last + 1, 1], 0.0, atol=0.15)
    np.testing.assert_allclose(path[begin:, 0], 0.0, atol=0.15)


def test_speeds_at_a_corner_where_the_robot_rests_are_those_of_rest():
    command = _along(_AROUND[:3], 10)
    # each side is driven from rest to rest: way (1 - cos) / 2
    share = np.linspace(0.0, np.pi, 11)
    side = 0.5 * (1.0 - np.cos(share))
    first = np.outer(side, command[10] - command[0]) + command[0]
    second = np.outer(side, command[20] - command[10]) + command[10]
    command = np.concatenate([first, second[1:]])
    time = np.concatenate([share, np.pi + share[1:]])
    _, course = driven_path(_table(command, time))
    speed = np.linalg.norm(course["velocity_mm_s"], axis=1)
    expected = np.concatenate([300.0 * np.sin(share), 200.0 * np.sin(share[1:])]) / 2.0
    np.testing.assert_allclose(speed, expected, atol=1.0)


def test_drives_have_a_corner_where_the_path_of_the_tool_has_one():
    command = _along(_AROUND[:3], 10)
    frame = _table(command)
    path, course = driven_path(frame)
    # drives of which each moves the tool along an axis
    drives = np.full_like(path, np.nan)
    drives[course["path_index"]] = 0.01 * command
    smooth = smooth_drives(frame, drives, course["path_index"])
    np.testing.assert_allclose(smooth, 0.01 * path, atol=1e-12)


def test_runs_together_are_those_of_each_run_alone():
    """Of equal steps and times, of others, with corners, of points twice, of one and of two points, without times."""
    generator = np.random.default_rng(4)
    straight = np.outer(np.linspace(0.0, 1.0, 6), [30.0, 40.0, 0.0])
    corner, even = _along(_AROUND[:3], 6), np.linspace(0.0, 2.0, 6)
    twice = np.repeat(generator.uniform(5.0, 20.0, (7, 3)).cumsum(axis=0), 2, axis=0)
    points = [
        *(straight + place for place in generator.normal(size=(3, 3))),
        straight @ np.diag([1.0, -1.0, 1.0]),
        corner,
        twice,
        straight[:1],
        straight[1:3],
        *np.cumsum(generator.uniform(5.0, 20.0, (3, 9, 3)), axis=1),
    ]
    time = [even, even, even + 0.5, even**2, None, *(np.sort(generator.uniform(0.0, 9.0, len(p))) for p in points[5:])]
    tables = [_table(p, t).assign(run=k) for k, (p, t) in enumerate(zip(points, time, strict=True), start=1)]
    path, course = driven_path(pd.concat(tables, ignore_index=True))
    first = 0
    for table in tables:
        alone, its_course = driven_path(table)
        here = slice(first, first + len(table))
        begin = course["path_index"][here][0]
        np.testing.assert_allclose(path[begin : begin + len(alone)], alone, atol=1e-9)
        np.testing.assert_array_equal(course["path_index"][here] - begin, its_course["path_index"])
        for name in ("velocity_mm_s", "acceleration_mm_s2"):
            np.testing.assert_allclose(course[name][here], its_course[name], rtol=1e-9, atol=1e-9)
        first += len(table)
