"""What robots do between the measured points, against paths that are known."""

import numpy as np
import pandas as pd
import pytest
from scipy.spatial import cKDTree

from rrru.campaign.driven_path import STEPS, smooth_drives

_COUNT = 15


def _swing(at):
    """Two drives (n, 2) that swing, in rad and mm."""
    return np.stack([0.4 * np.sin(1.1 * at), 300.0 * np.cos(0.7 * at + 0.3)], axis=1)


def _campaign(at, command):
    """A measurement table of one run each way, through points at `at` (n,), and its drives (2 n, 2)."""
    drives = np.concatenate([_swing(at), _swing(at[::-1])])
    command = np.concatenate([command, command[::-1]])
    columns = {f"command_{axis}_mm": column for axis, column in zip("xyz", command.T, strict=True)}
    return pd.DataFrame(columns | {"run": np.repeat([1, 2], len(at))}), drives


def _evenly(drives, index):
    return np.stack([np.interp(np.arange(index[-1] + 1), index, one) for one in drives.T], axis=1)


@pytest.mark.parametrize("degree", [3, 5, 7])
def test_drives_between_points_are_those_of_a_smooth_motion(degree):
    at = np.linspace(0.0, 9.0, _COUNT)
    frame, drives = _campaign(at, np.stack([10.0 * at, 0.0 * at, 0.0 * at], axis=1))
    index = np.arange(2 * _COUNT) * STEPS
    evenly = _evenly(drives, index)
    smooth = smooth_drives(frame, evenly, index, degree)
    np.testing.assert_allclose(smooth[index], drives, rtol=0.0, atol=1e-9)
    # what counts is where the drives pass, not when
    way = np.ptp(drives, axis=0)
    true = cKDTree(_swing(np.linspace(0.0, 9.0, 20_001)) / way)
    there = slice(0, (_COUNT - 1) * STEPS + 1)
    off, straight = (true.query(path[there] / way)[0].max() for path in (smooth, evenly))
    assert straight > 0.02 and off < 0.2 * straight
    turns = np.abs(true.data).max(axis=0) - np.abs([evenly[there], smooth[there]]).max(axis=1) / way
    assert (np.abs(turns[1]) < 0.1 * np.abs(turns[0])).all()
    # the way back is the way there
    np.testing.assert_allclose(smooth[index[_COUNT] :], smooth[there][::-1], atol=1e-9)


def test_from_run_to_run_and_among_poses_in_any_order_drives_move_evenly():
    at = np.linspace(0.0, 9.0, _COUNT)
    frame, drives = _campaign(at, np.random.default_rng(1).uniform(-500.0, 500.0, (_COUNT, 3)))
    index = np.arange(2 * _COUNT) * STEPS
    evenly = _evenly(drives, index)
    np.testing.assert_array_equal(smooth_drives(frame, evenly, index), evenly)
    frame["command_x_mm"], frame["command_y_mm"], frame["command_z_mm"] = np.tile(at, 2), 0.0, 0.0
    between = slice(index[_COUNT - 1], index[_COUNT] + 1)
    smooth = smooth_drives(frame, evenly, index)
    np.testing.assert_allclose(smooth[between], evenly[between], atol=1e-9)


def test_a_drive_that_stands_still_and_reflectors_read_at_one_stop_are_taken_as_they_are():
    at = np.linspace(0.0, 9.0, _COUNT)
    frame, drives = _campaign(at, np.stack([10.0 * at, 0.0 * at, 0.0 * at], axis=1))
    index = np.arange(2 * _COUNT) * STEPS
    still = np.column_stack([drives, np.full(len(drives), 0.3)])
    once = smooth_drives(frame, _evenly(still, index), index)
    np.testing.assert_allclose(once[:, 2], 0.3, atol=1e-15)
    seen = frame.loc[np.repeat(frame.index, 2)].assign(target=["a", "b"] * len(frame))
    twice = smooth_drives(seen, _evenly(still, index), np.repeat(index, 2))
    np.testing.assert_array_equal(twice, once)
