"""The general model of every robot: its first order against differences of its exact closure, both against the closed
forms, and its statics against potential energies.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rrru.effects.thermal_growth import growth_twists
from rrru.kinematics import singularity
from rrru.kinematics.chain import Poses
from rrru.kinematics.dynamics import GRAVITY_MM_S2, Masses, loads
from rrru.kinematics.legs import TOOL, WORLD
from rrru.robots.cable import cable
from rrru.robots.catalogue import make_mechanism
from rrru.robots.delta import Delta
from rrru.robots.hexapod import hexapod
from rrru.robots.ptt3 import Ptt3
from rrru.robots.rrru3 import Rrru3
from rrru.robots.serial import serial
from tests.formats import humanoid

_COUNT = 100
_HANGING = ((-100.0, -100.0, -310.0), (100.0, 100.0, -150.0))
ROBOTS = {
    "rrru3": (Rrru3(), ((-500.0, -400.0, 450.0), (500.0, 400.0, 950.0))),
    "ptt3_level": (Ptt3(), _HANGING),
    "ptt3_upright": (Ptt3(rail_inclination_rad=np.pi / 2.0), _HANGING),
    "delta": (Delta(), ((-300.0, -300.0, -150.0), (300.0, 300.0, 150.0))),
}
SETS = [(name, kind) for name, (robot, _) in ROBOTS.items() for kind in robot.PARAMETER_NAMES]


def _ring(radius_mm, *degrees):
    """Six points (6, 3) on a circle."""
    angle = np.radians(degrees)
    return radius_mm * np.stack([np.cos(angle), np.sin(angle), np.zeros(6)], axis=1)


# robots without a closed form: six driven bars, an arm with a tool, cables that hold a platform in a plane
GENERAL = {
    "hexapod": hexapod(
        _ring(400.0, 10, 110, 130, 230, 250, 350),
        _ring(250.0, 50, 70, 170, 190, 290, 310),
        500.0,
        tool_mm=(30.0, -20.0, 60.0),
    ),
    "arm": serial(
        [
            {"d": 320.0, "alpha": np.pi / 2.0},
            {"a": 425.0},
            {"a": 392.0, "theta": -0.3},
            {"d": 109.0, "alpha": np.pi / 2.0},
            {"d": 95.0, "alpha": -np.pi / 2.0},
            {"d": 82.0},
        ],
        np.tile([-1.0, 1.0], (6, 1)),
        [0.2, 0.9, -1.3, 0.5, 0.8, 0.1],
        tool_mm=(20.0, 10.0, 70.0),
    ),
    "coupled": make_mechanism("coupled", humanoid.section()),
    "planar_cable": cable(
        [[-600.0, -500.0, 0.0], [600.0, -500.0, 0.0], [50.0, 700.0, 0.0]],
        [[50.0, -60.0, 0.0], [50.0, 60.0, 0.0], [-80.0, 5.0, 0.0]],
        (0.0, 0.0, 100.0),
        planar=True,
    ),
}
# steps of central differences: shift in mm, rotation in rad
_STEPS = np.repeat([5e-3, 2e-5], 3)
every_robot = pytest.mark.parametrize("name", ROBOTS)
every_set = pytest.mark.parametrize(("name", "kind"), SETS)


@dataclass(frozen=True)
class Setting:
    """A robot at 100 poses clear of singularities, of finite twists at all sites but world and tool."""

    robot: object
    position_mm: np.ndarray
    actuators: np.ndarray
    twists: np.ndarray
    poses: Poses

    def closed(self, actuators, twists):
        """Positions (k, n, 3) of the exact closure next to the poses under k rows of values (k, n, ..) and twists."""
        k = len(actuators)
        start = Poses(
            *(np.concatenate([getattr(self.poses, key)] * k) for key in ("position_mm", "turn", "passive")), None, None
        )
        rows = twists.reshape(-1, *twists.shape[2:])
        poses = self.robot.model.solve(actuators.reshape(-1, actuators.shape[-1]), start, rows)
        assert poses.closed.all()
        return poses.point(self.robot.tool_mm).reshape(k, -1, 3)

    def differences(self, along, steps):
        """Central differences (n, 3, k); along: (sign, number, step) to changed values and twists."""
        changed = [along(number, sign * step) for number, step in enumerate(steps) for sign in (1.0, -1.0)]
        moved = self.closed(*(np.stack(part) for part in zip(*changed, strict=True)))
        return np.stack([(moved[2 * k] - moved[2 * k + 1]) / (2.0 * step) for k, step in enumerate(steps)], axis=-1)


def _clear(name, robot=None):
    """A robot, positions (100, 3) clear of both singularities by 0.2, and their actuator values."""
    robot = robot or ROBOTS[name][0]
    points = np.random.default_rng(5).uniform(*ROBOTS[name][1], (1000, 3))
    actuators = robot.inverse(points)
    with np.errstate(invalid="ignore"):
        translational, constraint, _ = robot.singularities(points, actuators)
        clear = (translational > 0.2) & (constraint > 0.2)
    assert clear.sum() >= _COUNT
    return robot, points[clear][:_COUNT], actuators[clear][:_COUNT]


def _about_home(robot):
    """A robot, positions (100, 3) and actuator values about its home pose."""
    low, high = robot.drive_range.T
    share = np.random.default_rng(5).uniform(-0.1, 0.1, (_COUNT, len(low)))
    actuators = robot.legs.home_drives + share * (high - low)
    return robot, robot.forward(actuators), actuators


@pytest.fixture(scope="module", params=[*ROBOTS, *GENERAL])
def setting(request):
    own = request.param in GENERAL
    robot, points, actuators = _about_home(GENERAL[request.param]) if own else _clear(request.param)
    twists = np.random.default_rng(7).normal(size=(_COUNT, len(robot.legs.sites), 6)) * np.repeat([0.3, 2e-3], 3)
    for site in (WORLD, TOOL):
        twists[:, robot.legs.site_numbers[site]] = 0.0
    poses = robot.solve(actuators, points, twists)
    assert poses.closed.all()
    return Setting(robot, points, actuators, twists, poses)


def _inner_sites(robot):
    """All sites but world and tool."""
    return [site for site in robot.legs.sites if site not in (WORLD, TOOL)]


def test_the_response_at_every_site_is_the_closures_slope(setting):
    """Shifts and rotations apart, each relative to the largest over all sites."""
    at = setting.robot.map(setting.actuators, setting.poses, setting.twists)
    off, size = [], []
    for site in _inner_sites(setting.robot):
        number = setting.robot.legs.site_numbers[site]

        def along(component, step, number=number):
            twists = setting.twists.copy()
            twists[:, number, component] += step
            return setting.actuators, twists

        slope = setting.differences(along, _STEPS).reshape(_COUNT, 3, 2, 3)
        response = at.response(site).reshape(_COUNT, 3, 2, 3)
        off.append(np.abs(response - slope).max(axis=(0, 1, 3)))
        size.append(np.abs(slope).max(axis=(0, 1, 3)))
    off, size = np.array(off), np.array(size)
    assert (off.max(axis=0) <= 1e-6 * size.max(axis=0)).all()
    if setting.robot.name not in {robot.name for robot, _ in ROBOTS.values()}:
        return
    # every site moves the platform, except by a turn about a ball joint
    dead = [site.endswith((" ball", " bar", " end")) for site in _inner_sites(setting.robot)]
    assert (size[:, 0] > 1e-3).all() and ((size[:, 1] > 1e-3) == ~np.array(dead)).all()


def test_the_response_of_an_arm_is_the_slope_under_turns_of_half_a_radian():
    robot, points, actuators = _about_home(GENERAL["coupled"])
    twists = np.random.default_rng(8).normal(size=(_COUNT, len(robot.legs.sites), 6)) * np.repeat([5.0, 0.3], 3)
    twists[:, [robot.legs.site_numbers[site] for site in (WORLD, TOOL)]] = 0.0
    own = Setting(robot, points, actuators, twists, robot.solve(actuators, points, twists))
    at = robot.map(actuators, own.poses, twists)
    for site in _inner_sites(robot):

        def along(component, step, number=robot.legs.site_numbers[site]):
            changed = twists.copy()
            changed[:, number, component] += step
            return actuators, changed

        slope = own.differences(along, _STEPS)
        np.testing.assert_allclose(at.response(site), slope, rtol=0.0, atol=1e-6 * np.abs(slope).max())


def test_the_drives_response_is_the_closures_slope(setting):
    units = setting.robot.parts.units

    def along(drive, step):
        actuators = setting.actuators.copy()
        actuators[:, drive] += step
        return actuators, setting.twists

    slope = setting.differences(along, [_STEPS[0] if unit == "mm" else _STEPS[3] for unit in units])
    response = setting.robot.map(setting.actuators, setting.poses, setting.twists).drive_response
    np.testing.assert_allclose(response, slope, rtol=0.0, atol=1e-6 * np.abs(slope).max())


def test_a_drives_own_twist_acts_as_its_value_does(setting):
    at = setting.robot.map(setting.actuators, setting.poses)
    for k, drive in enumerate(setting.robot.parts.drives):
        moved = sum(at.response(site) @ twist for site, twist in drive.twists.items())
        size = np.abs(moved).max()
        np.testing.assert_allclose(moved, at.drive_response[:, :, k], rtol=0.0, atol=1e-9 * size)


@pytest.mark.parametrize("name", ["rrru3", "delta"])
def test_a_leg_turned_about_its_drive_axis_is_a_drive_error(name):
    robot, points, actuators = _clear(name)
    at = robot.map_at(actuators, points)
    for leg, drive in enumerate(robot.parts.drives):
        turned = at.response(f"leg {leg + 1} foot") @ drive.twist
        np.testing.assert_allclose(turned, at.drive_response[:, :, leg], rtol=0.0, atol=1e-9 * np.abs(turned).max())


def test_what_is_beyond_the_first_order_falls_with_the_square(setting):
    """Random twists everywhere at once, small and ten times smaller."""
    robot = setting.robot
    still, at = setting.poses.point(robot.tool_mm), robot.map(setting.actuators, setting.poses, setting.twists)
    draws = np.random.default_rng(3).normal(size=setting.twists.shape) * np.repeat([0.1, 1e-4], 3)
    draws[:, [0, -1]] = 0.0
    left = []
    for factor in (1.0, 0.1):
        moved = setting.closed(setting.actuators[None], (setting.twists + factor * draws)[None])[0]
        left.append(np.abs(moved - still - at.move(factor * draws)).max())
    assert left[1] < 0.02 * left[0] and 1e-6 < left[0] < 0.02


@every_robot
def test_world_and_tool_move_the_reading_as_rigid_motions(name):
    robot, points, actuators = _clear(name)
    at = robot.map_at(actuators, points)
    twists = np.zeros((1, len(robot.legs.sites), 6))
    twists[0, 0], twists[0, -1] = [1.0, -2.0, 0.5, 2e-3, 1e-3, -3e-3], [0.4, -0.3, 0.2, 0.0, 0.0, 0.0]
    exact = robot.measured(robot.solve(actuators, points, twists), twists)
    rigid = Rotation.from_rotvec(twists[0, 0, 3:]).apply(points + twists[0, -1, :3]) + twists[0, 0, :3]
    np.testing.assert_allclose(exact, rigid, rtol=0.0, atol=1e-9)
    small = np.broadcast_to(twists[0, 0, :3] + twists[0, -1, :3], points.shape) + np.cross(twists[0, 0, 3:], points)
    np.testing.assert_allclose(at.move(twists), small, rtol=0.0, atol=1e-9)


def _with_errors(name, kind):
    """A robot with a parameter set, poses and actuator values that fit errors, and these."""
    robot, points, _ = _clear(name, replace(ROBOTS[name][0], parameter_set=kind))
    size = np.where([unit == "rad" for unit in robot.parameters.units], 0.005, 1.0)
    deviations = np.random.default_rng(9).uniform(-1.0, 1.0, len(size)) * size
    return robot, points, robot.inverse(points, deviations), deviations


def _turned(poses):
    """Rotation vectors (n, 3) of platforms that should stand upright."""
    return poses.turned_from(np.broadcast_to(np.eye(3), poses.turn.shape))


@every_set
def test_the_closed_form_is_the_exact_closure(name, kind):
    """Inverse kinematics and then the closure, and the closure against the forward kinematics; nothing turns."""
    robot, points, actuators, deviations = _with_errors(name, kind)
    back = robot.solve(actuators, points, robot.twists(deviations))
    np.testing.assert_allclose(back.position_mm, points, rtol=0.0, atol=1e-9)
    nominal = robot.inverse(points)
    poses = robot.solve(nominal, points, robot.twists(deviations))
    closed = robot.forward(nominal, deviations, points)
    np.testing.assert_allclose(poses.position_mm, closed, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(robot.measured(poses, robot.twists(deviations)), closed, rtol=0.0, atol=1e-9)
    assert np.abs(_turned(poses)).max() < 1e-11
    assert np.linalg.norm(closed - points, axis=1).min() > 1e-3


@every_set
def test_the_maps_columns_are_the_closed_forms_jacobian(name, kind):
    robot, points, actuators, deviations = _with_errors(name, kind)
    at = robot.map_at(actuators, points, deviations)
    exact = robot.parameter_jacobian(points, actuators, deviations)
    np.testing.assert_allclose(at.columns(robot.directions), exact, rtol=0.0, atol=1e-9 * max(np.abs(exact).max(), 1.0))
    exact = robot.actuator_jacobian(points, actuators, deviations)
    np.testing.assert_allclose(at.drive_response, exact, rtol=0.0, atol=1e-9 * max(np.abs(exact).max(), 1.0))


@every_set
def test_deviations_by_name_are_those_of_the_vector(name, kind):
    robot = replace(ROBOTS[name][0], parameter_set=kind)
    deviations = np.random.default_rng(2).normal(size=len(robot.parameters))
    by_name = robot.twists_of(robot.parameters.mapping(deviations))
    np.testing.assert_allclose(by_name, robot.twists(deviations), rtol=0.0, atol=1e-12)
    assert by_name.any() and set(robot.parameters.names) <= set(robot.deviation_names)
    np.testing.assert_array_equal(robot.twists(), np.zeros_like(by_name))


@every_robot
def test_nominal_robots_close_upright_where_they_are_sent(name):
    robot, points, actuators = _clear(name)
    near = points + np.array([20.0, -10.0, 15.0])
    known = np.isfinite(robot.inverse(near)).all(axis=1)
    poses = robot.solve(actuators, near)
    assert poses.closed[known].all() and known.mean() > 0.9
    np.testing.assert_allclose(poses.position_mm[known], points[known], rtol=0.0, atol=1e-9)
    assert np.abs(_turned(poses)[known]).max() < 1e-12


@every_robot
def test_growth_makes_the_robot_similar(name):
    """Every length longer by one share moves the platform along the ray from the base's centre."""
    robot, points, actuators = _clear(name)
    share, twists = 1e-3, growth_twists(robot.legs)[None]
    poses = robot.solve(_grown(robot, actuators, share), points, share * twists)
    foot = np.array([0.0, 0.0, getattr(robot, "origin_depth_mm", 0.0)])
    np.testing.assert_allclose(poses.position_mm, foot + (1.0 + share) * (points - foot), rtol=0.0, atol=1e-9)


