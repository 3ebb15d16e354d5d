"""The noise of poses that are measured again, next to an estimate of the noise."""

import numpy as np
import pandas as pd
import pytest

from rrru.campaign.noise import _shared_offsets, quieter_repeats, repeat_noise

_POSES, _NOISE_MM, _OFFSET = 26, 0.02, 0.3


def _campaign(runs):
    """Rows of runs (r,) of the same poses, each by its number; those of one number are one run."""
    pose = np.tile(np.arange(_POSES, dtype=float), len(runs))
    frame = pd.DataFrame({"run": np.repeat(runs, _POSES), "trajectory": "line", "command_x_mm": pose})
    frame = frame.assign(command_y_mm=0.0, command_z_mm=0.0, speed_mm_s=80.0, payload_kg=0.0, status="ok")
    return frame.sort_values("run", kind="stable", ignore_index=True).assign(point=np.arange(len(frame)) + 1)


def _measured(frame, generator):
    """Readings with white noise and an offset of each run."""
    offset = np.sqrt(_OFFSET) * generator.standard_normal((frame["run"].max() + 1, 3))[frame["run"]]
    read = _NOISE_MM * (generator.standard_normal((len(frame), 3)) + offset)
    return frame.assign(**{f"measured_{axis}_mm": read[:, k] for k, axis in enumerate("xyz")})


@pytest.mark.parametrize("runs", [(1, 2, 3), (1, 1, 1), (1, 1, 2)])
def test_repeats_of_the_same_noise_are_not_called_quieter(runs):
    """Offsets of three runs of the same poses are few numbers, and poses repeated in one run have none."""
    frame, found = _campaign(runs), 0
    mean_mm, generator = _NOISE_MM * np.sqrt(1.0 + _OFFSET), np.random.default_rng(5)
    for _ in range(300):
        found += quieter_repeats(_measured(frame, generator), mean_mm, offset=_OFFSET) is not None
    # three standard deviations of a distribution that is nearly normal
    assert found <= 4


@pytest.mark.parametrize("runs", [(1, 2, 3), (1, 1, 1), (1, 2, 2, 3)])
def test_repeats_of_less_noise_give_the_size_of_all_of_it(runs):
    frame, generator = _campaign(runs), np.random.default_rng(6)
    sizes = [quieter_repeats(_measured(frame, generator), 3.0 * _NOISE_MM, offset=_OFFSET) for _ in range(200)]
    assert np.sqrt(np.mean(np.square(sizes))) == pytest.approx(_NOISE_MM * np.sqrt(1.0 + _OFFSET), rel=0.05)


def test_what_offsets_make_of_the_deviations_is_that_of_draws():
    frame, generator = _campaign((1, 2, 2, 3)), np.random.default_rng(7)
    offset = generator.standard_normal((4000, 4))[:, frame["run"]]
    group = frame["command_x_mm"].astype(int)
    means = np.stack([offset[:, group == one].mean(axis=1) for one in range(_POSES)], axis=1)
    squares = ((offset - means[:, group]) ** 2).sum(axis=1)
    shared = _shared_offsets(_measured(frame, generator))
    assert squares.mean() == pytest.approx(np.trace(shared), rel=0.05)
    assert squares.var() == pytest.approx(2.0 * (shared**2).sum(), rel=0.15)


def test_without_offsets_the_estimate_is_that_of_the_deviations():
    frame, generator = _campaign((1, 2, 3)), np.random.default_rng(8)
    measured = _measured(frame, generator)
    assert quieter_repeats(measured, 1.0) == repeat_noise(measured)[0]
    assert quieter_repeats(measured.iloc[:_POSES], 1.0) is None
