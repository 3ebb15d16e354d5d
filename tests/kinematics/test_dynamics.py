"""Rates and loads against exact derivatives, potential energy and the energy balance."""

from dataclasses import fields, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rrru.kinematics.dynamics import GRAVITY_MM_S2, Masses, drive_rates, gravity, level_axes, load_slopes, loads
from rrru.kinematics.point_masses import PointMass
from rrru.robots.catalogue import make_mechanism
from rrru.robots.delta import Delta
from rrru.robots.hexapod import hexapod
from rrru.robots.ptt3 import Ptt3
from rrru.robots.rrru3 import Rrru3
from tests.places import DATA

_ROBOT = Rrru3()
_MASSES = Masses()
_PAYLOAD_KG = 2.5


def _at_rest(robot, actuators, points, masses=_MASSES, payload_kg=_PAYLOAD_KG):
    """The Loads of a robot that stands at points (n, 3)."""
    still = np.zeros_like(actuators)
    payload = np.full(len(points), payload_kg)
    return loads(
        robot, masses, robot.map_at(actuators, points), actuators, (still, still), np.zeros_like(points), payload
    )


class _Leaning(Rrru3):
    """A 3-RRRU in whose frame up is not an axis."""

    up = tuple(Rotation.from_rotvec([-0.02, 0.01, 0.0]).apply([0.0, 0.0, -1.0]).tolist())


def _motion(n):
    generator = np.random.default_rng(2)
    return generator.uniform(-200.0, 200.0, (n, 3)), generator.uniform(-300.0, 300.0, (n, 3))


def test_rates_are_the_jacobians(rich_poses):
    points, theta = rich_poses
    velocity, acceleration = _motion(len(points))
    rate, _ = drive_rates(_ROBOT, points, velocity, acceleration)
    exact = np.linalg.solve(_ROBOT.actuator_jacobian(points, theta), velocity[..., None])[..., 0]
    np.testing.assert_allclose(rate, exact, rtol=1e-5, atol=1e-6)


def test_drive_accelerations_are_the_rates_rates(rich_poses):
    """Along x(t) the Jacobian's rate solve(J, v) is differentiated in time."""
    points, _ = rich_poses
    velocity, acceleration = _motion(len(points))
    _, second = drive_rates(_ROBOT, points, velocity, acceleration)
    h = 1e-4

    def rate(t):
        position = points + velocity * t + 0.5 * acceleration * t**2
        jacobian = _ROBOT.actuator_jacobian(position, _ROBOT.inverse(position))
        return np.linalg.solve(jacobian, (velocity + acceleration * t)[..., None])[..., 0]

    np.testing.assert_allclose(second, (rate(h) - rate(-h)) / (2.0 * h), rtol=1e-4, atol=1e-5)


def test_a_robot_at_rest_has_no_rates(rich_poses):
    points, _ = rich_poses
    rate, second = drive_rates(_ROBOT, points, np.zeros_like(points), np.zeros_like(points))
    assert np.abs(rate).max() == 0.0 and np.abs(second).max() == 0.0
    # starting from rest: no rate yet, but an acceleration
    rate, second = drive_rates(_ROBOT, points, np.zeros_like(points), np.full_like(points, 40.0))
    assert np.abs(rate).max() < 1e-12 and np.abs(second).min(axis=0).max() > 0.0


def test_unknown_motion_gives_unknown_rates(rich_poses):
    points, _ = rich_poses
    velocity, acceleration = _motion(len(points))
    velocity[3] = np.nan
    acceleration[5] = np.nan
    known, _ = drive_rates(_ROBOT, points, velocity, np.nan_to_num(acceleration))
    rate, second = drive_rates(_ROBOT, points, velocity, acceleration)
    assert np.isnan(rate[3]).all() and np.isnan(second[[3, 5]]).all()
    np.testing.assert_array_equal(rate[5], known[5])
    others = np.delete(np.arange(len(points)), [3, 5])
    assert np.isfinite(rate[others]).all() and np.isfinite(second[others]).all()