def _grown(robot, actuators, share):
    """Actuator values of a grown robot at the same angles: sliders go further, too."""
    return actuators * (1.0 + share) if robot.parts.units[0] == "mm" else actuators


@every_robot
def test_the_translational_measure_is_that_of_the_drives_jacobian(name):
    robot, points, actuators = _clear(name)
    at = robot.map_at(actuators, points)
    size = np.linalg.svd(robot.actuator_jacobian(points, actuators), compute_uv=False)
    np.testing.assert_allclose(at.translational_measure(1.0), size[:, -1] / size[:, 0], rtol=1e-9)
    measure, determinant = at.constraint_measures(robot.characteristic_length_mm)
    assert (measure > 1e-3).all() and (measure < 1.0).all() and (np.abs(determinant) > 0.0).all()


def test_bars_keep_the_sign_of_the_constraint_determinant_where_nothing_is_singular():
    robot, points, actuators = _clear("delta")
    _, determinant = robot.map_at(actuators, points).constraint_measures(robot.characteristic_length_mm)
    assert np.unique(np.sign(determinant)).size == 1


def test_the_general_constraint_measure_vanishes_where_the_closed_ones_determinant_changes_its_sign():
    robot = Rrru3()
    points = np.stack([np.linspace(-800.0, -700.0, 101), np.zeros(101), np.full(101, 600.0)], axis=1)
    actuators = robot.inverse(points)
    measure, _ = robot.map_at(actuators, points).constraint_measures(robot.characteristic_length_mm)
    change = np.flatnonzero(np.diff(np.sign(singularity.constraint_determinant(robot, points, actuators))))
    assert len(change) == 1 and measure.argmin() in (change[0], change[0] + 1)
    assert measure.min() < 0.05 * measure.max()


