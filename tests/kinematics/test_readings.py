"""Readings of a robot: reflectors on its tool and orientations, against a plain prediction and its differences."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rrru.calibration.calibrate import calibrate
from rrru.estimation.observations.target_positions import TargetPositions
from rrru.kinematics.augmented_robot import AugmentedRobot
from rrru.kinematics.base_parameters import MeasurementConfig
from rrru.kinematics.legs import TOOL, WORLD
from rrru.kinematics.readings import Readings, reading_residual
from rrru.kinematics.robot import Robot
from tests.kinematics.test_general_model import GENERAL, ROBOTS, _about_home, _clear

_REFLECTORS = {"ball a": (60.0, 0.0, 40.0), "ball b": (-30.0, 50.0, 45.0), "ball c": (-30.0, -50.0, 90.0)}
_CHARACTERISTIC_LENGTH_MM = 300.0
_STEPS = np.repeat([1e-2, 1e-5], 3)


def _poses(name, **reads):
    """A robot as read, 100 positions and actuator values."""
    robot, points, actuators = _about_home(GENERAL[name]) if name in GENERAL else _clear(name)
    return robot.with_measurement_config(MeasurementConfig(tuple(_REFLECTORS), turned=True, **reads)), points, actuators


def _predicted(robot, poses, twists, names, places, on_world=None):
    """Positions (n, 3) and orientations (n, 3, 3), pose by pose in plain words."""
    on_world = np.zeros(len(names), dtype=bool) if on_world is None else on_world
    numbers, positions, turns = robot.legs.site_numbers, [], []
    every = np.array(np.broadcast_to(twists, (len(names), *twists.shape[1:])))
    for k, (name, place) in enumerate(zip(names, places, strict=True)):
        world, tool, own = (every[k, numbers[site]] for site in (WORLD, TOOL, name))
        seat = np.asarray(robot.tool_mm)
        on_platform = seat + tool[:3] + Rotation.from_rotvec(tool[3:]).apply(place - seat) + own[:3]
        in_base = place + own[:3] if on_world[k] else poses.position_mm[k] + poses.turn[k] @ on_platform
        positions.append(Rotation.from_rotvec(world[3:]).apply(in_base) + world[:3])
        turned = Rotation.from_rotvec(world[3:]) * Rotation.from_matrix(poses.turn[k]) * Rotation.from_rotvec(tool[3:])
        turns.append(turned.as_matrix())
    return np.array(positions), np.array(turns)


def _reflectors(count):
    """Names (n,) of reflectors in turn, and their places (n, 3)."""
    names = np.array([*_REFLECTORS] * count)[:count]
    return names, np.array([_REFLECTORS[name] for name in names])


@pytest.fixture(params=["hexapod", "arm", "rrru3", "delta"])
def setting(request):
    """A robot, readings off by millimetres and milliradians at every other pose, actuator values, twists and poses.

    Ball c stands on the table.
    """
    robot, points, actuators = _poses(request.param)
    generator = np.random.default_rng(2)
    twists = generator.normal(size=(len(points), len(robot.legs.sites), 6)) * np.repeat([0.3, 2e-3], 3)
    poses = robot.solve(actuators, points, twists)
    names, places = _reflectors(len(points))
    table = names == "ball c"
    position, turn = _predicted(robot, poses, twists, names, places, table)
    turn = Rotation.from_rotvec(generator.normal(size=(len(points), 3)) * 3e-3).as_matrix() @ turn
    turn[::2] = np.nan
    readings = Readings(
        position + generator.normal(size=position.shape), names, places, turn, _CHARACTERISTIC_LENGTH_MM, table
    )
    return robot, readings, actuators, twists, poses


def test_the_residual_is_read_minus_predicted(setting):
    robot, readings, _, twists, poses = setting
    own = readings.reflectors, readings.place_mm, readings.on_world
    position, turn = _predicted(robot, poses, twists, *own)
    result = reading_residual(robot, readings, poses, twists)
    np.testing.assert_allclose(result[:100], readings.position_mm - position, rtol=0.0, atol=1e-9)
    odd = np.arange(1, 100, 2)
    np.testing.assert_array_equal(readings.rows, [*range(100), *odd])
    # the rotation vector that is lacking, applied to the model's orientation, gives the one that was read
    again = Rotation.from_rotvec(result[100:] / _CHARACTERISTIC_LENGTH_MM).as_matrix() @ turn[odd]
    np.testing.assert_allclose(again, readings.turn[odd], rtol=0.0, atol=1e-12)


def test_the_effect_of_every_site_and_drive_is_minus_the_derivative_of_the_residual(setting):
    """Against central differences through the exact closure, with finite twists at all sites."""
    robot, readings, actuators, twists, poses = setting
    at = robot.map(actuators, poses, twists, readings)

    def slope(change):
        ends = []
        for sign in (1.0, -1.0):
            values, moved = change(sign)
            ends.append(reading_residual(robot, readings, robot.model.solve(values, poses, moved), moved))
        return (ends[1] - ends[0]) / 2.0

    worst, largest = np.zeros(2), np.zeros(2)
    for site in robot.legs.sites:
        effect, number = at.effect(site), robot.legs.site_numbers[site]
        for component, step in enumerate(_STEPS):

            def change(sign, number=number, component=component, step=step):
                moved = twists.copy()
                moved[:, number, component] += sign * step
                return actuators, moved

            exact, kind = slope(change) / step, component // 3
            worst[kind] = max(worst[kind], np.abs(effect[..., component] - exact).max())
            largest[kind] = max(largest[kind], np.abs(exact).max())
    assert (worst <= 2e-6 * largest).all(), worst / largest
    effect, size = at.drive_effect, np.abs(at.drive_effect).max()
    for k, drive in enumerate(robot.parts.drives):
        step = 1e-2 if drive.unit == "mm" else 1e-5
        exact = slope(lambda sign, k=k, step=step: (actuators + sign * step * np.eye(actuators.shape[1])[k], twists))
        assert np.abs(effect[..., k] - exact / step).max() <= 2e-6 * size


def _read(robot, actuators, points, truth, turned):
    """Readings that a robot of true deviations by name gives."""
    twists = robot.twists(robot.parameters.vector(truth))
    names, places = _reflectors(len(points))
    position, turn = _predicted(robot, robot.solve(actuators, points, twists), twists, names, places)
    return Readings(position, names, places, turn if turned else None, _CHARACTERISTIC_LENGTH_MM)


def _off(robot, points, actuators, turned):
    """Fit of noise-free readings of drawn deviations, and what it is off by in mm, angles at the robot's arm."""
    robot = robot.with_identifiable_parameters(actuators, points, _read(robot, actuators, points, {}, turned))
    sizes = np.array([0.5 if unit == "mm" else 1e-3 for unit in robot.parameters.units])
    values = np.random.default_rng(9).normal(size=len(sizes)) * sizes
    readings = _read(robot, actuators, points, dict(zip(robot.parameters.names, values.tolist(), strict=True)), turned)
    fit = calibrate(TargetPositions(robot, actuators, readings.position_mm, points, readings))
    arm = np.where(np.array(robot.parameters.units) == "rad", robot.characteristic_length_mm, 1.0)
    return robot, fit, np.abs((fit.deviations - values) * arm)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("name", ["hexapod", "arm"])