def _potential(theta, guess, up=_ROBOT.up):
    """Potential energy (n,) in N mm: the lumped masses' heights from the forward kinematics; z points down."""
    position = _ROBOT.forward(theta, guess_mm=guess)
    platform = _MASSES.platform_kg + _PAYLOAD_KG + 1.5 * _MASSES.forearm_kg
    cosine, sine = _ROBOT.azimuth_cos_sin
    elbow = 400.0 * np.stack([np.cos(theta) * cosine, np.cos(theta) * sine, np.sin(theta)], axis=-1)
    masses = 0.5 * _MASSES.forearm_kg + 0.5 * _MASSES.arm_kg
    height = (platform * position + masses * elbow.sum(axis=1)) @ np.array(up)
    return height * GRAVITY_MM_S2 / 1000.0


@pytest.mark.parametrize("robot", [_ROBOT, _Leaning()], ids=["level", "leaning"])
def test_static_torque_is_the_potential_energys_slope(rich_poses, robot):
    points, theta = rich_poses
    torque = _at_rest(robot, theta, points).drive
    h = 1e-5
    for leg in range(3):
        step = h * np.eye(3)[leg]
        ends = (_potential(theta + sign * step, points, robot.up) for sign in (1.0, -1.0))
        slope = (next(ends) - next(ends)) / (2.0 * h)
        np.testing.assert_allclose(torque[:, leg], -slope, rtol=1e-5, atol=1e-2)


def test_motors_supply_the_change_of_energy(rich_poses):
    """Energy balance: the motors' torque is the loads' with the other sign; its power is the rate of kinetic and
    potential energy.
    """
    points, theta = rich_poses
    velocity, acceleration = _motion(len(points))
    payload = np.full(len(points), _PAYLOAD_KG)
    rate, second = drive_rates(_ROBOT, points, velocity, acceleration)
    torque = loads(_ROBOT, _MASSES, _ROBOT.map_at(theta, points), theta, (rate, second), acceleration, payload).drive
    h = 1e-4

    def energy(t):
        position = points + velocity * t + 0.5 * acceleration * t**2
        angle = _ROBOT.inverse(position)
        speed = velocity + acceleration * t
        drive = np.linalg.solve(_ROBOT.actuator_jacobian(position, angle), speed[..., None])[..., 0]
        platform = _MASSES.platform_kg + payload + 1.5 * _MASSES.forearm_kg
        # a uniform rod about its end, and half a forearm at the rod's other end
        rod, point_mass = _MASSES.arm_kg * 400.0**2 / 3.0, 0.5 * _MASSES.forearm_kg * 400.0**2
        kinetic = 0.5 * platform * (speed**2).sum(axis=1) + 0.5 * (rod + point_mass) * (drive**2).sum(axis=1)
        return kinetic / 1000.0 + _potential(angle, position)

    power = (energy(h) - energy(-h)) / (2.0 * h)
    np.testing.assert_allclose(-(torque * rate).sum(axis=1), power, rtol=1e-4, atol=0.5)


def test_legs_carry_the_platform_along_their_forearms(rich_poses):
    points, theta = rich_poses
    _, acceleration = _motion(len(points))
    still, payload = (np.zeros_like(points),) * 2, np.full(len(points), _PAYLOAD_KG)
    force = loads(_ROBOT, _MASSES, _ROBOT.map_at(theta, points), theta, still, acceleration, payload).member_n
    mass = 3.0 + _PAYLOAD_KG + 1.8
    weight = mass * (np.array([0.0, 0.0, GRAVITY_MM_S2]) - acceleration) / 1000.0
    # joint 4 is at the platform's U joint, joint 3 a forearm before it
    passive = _ROBOT.passive_angles(points, theta)
    plane = theta + passive[..., 0]
    cx, cy = _ROBOT.azimuth_cos_sin
    radial = np.cos(plane) * np.cos(passive[..., 1])
    side = np.sin(passive[..., 1])
    forearm = np.stack(
        [radial * cx - side * cy, radial * cy + side * cx, np.sin(plane) * np.cos(passive[..., 1])], axis=-1
    )
    np.testing.assert_allclose(np.einsum("nl,nla->na", force, forearm), -weight, atol=1e-9)


