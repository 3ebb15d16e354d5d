"""A hexapod with one encoder that errs over a short stretch of its stroke, simulated by leg lengths alone."""

import numpy as np
import pandas as pd
import pytest
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

from rrru.campaign import measurements as rows
from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.settings import GapSettings
from rrru.kinematics.dynamics import Masses
from rrru.robots.hexapod import hexapod

_ANGLES = np.radians([0.0, 20.0, 120.0, 140.0, 240.0, 260.0])
_RING = np.stack([np.cos(_ANGLES), np.sin(_ANGLES), 0.0 * _ANGLES], axis=1)
_BASE, _PLATFORM, _HEIGHT = 300.0 * _RING, 120.0 * np.roll(_RING, 1, axis=0), 400.0
_LEG, _SIZE_MM, _SPREAD_MM = 3, 0.2, 4.0
_NOISE_MM, _NOISE_RAD = 0.02, 1e-4
_COUNT = 160


def _lengths(position, turn):
    """Lengths (6,) of the legs at a place of the platform."""
    return np.linalg.norm(position + _PLATFORM @ turn.T - _BASE, axis=1)


def _error(lengths):
    """Error (..) of the encoder at its values: a hill of 0.2 mm, some 10 mm wide."""
    middle = _lengths(np.array([0.0, 0.0, _HEIGHT]), np.eye(3))[_LEG]
    return _SIZE_MM * np.exp(-0.5 * ((lengths - middle) / _SPREAD_MM) ** 2)


@pytest.fixture(scope="module")
def measured():
    """The robot and its measurement table: the pose whose legs are as long as the encoders mean, and noise."""
    generator, readings = np.random.default_rng(1), []
    for _ in range(_COUNT):
        position = np.array([0.0, 0.0, _HEIGHT]) + generator.uniform(-1.0, 1.0, 3) * [40.0, 40.0, 30.0]
        vector = generator.uniform(-0.12, 0.12, 3)
        command = _lengths(position, Rotation.from_rotvec(vector).as_matrix())
        true = command + np.eye(6)[_LEG] * _error(command[_LEG])

        def off(pose, true=true):
            return _lengths(pose[:3], Rotation.from_rotvec(pose[3:]).as_matrix()) - true

        pose = fsolve(off, np.r_[position, vector], xtol=1e-10)
        turned = Rotation.from_rotvec(_NOISE_RAD * generator.standard_normal(3)) * Rotation.from_rotvec(pose[3:])
        readings.append((command, position, pose[:3] + _NOISE_MM * generator.standard_normal(3), turned.as_matrix()))
    drive, position, reached, turn = map(np.array, zip(*readings, strict=True))
    robot = hexapod(_BASE, _PLATFORM, _HEIGHT, 80.0, parameter_set="full")
    frame = pd.DataFrame({"run": 1, "trajectory": "poses", "point": np.arange(1, _COUNT + 1), "status": "ok"})
    frame = frame.assign(
        **rows.vector_columns("command", position),
        **dict(zip(robot.parts.columns, drive.T, strict=True)),
        **dict.fromkeys(("time_s", "speed_mm_s", "payload_kg"), np.nan),
        **rows.vector_columns("measured", reached),
        **rows.turn_columns("measured", turn),
    )
    return robot.with_measurement_config(rows.measurement_config(frame)), frame


def test_a_local_error_of_one_encoder_is_its_error_function(measured):
    robot, frame = measured
    known = MeasuredRobot(robot, Masses(0.0, 0.0, 0.0), _NOISE_MM, noise_rad=_NOISE_RAD)
    found = diagnose(frame, known, GapSettings(), details=False)
    assert found.verdict["effects"] == "drive_error_function" and found.verdict["probability"] > 0.9
    assert found.verdict["leg"] == _LEG + 1
    assert found.verdict["gap_after_rms_mm"] < 0.4 * found.verdict["gap_rms_mm"]
    # the function of that drive is the hill, up to a constant and a slope, which a length and others absorb
    problem, state = found.inference.problem, found.state
    effect, values = problem.library["drive_error_function"], state.effects["drive_error_function", 0]
    functions = enumerate(effect.along_drives(problem.motion), 1)
    made = [own @ values[effect.coordinates.legs == drive] for drive, own in functions]
    lengths = frame[robot.parts.columns[_LEG]].to_numpy()
    line = np.stack([np.ones(_COUNT), lengths], axis=1)

    def bent(change):
        return change - line @ np.linalg.lstsq(line, change, rcond=None)[0]

    assert int(np.argmax([np.ptp(one) for one in made])) == _LEG
    assert np.sqrt(np.mean((bent(made[_LEG]) - bent(_error(lengths))) ** 2)) < 0.2 * np.std(_error(lengths))