def test_the_general_constraint_measure_vanishes_in_the_plane_of_level_rails():
    robot, points = Ptt3(), np.array([[20.0, 10.0, -200.0], [20.0, 10.0, -0.5], [20.0, 10.0, -0.05]])
    measure, _ = robot.map_at(robot.inverse(points), points).constraint_measures(robot.characteristic_length_mm)
    assert measure[0] > 0.01 and measure[1] < 0.01 * measure[0] and measure[2] < 0.11 * measure[1]


_MASSES, _PAYLOAD_KG = Masses(2.0, 0.8, 1.5), 3.0
# share of its length at which a drive arm's weight acts, and where its outer end is above its axis
_DRIVEN = {
    "rrru3": (0.5, lambda robot, theta: -robot.L1_mm * np.sin(theta)),
    "ptt3_level": (1.0, lambda _, slider: np.zeros_like(slider)),
    "ptt3_upright": (1.0, lambda _, slider: slider),
    "delta": (0.5, lambda robot, theta: -robot.l1_mm * np.sin(theta)),
}


def _energy(name, robot, actuators, points, twists=None):
    """Potential energy (n,) in N mm of the lumped masses at the exact closure."""
    share, height = _DRIVEN[name]
    platform = robot.solve(actuators, points, twists).position_mm @ robot.up
    carried = (_MASSES.platform_kg + _PAYLOAD_KG + 1.5 * _MASSES.forearm_kg) * platform
    driven = (share * _MASSES.arm_kg + 0.5 * _MASSES.forearm_kg) * height(robot, actuators).sum(axis=1)
    return (carried + driven) * GRAVITY_MM_S2 / 1000.0