def test_full_sets_are_recovered_beside_unknown_frame_and_reflectors(name, turned):
    robot, points, actuators = _poses(name, fitted=tuple(_REFLECTORS), frame=True)
    robot, fit, off = _off(replace(robot, parameter_set="full"), points, actuators, turned)
    assert fit.identifiability.rank == len(robot.parameters) and off.max() < 1e-6
    assert len(robot.parameters) > 30 and {"ball_a_x", "ball_b_y", "ball_c_z"} & {*robot.parameters.names}


@pytest.mark.parametrize("name", ROBOTS)
def test_a_robot_with_a_closed_form_gets_frame_and_reflectors_beside_its_own_numbers(name):
    robot, points, actuators = _poses(name, fitted=tuple(_REFLECTORS), frame=True)
    own = robot.robot.parameters.names
    robot, fit, off = _off(robot, points, actuators, turned=True)
    assert robot.parameters.names[: len(own)] == own and len(robot.parameters) > len(own) + 9
    assert off[~fit.identifiability.unseen].max() < 1e-6 and fit.rms_mm < 1e-8


# closed forms of a robot, in place of which a robot as read uses the general model
_CLOSED_FORMS = {
    *("closed_form", "forward", "forward_batch", "mean_distance", "actuator_jacobian", "parameter_jacobian"),
    "singularities",
}


