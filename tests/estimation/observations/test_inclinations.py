"""An inclinometer on the platform: prediction written out, slopes, and the tilt of the base that it determines."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rrru.errors import FitError
from rrru.estimation.observations.combined import Joined, Part
from rrru.estimation.observations.inclinations import Inclinations, base_tilt
from rrru.estimation.observations.target_positions import TargetPositions
from rrru.estimation.parameters import Block, Parameters
from rrru.estimation.problem import Problem, WhiteNoise
from rrru.estimation.solver import solve
from rrru.kinematics.base_parameters import MeasurementConfig
from rrru.kinematics.readings import orientation
from tests.kinematics.test_general_model import GENERAL, _about_home, _clear

_NOISE_MM, _NOISE_RAD = 0.02, 5e-5
_TILT = np.array([0.012, -0.007])


def _robot(name, **reads):
    """A robot as read, actuator values (n, K) and positions (n, 3)."""
    robot, points, actuators = _about_home(GENERAL[name]) if name in GENERAL else _clear(name)
    robot = robot.with_measurement_config(MeasurementConfig(**reads)).with_identifiable_parameters(actuators, points)
    return robot, actuators, points


def _drawn(robot, seed):
    """Small deviations (p,) of all parameters."""
    sizes = np.where(np.array(robot.parameters.units) == "mm", 0.3, 5e-4)
    return sizes * np.random.default_rng(seed).standard_normal(len(sizes))


@pytest.mark.parametrize("name", ["hexapod", "arm", "rrru3"])
def test_predictions_are_those_of_plain_trigonometry(name):
    robot, actuators, points = _robot(name)
    deviations = _drawn(robot, 1)
    own = Inclinations(robot, actuators, np.zeros((len(points), 2)), points)
    twists = robot.twists(deviations)
    turns = orientation(robot, robot.solve(actuators, points, twists), twists)
    base = (Rotation.from_euler("X", _TILT[0]) * Rotation.from_euler("Y", _TILT[1])).as_matrix()
    expected = []
    for turn in turns:
        # the direction against gravity in the sensor's axes: a level base has it along `up`
        x, y, z = (base @ turn @ own.sensor).T @ np.asarray(robot.up)
        expected.append([np.arctan2(y, z), np.arctan2(-x, np.hypot(y, z))])
    np.testing.assert_allclose(-own.residual(np.append(deviations, _TILT)), expected, atol=1e-9)


def test_the_default_sensor_reads_zero_at_home_on_a_level_base():
    for name in ("hexapod", "arm", "rrru3"):
        robot, _, _ = _robot(name)
        own = Inclinations(robot, np.zeros((1, 3)), np.zeros((1, 2)), np.zeros((1, 3)))
        np.testing.assert_allclose((robot.legs.home_turn @ own.sensor).T @ robot.up, [0.0, 0.0, 1.0], atol=1e-12)


@pytest.mark.parametrize("name", ["hexapod", "arm", "rrru3"])
def test_the_jacobian_is_that_of_finite_differences(name):
    robot, actuators, points = _robot(name, frame=True)
    own = Inclinations(robot, actuators, np.zeros((len(points), 2)), points)
    at = np.append(_drawn(robot, 2), _TILT)
    exact = own.jacobian(at)
    for k, unit in enumerate([*robot.parameters.units, "rad", "rad"]):
        step = (1e-3 if unit == "mm" else 1e-6) * np.eye(len(at))[k]
        slope = own.residual(at + step) - own.residual(at - step)
        np.testing.assert_allclose(exact[..., k], slope / (2.0 * step[k]), rtol=1e-5, atol=2e-8)


@pytest.mark.parametrize("name", ["hexapod", "rrru3"])
def test_it_tells_a_tilt_of_the_base_that_positions_in_an_unregistered_frame_do_not_tell(name):
    robot, actuators, points = _robot(name, frame=True)
    deviations, generator = _drawn(robot, 3), np.random.default_rng(4)
    count = len(deviations)
    seen = robot.forward(actuators, deviations, points) + _NOISE_MM * generator.standard_normal(points.shape)
    positions = TargetPositions(robot, actuators, seen, points)
    exact = Inclinations(robot, actuators, np.zeros((len(points), 2)), points)
    read = -exact.residual(np.append(deviations, _TILT)) + _NOISE_RAD * generator.standard_normal((len(points), 2))
    inclinations = Inclinations(robot, actuators, read, points)
    parameters = Parameters((Block.geometry(robot.parameters), base_tilt(0.05)))
    alone = Part(positions, WhiteNoise(_NOISE_MM), slice(count))
    both = (alone, Part(inclinations, WhiteNoise(_NOISE_RAD)))
    found, without = (solve(Problem(Joined(parts), parameters)) for parts in (both, (alone,)))
    np.testing.assert_allclose(without.block_errors("base_tilt"), 0.05, rtol=1e-6)
    np.testing.assert_allclose(without.block("base_tilt"), 0.0, atol=1e-9)
    assert np.abs(without.null_space[:, count:]).max() == pytest.approx(0.05)
    errors = found.block_errors("base_tilt")
    assert (errors < 1e-3).all() and (np.abs(found.block("base_tilt") - _TILT) < 4.0 * errors).all()
    # what the instruments leave is their noise
    assert found.standardized_residual.std() == pytest.approx(1.0, abs=0.15)


def test_angles_that_cross_half_a_turn_are_near_each_other():
    robot, actuators, points = _robot("rrru3")
    upside_down = np.diag([1.0, -1.0, -1.0])
    own = Inclinations(robot, actuators, np.zeros((len(points), 2)), points, upside_down)
    values = np.zeros(len(robot.parameters) + 2)
    read = -own.residual(values)
    read[:, 0] += np.where(read[:, 0] > 0.0, -2.0 * np.pi, 2.0 * np.pi) + 1e-4
    again = Inclinations(robot, actuators, read, points, upside_down).residual(values)
    np.testing.assert_allclose(again, np.tile([1e-4, 0.0], (len(points), 1)), atol=1e-9)


def test_a_reading_that_is_not_finite_is_named():
    robot, actuators, points = _robot("rrru3")
    read = np.zeros((len(points), 2))
    read[4, 1] = np.nan
    with pytest.raises(FitError, match=r"measured_rad is not finite at 1 of \d+ poses, the first is pose 5"):
        Inclinations(robot, actuators, read, points)