def _still(robot, points, actuators):
    """Loads at rest."""
    nothing = np.zeros_like(points)
    payload = np.full(len(points), _PAYLOAD_KG)
    return loads(robot, _MASSES, robot.map_at(actuators, points), actuators, (nothing, nothing), nothing, payload)


@every_robot
def test_static_drive_loads_are_the_slopes_of_the_potential_energy(name):
    robot, points, actuators = _clear(name)
    load = _still(robot, points, actuators).drive
    step = 0.05 if robot.parts.units[0] == "mm" else 1e-4
    for k in range(3):
        change = step * np.eye(3)[k]
        slope = _energy(name, robot, actuators + change, points) - _energy(name, robot, actuators - change, points)
        np.testing.assert_allclose(load[:, k], -slope / (2.0 * step), rtol=1e-5, atol=1e-6 * np.abs(load).max())


@every_robot
def test_static_member_forces_are_the_slopes_of_the_potential_energy_by_their_lengths(name):
    """A member that grows by dL under locked drives does the work f dL on the weight."""
    robot, points, actuators = _clear(name)
    force, step = _still(robot, points, actuators).member_n, 0.05
    assert force.shape == (_COUNT, 3)
    for k, group in enumerate(robot.parts.members):
        twists = np.zeros((1, len(robot.legs.sites), 6))
        twists[0, [robot.legs.site_numbers[site] for site in group], 0] = step
        slope = _energy(name, robot, actuators, points, twists) - _energy(name, robot, actuators, points, -twists)
        np.testing.assert_allclose(force[:, k], slope / (2.0 * step), rtol=1e-5, atol=1e-6 * np.abs(force).max())
    assert np.abs(force).max() > 10.0


