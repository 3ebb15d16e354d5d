"""Drives that were read before the arm stood still: the effect model, a campaign of stops, and the diagnosis."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from rrru.campaign import measurements as rows
from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.result_notes import bias_notes
from rrru.diagnosis.settings import GapSettings
from rrru.effects.library import find
from rrru.effects.motion import last_move
from rrru.kinematics.dynamics import Masses
from rrru.robots.serial import serial

_DEG = np.pi / 180.0
ARM = serial(
    [
        {"d": 300.0, "alpha": -90.0 * _DEG},
        {"a": 280.0, "theta": -90.0 * _DEG},
        {"a": 70.0, "alpha": -90.0 * _DEG},
        {"d": 300.0, "alpha": 90.0 * _DEG},
        {"alpha": -90.0 * _DEG},
        {"d": 80.0},
    ],
    np.tile([-1.2, 1.2], (6, 1)),
    np.array([0.0, 0.1, 0.2, 0.0, 0.5, 0.0]),
    tool_mm=(40.0, 0.0, 60.0),
)
_SHARES = {f"share{k}": share for k, share in enumerate((1.6e-3, 1.2e-3, -0.9e-3, 1.5e-3, 1.1e-3, 0.8e-3), 1)}


def _campaign(count, shares, exponent=0.0, noise_mm=0.02, seed=3):
    """A table of stops in no order whose drives were read early, and the drives' true values."""
    generator = np.random.default_rng(seed)
    low, high = ARM.drive_range.T
    true = low + (high - low) * generator.random((count, 6))
    move = np.diff(true, axis=0, prepend=true[:1])
    longest = np.maximum(np.abs(move).max(axis=1, keepdims=True), 1e-3)
    read = true - np.array([*shares.values()]) * move / longest**exponent
    command, position = ARM.forward(read), ARM.forward(true)
    drives = dict(zip(ARM.parts.columns, read.T, strict=True))
    frame = pd.DataFrame({"run": 1, "trajectory": "poses", "point": np.arange(1, count + 1), "time_s": np.nan})
    measured = position + noise_mm * generator.standard_normal(position.shape)
    return frame.assign(
        **rows.vector_columns("command", command),
        **drives,
        **rows.vector_columns("measured", measured),
        speed_mm_s=np.nan,
        payload_kg=np.nan,
        status="ok",
    )


def _problem(frame, *names):
    return make_diagnosis_problem(frame, ARM, Masses(), 0.02, {name: find(name, ARM) for name in names})


def test_a_move_is_that_from_the_stop_before_whoever_is_measured_there():
    drive = np.array([[0.0, 1.0], [0.0, 1.0], [0.5, -1.0], [0.5, -1.0], [0.2, 0.0]])
    move = last_move(drive, np.array([0, 0, 8, 8, 16]))
    np.testing.assert_array_equal(move[:2], np.full((2, 2), np.nan))
    np.testing.assert_allclose(move[2:], [[0.5, -2.0], [0.5, -2.0], [-0.3, 1.0]])


@pytest.mark.parametrize("exponent", [0.0, 0.5, 1.0])
def test_the_law_undoes_what_was_read_too_early(exponent):
    frame = _campaign(40, _SHARES, exponent, noise_mm=0.0)
    problem, effect = _problem(frame, "read_before_rest"), find("read_before_rest", ARM)
    values = effect.parameters.vector(_SHARES | {"exponent": exponent})
    twists = effect.contribute(problem.motion, values).twists
    off = rows.measured(frame) - ARM.measured(ARM.solve(problem.motion.drive, rows.command(frame), twists), twists)
    # of the moves as read, which the shares change by themselves
    assert np.abs(off[1:]).max() < 0.02 * np.abs(rows.measured(frame) - rows.command(frame)).max()


def test_rows_that_are_held_out_stay_stops():
    frame = _campaign(40, _SHARES)
    held = np.arange(40) % 3 == 1
    marked = rows.hold_out(frame.assign(status=np.where(np.arange(40) == 4, "outlier", "ok")), held)
    assert marked["status"].tolist()[:6] == ["ok", "held_out", "ok", "ok", "outlier", "ok"]
    assert not rows.usable(marked)[held].any()
    whole, part = _problem(frame, "read_before_rest"), _problem(marked, "read_before_rest")
    np.testing.assert_array_equal(whole.motion.last_move, part.motion.last_move)
    assert not part.used[held].any() and len(part.motion.drive) == 40
    torn = _problem(frame[~held], "read_before_rest")
    assert np.nanmax(np.abs(torn.motion.last_move - whole.motion.last_move[~held])) > 0.1


def test_what_is_passed_on_a_path_has_no_last_move():
    frame = _campaign(40, _SHARES)
    order = np.argsort(frame["q1_rad"].to_numpy())
    low, high = ARM.drive_range.T
    line = low + 0.1 + 0.5 * (high - low) * np.linspace(0.0, 1.0, 40)[:, None]
    drives = dict(zip(ARM.parts.columns, line.T, strict=True))
    command = rows.vector_columns("command", ARM.forward(line))
    problem = _problem(frame.iloc[order].assign(**drives, **command), "read_before_rest", "drive_compliance")
    assert "last_move" in problem.untestable["read_before_rest"]


@pytest.mark.parametrize("exponent", [0.0, 1.0])
def test_the_diagnosis_names_it_and_not_backlash(exponent):
    frame = _campaign(150, _SHARES, exponent)
    robot = MeasuredRobot(replace(ARM, parameter_set="full"), Masses(), 0.02)
    names = ("backlash", "encoder_eccentricity", "transmission_error", "read_before_rest")
    found = diagnose(frame, robot, GapSettings(names, draws=10), details=False)
    assert found.verdict["effects"] == "read_before_rest"
    assert "would be off by" in found.verdict["notes"] and "before the arm stood still" in found.verdict["notes"]
    # of an effect that is in the corrected model and not named nothing is said: it would be said that it acts
    assert bias_notes(found.inference, ()) == ()
    values = next(iter(found.state.effects.values()))
    np.testing.assert_allclose(values, [*_SHARES.values()], atol=3e-4)