@pytest.mark.parametrize("payload_kg", [0.0, 4.0])
def test_forces_grow_with_the_mass_that_hangs_on_the_platform(rich_poses, payload_kg):
    points, theta = rich_poses
    bare = _at_rest(_ROBOT, theta, points, Masses(1.0, 0.0, 0.0), payload_kg=0.0)
    full = _at_rest(_ROBOT, theta, points, payload_kg=payload_kg)
    np.testing.assert_allclose(full.member_n, bare.member_n * (3.0 + 1.8 + payload_kg), rtol=1e-12)
    np.testing.assert_allclose(full.held_n, bare.held_n * (3.0 + 1.8 + payload_kg), rtol=1e-12)


def test_held_forces_carry_the_load_along_the_lines_from_elbow_to_joint(rich_poses):
    """Independent: the elbow from the definition of the drive arm, the balance of forces at the platform."""
    points, theta = rich_poses
    force = _at_rest(_ROBOT, theta, points).held_n
    total = np.zeros_like(points)
    for leg, azimuth in enumerate(_ROBOT.azimuth_rad):
        out = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        arm = np.cos(theta[:, leg, None]) * out + np.sin(theta[:, leg, None]) * np.array([0.0, 0.0, 1.0])
        line = points + _ROBOT.r_mm * out - _ROBOT.R_mm * out - _ROBOT.L1_mm * arm
        total += force[:, leg, None] * line / np.linalg.norm(line, axis=1, keepdims=True)
    weight = (_MASSES.platform_kg + _PAYLOAD_KG + 1.5 * _MASSES.forearm_kg) * 9.80665
    np.testing.assert_allclose(total, np.tile([0.0, 0.0, -weight], (len(points), 1)), atol=1e-9)


def test_gravity_points_down_in_every_robots_frame():
    assert gravity(_ROBOT).tolist() == [0.0, 0.0, GRAVITY_MM_S2]
    assert gravity(Delta()).tolist() == gravity(Ptt3()).tolist() == [0.0, 0.0, -GRAVITY_MM_S2]


@pytest.mark.parametrize("robot", [Delta(), Ptt3()], ids=["delta", "ptt3"])
def test_legs_without_an_inner_joint_are_held_as_they_are(robot):
    actuators = robot.inverse([robot.legs.home_mm]) if robot.name == "delta" else robot.inverse([[10.0, 5.0, -250.0]])
    load = _at_rest(robot, actuators, robot.forward(actuators))
    np.testing.assert_array_equal(load.held_n, load.member_n)


def test_bars_carry_a_hexapods_own_masses():
    """The bars' forces balance the weight of masses of platform and bars' ends, six equations of statics."""
    angles = np.radians([[-10, 10, 110, 130, 230, 250], [-50, 50, 70, 170, 190, 290]])
    base, plate = (
        radius * np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], axis=1)
        for radius, turns in zip((300.0, 150.0), angles, strict=True)
    )
    own = [PointMass("platform", 4.0, np.array([20.0, -10.0, 30.0]))]
    own += [PointMass(f"leg {k} end", 0.5, np.zeros(3)) for k in range(1, 7)]
    robot = hexapod(base, plate, 400.0, point_masses=tuple(own))
    points = np.add([0.0, 0.0, 400.0], np.random.default_rng(8).uniform(-60.0, 60.0, (20, 3)))
    load = _at_rest(robot, robot.inverse(points), points, Masses(0.0, 0.0, 0.0), payload_kg=0.0)
    for point, found in zip(points, load.member_n, strict=True):
        ends = plate + point
        lines = (ends - base) / np.linalg.norm(ends - base, axis=1, keepdims=True)
        wrenches = np.concatenate([lines, np.cross(ends, lines)], axis=1).T
        weight = np.array([0.0, 0.0, -GRAVITY_MM_S2 / 1000.0])
        places, masses = np.vstack([own[0].at_mm + point, ends]), np.array([4.0, *[0.5] * 6])
        total = np.concatenate([masses.sum() * weight, (masses[:, None] * np.cross(places, weight)).sum(axis=0)])
        np.testing.assert_allclose(found, np.linalg.solve(wrenches, -total), rtol=1e-5, atol=1e-4)