@every_robot
def test_the_legs_wrenches_bear_any_load(name):
    robot, points, actuators = _clear(name)
    load = np.random.default_rng(1).normal(size=(_COUNT, 6)) * np.repeat([10.0, 3000.0], 3)
    wrenches = robot.map_at(actuators, points).wrenches(load)
    np.testing.assert_allclose(wrenches.sum(axis=0), -load, rtol=0.0, atol=1e-6)


def test_a_hexapods_bars_carry_its_weight_and_load_their_drives():
    """Virtual work with the drives, which are the members' lengths; the load sits on the platform's own point."""
    robot, points, actuators = _about_home(replace(GENERAL["hexapod"], tool_mm=(0.0, 0.0, 0.0)))
    nothing, step = np.zeros_like(actuators), 0.05
    payload = np.full(_COUNT, _PAYLOAD_KG)
    load = loads(
        robot, _MASSES, robot.map_at(actuators, points), actuators, (nothing, nothing), np.zeros_like(points), payload
    )
    # half of each of six legs hangs on the platform
    weight = (_MASSES.platform_kg + _PAYLOAD_KG + 3.0 * _MASSES.forearm_kg) * GRAVITY_MM_S2 / 1000.0
    for k in range(6):
        change = step * np.eye(6)[k]
        rise = robot.forward(actuators + change)[:, 2] - robot.forward(actuators - change)[:, 2]
        np.testing.assert_allclose(load.member_n[:, k], weight * rise / (2.0 * step), rtol=1e-5, atol=1e-4)
        np.testing.assert_allclose(load.drive[:, k], -load.member_n[:, k], rtol=1e-9, atol=1e-9)
    assert np.abs(load.member_n).max() > 10.0


