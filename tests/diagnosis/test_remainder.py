"""What the unexplained part follows, on made-up remainders whose variable is known."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.remainder import followed_alike, remainder_rows
from rrru.diagnosis.smooth_functions import Regression
from rrru.diagnosis.state import LinearizedProblem
from rrru.robots.rrru3 import Rrru3

NOISE_MM = 0.02
ROBOT = Rrru3()


def _offsets(motion):
    """Three offsets of all positions."""
    return np.broadcast_to(np.eye(3), (len(motion.time_s), 3, 3))


def _waves_of_the_place(motion):
    """Waves along each axis, two of each length, that move each axis."""
    angle = motion.position_mm[:, :, None] * np.pi / np.array([600.0, 300.0, 200.0])
    waves = np.concatenate([np.sin(angle), np.cos(angle)], axis=-1).reshape(len(angle), -1)
    return np.concatenate([_offsets(motion), np.einsum("mk,ab->mabk", waves, np.eye(3)).reshape(len(waves), 3, -1)], -1)


def _attribution(make, seed=0, count=240, calibration=_offsets):
    """A made-up InferenceResult: twelve runs of twenty points.

    make: from motion and drives' derivatives to (m, 3); calibration: from the motion to its columns (m, 3, k).
    """
    generator = np.random.default_rng(seed)
    along = np.tile(np.linspace(0.0, 1.0, 20), count // 20)
    start = np.repeat(generator.uniform(-1.0, 1.0, (count // 20, 3)), 20, axis=0)
    end = np.repeat(generator.uniform(-1.0, 1.0, (count // 20, 3)), 20, axis=0)
    position = 300.0 * (start + (end - start) * along[:, None])
    mixed = np.array([[1.0, 0.4, -0.2], [-0.3, 1.0, 0.5], [0.2, -0.6, 1.0]])
    drive = 0.002 * position @ mixed + 0.1 * np.sin(position / 150.0)
    motion = SimpleNamespace(
        position_mm=position,
        drive=drive,
        drive_rate=np.gradient(drive, axis=0),
        time_s=np.arange(count) * 2.0 + np.repeat(np.arange(count // 20), 20) * 30.0,
        payload_kg=np.zeros(count),
    )
    response = 200.0 * np.broadcast_to(np.linalg.inv(mixed), (count, 3, 3)) * (1.0 + 0.2 * along[:, None, None])
    left = make(motion, response) + NOISE_MM * generator.standard_normal((count, 3))
    run = np.repeat(np.arange(count // 20), 20)
    problem = SimpleNamespace(
        motion=motion,
        at=np.arange(count),
        on_robot=np.ones(count, dtype=bool),
        run=run,
        stop=np.arange(count),
        noise_mm=NOISE_MM,
        mechanism=ROBOT,
        library={},
        points=pd.DataFrame({"speed_mm_s": np.full(count, 80.0)}),
        residual=lambda _state: left,
    )
    evidence = SimpleNamespace(linear=LinearizedProblem(left, calibration(motion), {}, {}, {}, response))
    posterior = SimpleNamespace(best=lambda: (SimpleNamespace(effects=frozenset()), 0))
    return SimpleNamespace(problem=problem, evidence=evidence, posterior=posterior, state=None)


_MADE = {
    "the value of leg 2": lambda motion, response: response[:, :, 1] * (4e-4 * np.sin(9.0 * motion.drive[:, 1:2])),
    "the value of leg 3, as an error of leg 1": lambda motion, response: (
        response[:, :, 0] * (4e-4 * np.sin(9.0 * motion.drive[:, 2:3]))
    ),
    "the time": lambda motion, _: 0.1 * np.sin(motion.time_s / 60.0)[:, None] * [1.0, -0.5, 0.2],
    "the place": lambda motion, _: 0.1 * np.cos(np.linalg.norm(motion.position_mm - 100.0, axis=1) / 60.0)[:, None],
    "the sense of motion of the drives": lambda motion, response: np.einsum(
        "mak,mk->ma", response, 3e-4 * np.sign(motion.drive_rate) * [1.0, 0.5, -1.0]
    ),
}


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("follows", list(_MADE))
def test_the_variable_that_makes_it_is_found(follows, seed):
    rows = remainder_rows(_attribution(_MADE[follows], seed))
    assert rows["follows"].iloc[0] == follows and rows["explained"].iloc[0] > 0.7
    assert rows["explained"].between(0.0, 1.0).all() and rows["explained"].is_monotonic_decreasing


@pytest.mark.parametrize("seed", range(5))
def test_noise_follows_nothing(seed):
    """Four times the noise that is stated: much is left, and nothing predicts it."""
    noise = np.random.default_rng(100 + seed).standard_normal((240, 3))
    for calibration in (_offsets, _waves_of_the_place):
        rows = remainder_rows(_attribution(lambda *_: 4.0 * NOISE_MM * noise, seed, calibration=calibration))
        assert rows["explained"].max() < 0.1


def test_left_out_predictions_are_those_of_fits_without_the_fold():
    generator = np.random.default_rng(4)
    design, data = generator.standard_normal((30, 3, 5)), generator.standard_normal((30, 3))
    fold, noise, amplitude = np.arange(30) % 3, 0.7, 1.3
    found = Regression(design, data, noise).left_out(fold, amplitude)
    for number in range(3):
        flat, target = design[fold != number].reshape(-1, 5), data[fold != number].ravel()
        own = np.linalg.solve(flat.T @ flat + (noise / amplitude) ** 2 * np.eye(5), flat.T @ target)
        np.testing.assert_allclose(found[fold == number], design[fold == number] @ own, rtol=1e-9)


def test_the_evidence_is_that_of_the_dense_normal_density():
    generator = np.random.default_rng(5)
    design, data = generator.standard_normal((8, 3, 4)), generator.standard_normal((8, 3))
    problem, flat = Regression(design, data, 0.6), design.reshape(24, 4)

    def dense(amplitude):
        covariance = 0.36 * np.eye(24) + amplitude**2 * flat @ flat.T
        _, determinant = np.linalg.slogdet(covariance)
        return -0.5 * (determinant + data.ravel() @ np.linalg.solve(covariance, data.ravel()))

    for amplitude in (0.3, 2.0):
        assert problem.log_evidence(amplitude) == pytest.approx(dense(amplitude) - dense(0.0), rel=1e-9)


def test_effects_that_make_what_the_variable_makes_are_found():
    """A slow drift follows the time as the remainder does; waves of a drive and effects of other needs do not."""
    found = _attribution(_MADE["the time"], 1)
    motion = found.problem.motion
    made = {
        ("drift", 0): (motion.time_s / motion.time_s.max())[:, None, None] * np.ones((1, 3, 1)),
        ("waves", 0): np.sin(60.0 * motion.drive[:, :1])[:, :, None] * np.ones((1, 3, 1)),
        ("bend", 0): (motion.position_mm / 300.0)[:, :, None] ** 2,
        ("shake", 0): np.sin(motion.time_s)[:, None, None] * np.ones((1, 3, 1)),
    }
    needs = {"drift": ("time_s",), "waves": (), "bend": (), "shake": ("time_s",)}
    found.problem.effects = {name: SimpleNamespace(needs=own) for name, own in needs.items()}
    found.evidence.linear.columns.update(made)
    found.state = SimpleNamespace(effects={key: np.ones(1) for key in made})
    rows = remainder_rows(found)
    names, size = followed_alike(found, rows, tuple(needs))
    assert names == ("drift",) and size == rows["rms_mm"].iloc[0] > 0.0
    assert followed_alike(found, rows, ("waves", "bend", "shake")) == ((), 0.0)
    weak = rows.assign(explained=0.9 * OPTIONS.min_followed_share)
    assert followed_alike(found, weak, ("drift",)) == ((), 0.0)


def test_what_the_calibration_could_take_away_is_no_part_of_it():
    found = remainder_rows(_attribution(_MADE["the time"], 1))
    moved = remainder_rows(_attribution(lambda *given: np.add(_MADE["the time"](*given), [0.5, -0.3, 0.2]), 1))
    pd.testing.assert_frame_equal(found, moved, rtol=1e-6)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_calibration_absorbs_of_a_function_what_it_absorbed_of_the_readings(seed):
    """What a calibration of many parameters leaves of a function of a drive is no function of the drive alone."""
    rows = remainder_rows(_attribution(_MADE["the value of leg 2"], seed, calibration=_waves_of_the_place))
    assert rows["follows"].iloc[0] == "the value of leg 2" and rows["explained"].iloc[0] > 0.8