def _file_robot(name, platform):
    return make_mechanism(name, {"mjcf": str(DATA / "models" / f"{name}.xml"), "platform": platform})


def _leaning(robot, lean_rad):
    """The robot of a file on a base that is turned by lean_rad (2,) about the level axes."""
    turn = np.zeros(3)
    turn[level_axes(robot)] = lean_rad
    return replace(robot, up=tuple(Rotation.from_rotvec(-turn).apply(robot.up).tolist()))


@pytest.mark.parametrize(("name", "platform"), [("hexapod", "plate"), ("arm6", "tool0"), ("delta", "plate")])
def test_loads_under_another_weight_are_those_of_a_robot_that_leans_and_carries_more(name, platform):
    robot, extra, lean = _file_robot(name, platform), 0.7, np.array([0.004, -0.003])
    generator = np.random.default_rng(4)
    home = np.asarray(robot.legs.home_drives)
    drives = home + generator.uniform(-0.02, 0.02, (6, len(home))) * np.where(
        np.array(robot.parts.units) == "mm", 200, 1
    )
    points = robot.forward(drives)
    assumed = _at_rest(robot, drives, points)
    slopes = load_slopes(
        robot, _MASSES, robot.map_at(drives, points), drives, np.zeros((6, 3)), np.full(6, _PAYLOAD_KG)
    )
    true = _at_rest(_leaning(robot, lean), drives, points, payload_kg=_PAYLOAD_KG + extra)
    weights = np.array([extra, *lean, *(extra * lean)])
    for load in fields(assumed):
        before, after = getattr(assumed, load.name), getattr(true, load.name)
        found = before + sum(w * getattr(slope, load.name) for w, slope in zip(weights, slopes, strict=True))
        # the weight's length stays, that of its tangent does not
        scale = max(np.abs(after).max(initial=0.0), 1e-9)
        np.testing.assert_allclose(found, after, rtol=0.0, atol=0.5 * (lean**2).sum() * 2.0 * scale)
        assert not after.size or np.abs(after - before).max() > 1e-3 * scale


def test_a_stated_mounting_is_a_turned_base_frame():
    """Loads of an arm whose entry says how it hangs, against the same arm behind a fixed frame that turns it so."""
    rows = [
        {"d_mm": 400.0, "alpha_deg": -90.0, "range_deg": [-150, 150], "mass_kg": 8.0, "com_mm": [0, 150, 0]},
        {"a_mm": 450.0, "range_deg": [-80, 80], "mass_kg": 6.0, "com_mm": [-220, 0, 0]},
        {"a_mm": 400.0, "range_deg": [-90, 70], "mass_kg": 4.0, "com_mm": [-90, 10, 30]},
    ]
    angles = (20.0, -110.0, 35.0)
    turned = make_mechanism("turned", {"dh": [{"rpy_deg": list(angles)}, *rows]})
    against = Rotation.from_euler("xyz", angles, degrees=True).inv().apply([0.0, 0.0, 7.0])
    stated = make_mechanism("stated", {"dh": rows, "up": against.tolist()})
    drives = np.random.default_rng(3).uniform(-1.0, 1.0, (20, 3))
    none = Masses(0.0, 0.0, 0.0)
    expected, found = (_at_rest(robot, drives, robot.forward(drives), none) for robot in (turned, stated))
    np.testing.assert_allclose(found.drive, expected.drive, rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(found.base, axis=1), np.linalg.norm(expected.base, axis=1), rtol=1e-9)
    assert stated.up_stated and not turned.up_stated
    level = make_mechanism("level", {"dh": rows})
    assert np.abs(_at_rest(level, drives, level.forward(drives), none).drive - expected.drive).max() > 1e3