@pytest.mark.parametrize("leg", [1, 2, 3])
def test_equal_bars_do_not_tilt_a_delta_and_unequal_ones_do(leg):
    """The bars of an arm, `spacing` apart, turn the platform by their difference over it about what they resist."""
    robot, points, actuators = _clear("delta")
    number, difference = robot.legs.site_numbers, 0.2
    equal, unequal = np.zeros((2, 1, len(robot.legs.sites), 6))
    equal[0, [number[f"leg {leg} {bar} bar"] for bar in "ab"], 0] = difference
    unequal[0, number[f"leg {leg} b bar"], 0] = difference
    level = robot.solve(actuators, points, equal)
    assert np.abs(_turned(level)).max() < 1e-12
    assert np.linalg.norm(level.position_mm - points, axis=1).min() > 0.5 * difference
    tilted = _turned(robot.solve(actuators, points, unequal))
    # only this arm's couple is fed: l . (w x s t) = difference, and the other two keep b . w = 0
    link, tangent = robot.link_directions(points, actuators)[:, leg - 1], robot.tangent[leg - 1]
    across = robot.constraint_moments(points, actuators)
    right = np.zeros((_COUNT, 3))
    right[:, leg - 1] = difference / (robot.spacing_mm * np.linalg.norm(np.cross(tangent, link), axis=1))
    expected = np.linalg.solve(across, right[:, :, None])[:, :, 0]
    np.testing.assert_allclose(tilted, expected, rtol=0.0, atol=0.02 * np.abs(expected).max())
    size = np.linalg.norm(tilted, axis=1) * robot.spacing_mm / difference
    assert (size > 0.9).all() and np.median(size) < 1.5