@pytest.mark.parametrize("name", [*ROBOTS])
def test_a_robot_as_read_has_every_attribute_of_its_robot(name):
    robot, _, _ = _clear(name)
    read = robot.with_measurement_config(MeasurementConfig((*_REFLECTORS,), ("ball a",), frame=True))
    of_every_robot = {*vars(Robot), *Robot.__annotations__}
    changed = {
        attribute
        for kind in type(robot).__mro__[: type(robot).__mro__.index(Robot)]
        for attribute in vars(kind)
        if attribute in of_every_robot and not attribute.startswith("_")
    }
    missing = changed - {*vars(AugmentedRobot), *AugmentedRobot.__dataclass_fields__} - _CLOSED_FORMS
    assert not missing, f"AugmentedRobot has the default of {missing}: add it to its list of the robot's own"
    for attribute in Robot.__annotations__.keys() - {"parameters", "legs", "directions", "measurement_config"}:
        assert getattr(read, attribute) is getattr(robot, attribute) or getattr(read, attribute) == getattr(
            robot, attribute
        )


def test_a_robot_as_read_starts_where_its_robot_starts():
    robot, points, actuators = _clear("rrru3")
    read = robot.with_measurement_config(MeasurementConfig((*_REFLECTORS,), turned=True, frame=True))
    np.testing.assert_allclose(read.forward(actuators), points, atol=1e-6)
    assert read.with_measurement_config(MeasurementConfig(turned=True)).robot is robot


def test_a_robot_as_read_knows_the_deviations_of_its_robot_and_its_own():
    robot, points, actuators = _clear("rrru3")
    read = robot.with_measurement_config(MeasurementConfig((*_REFLECTORS,), ("ball a",), frame=True))
    for deviation in robot.deviation_names:
        twists = read.twists_of({deviation: 1e-3, "world_x": 0.3})
        poses = read.solve(actuators, points, twists)
        plain = robot.twists_of({deviation: 1e-3})
        expected = robot.measured(robot.solve(actuators, points, plain), plain) + np.array([0.3, 0.0, 0.0])
        np.testing.assert_allclose(read.measured(poses, twists), expected, atol=1e-9)


def test_orientations_alone_do_not_depend_on_the_places_of_reflectors():
    """Of a robot with reflectors only the tool and the orientation are read: a reflector's twist changes nothing."""
    robot, points, actuators = _poses("hexapod")
    poses = robot.solve(actuators, points)
    at = robot.map(
        actuators, poses, readings=Readings(points, turn=poses.turn, characteristic_length_mm=_CHARACTERISTIC_LENGTH_MM)
    )
    assert not at.effect("ball a").any()


def test_places_without_reflectors_are_refused():
    points = np.zeros((3, 3))
    with pytest.raises(ValueError, match="places without reflectors"):
        Readings(points, place_mm=points)
    with pytest.raises(ValueError, match="reflectors without places"):
        Readings(points, np.array(["ball a"] * 3))
