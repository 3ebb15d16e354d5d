"""Arms on one trunk, each with its own end effector: against products of matrices, their slopes and their energy."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from rrru.calibration.calibrate import calibrate
from rrru.effects.library import library
from rrru.effects.motion import Course, make_motion
from rrru.errors import ConfigError
from rrru.estimation.observations.target_positions import TargetPositions
from rrru.kinematics.base_parameters import MeasurementConfig
from rrru.kinematics.dynamics import GRAVITY_MM_S2, Masses, gravity
from rrru.kinematics.readings import Readings, reading_residual
from rrru.robots.catalogue import make_mechanism
from tests.formats.mjcf import file_of
from tests.places import ROOT
from tests.robots import two_arms

ROBOT = make_mechanism("two_arms", two_arms.section())
COUNT = 40
DRIVES = ROBOT.legs.home_drives + np.random.default_rng(2).uniform(-0.5, 0.5, (COUNT, len(two_arms.DRIVES)))
ARM = np.array(["right", "left"] * COUNT)[:COUNT]
SITES = {arm: f"reflector {arm}" for arm in two_arms.HANDS}
_STEPS = np.repeat([1e-2, 1e-5], 3)


def _own():
    """Positions (n, 3) of the end effectors in turn, by products of matrices."""
    return np.array([two_arms.seen(q, arm) for q, arm in zip(DRIVES, ARM, strict=True)])


def _readings(position_mm):
    places = np.array([two_arms.MARKERS[arm] for arm in ARM])
    return Readings(position_mm, np.array([SITES[arm] for arm in ARM]), places)


def _motion(robot=ROBOT, payload_kg=0.0):
    """The robot at rest at DRIVES, end effectors in turn."""
    position, still = robot.guess(DRIVES, ARM), np.zeros((COUNT, 3))
    rest, every = np.zeros_like(DRIVES), np.arange(COUNT)
    course = Course(position, DRIVES, DRIVES, every, every, still, still, np.full(COUNT, payload_kg), (rest, rest))
    return make_motion(robot, Masses(0.0, 0.0, 0.0), course)


def test_each_hand_stands_where_products_of_its_matrices_do():
    assert ROBOT.parts.columns == [f"{name}_rad" for name in two_arms.DRIVES]
    assert [one.site for one in ROBOT.parts.followers] == ["chest"]
    np.testing.assert_allclose(ROBOT.guess(DRIVES, ARM), _own(), rtol=0.0, atol=1e-9)
    poses = ROBOT.solve(DRIVES, _own())
    np.testing.assert_array_equal(poses.leg, np.where(ARM == "right", 0, 1))
    np.testing.assert_allclose(poses.position_mm, _own(), rtol=0.0, atol=1e-9)
    turns = [two_arms.frames(q)[arm][:3, :3] for q, arm in zip(DRIVES, ARM, strict=True)]
    np.testing.assert_allclose(poses.turn, turns, rtol=0.0, atol=1e-12)


def test_the_hand_is_the_nominally_nearest_and_the_first_without_a_position():
    off = _own() + np.random.default_rng(3).normal(size=(COUNT, 3)) * 30.0
    np.testing.assert_allclose(ROBOT.forward(DRIVES, guess_mm=off), _own(), rtol=0.0, atol=1e-9)
    right = [two_arms.seen(q, "right") for q in DRIVES]
    np.testing.assert_allclose(ROBOT.forward(DRIVES), right, rtol=0.0, atol=1e-9)


def test_what_nobody_knows_is_no_pose():
    drives = DRIVES.copy()
    drives[3] = np.nan
    assert ROBOT.solve(drives, _own()).closed.tolist() == [k != 3 for k in range(COUNT)]
    # nor is one of an end effector that nobody knows
    near = _own().copy()
    near[5, 1] = np.nan
    assert ROBOT.solve(DRIVES, near).closed.tolist() == [k != 5 for k in range(COUNT)]


def test_the_effect_of_every_site_and_drive_is_the_slope_of_what_is_read():
    """Against central differences through the exact chains, with finite twists at all sites."""
    robot = ROBOT.with_measurement_config(MeasurementConfig(tuple(SITES.values()), tuple(SITES.values()), frame=True))
    generator = np.random.default_rng(4)
    twists = generator.normal(size=(COUNT, len(robot.legs.sites), 6)) * np.repeat([0.5, 5e-3], 3)
    poses, readings = robot.solve(DRIVES, _own(), twists), _readings(_own())
    at = robot.map(DRIVES, poses, twists, readings)

    def read(drives, twists):
        return -reading_residual(robot, readings, robot.model.solve(drives, poses, twists), twists)

    for number, site in enumerate(robot.legs.sites):
        for k, step in enumerate(_STEPS):
            up, down = twists.copy(), twists.copy()
            up[:, number, k] += step
            down[:, number, k] -= step
            slope = (read(DRIVES, up) - read(DRIVES, down)) / (2.0 * step)
            np.testing.assert_allclose(at.effect(site)[:, :, k], slope, rtol=1e-6, atol=2e-5, err_msg=f"{site} {k}")
    for k, step in enumerate(1e-5 * np.eye(len(two_arms.DRIVES))):
        slope = (read(DRIVES + step, twists) - read(DRIVES - step, twists)) / 2e-5
        np.testing.assert_allclose(at.drive_effect[:, :, k], slope, rtol=1e-6, atol=2e-5)


def test_a_site_of_the_other_arm_changes_nothing():
    at = ROBOT.map(DRIVES, ROBOT.solve(DRIVES, _own()))
    for arm, other in (("right", "left"), ("left", "right")):
        for site in (*two_arms.ARMS[other], f"{other} flange", f"{other} frame 7"):
            assert np.abs(at.effect(site)[arm == ARM]).max() == 0.0
            assert np.abs(at.effect(site)[other == ARM]).max() > 0.1


def test_static_loads_are_the_slopes_of_the_potential_energy_of_the_whole_tree():
    """Of the drives with their followers and of the chest alone, whichever end effector is read."""
    motion, h = _motion(), 1e-4
    for k, q in enumerate(DRIVES[:10]):
        steps = h * np.eye(len(q))
        slope = [(two_arms.energy(q + step) - two_arms.energy(q - step)) / (2.0 * h) for step in steps]
        np.testing.assert_allclose(motion.drive_load[k], -np.array(slope), rtol=1e-5, atol=0.1)
        chest = (two_arms.energy(q, {"chest": h}) - two_arms.energy(q, {"chest": -h})) / (2.0 * h)
        np.testing.assert_allclose(motion.follower_load[k], [-chest], rtol=1e-5, atol=0.1)


def test_moments_across_joints_are_those_of_all_that_hangs_behind_them():
    """Of a payload as well, on the arm whose end effector is read."""
    motion, names = _motion(payload_kg=4.0), ROBOT.legs.arm_joints
    assert names == (*two_arms.TRUNK, *two_arms.ARMS["right"], *two_arms.ARMS["left"])
    down = np.array([0.0, 0.0, -GRAVITY_MM_S2 / 1e3])
    for k, (q, arm) in enumerate(zip(DRIVES[:6], ARM, strict=False)):
        at = two_arms.frames(q)
        points = [(name, mass, (at[name] @ [*com, 1.0])[:3]) for name, (mass, com) in two_arms.masses()]
        points.append((arm, 4.0, at[arm][:3, 3]))
        for j, name in enumerate(names):
            arm = next((own for own, rows in two_arms.ARMS.items() if name in rows), None)
            order = [*two_arms.TRUNK, *(two_arms.ARMS[arm] if arm else ()), *((arm,) if arm else ())]
            behind = set(order[order.index(name) :]) | (set() if arm else set(at) - set(two_arms.TRUNK))
            # a joint's own frame is on its axis, shifted along it at most
            z, seat = at[name][:3, 2], at[name][:3, 3] - _slide(name) * at[name][:3, 2]
            moment = sum(np.cross(place - seat, mass * down) for own, mass, place in points if own in behind)
            across = moment - (moment @ z) * z
            np.testing.assert_allclose(np.linalg.norm(motion.across[k, j]), np.linalg.norm(across), rtol=1e-5, atol=1.0)


def _slide(name):
    """Craig's d of a row."""
    return next(rows[name][0][0] for rows in (two_arms.TRUNK, *two_arms.ARMS.values()) if name in rows)


def test_compliance_turns_the_joints_of_trunk_and_arms():
    """Exactly: springs at all joints against products of matrices with turned joints."""
    motion, effect = _motion(), library(ROBOT)["drive_compliance"]
    values = np.random.default_rng(3).uniform(1e-8, 1e-7, len(effect.parameters))
    twists = effect.contribute(motion, values).twists
    found = ROBOT.measured(ROBOT.solve(DRIVES, _own(), twists), twists)
    wound = DRIVES + values[:-1] * motion.drive_load
    for k, arm in enumerate(ARM):
        at = two_arms.frames(wound[k], {"chest": values[-1] * motion.follower_load[k, 0]})
        np.testing.assert_allclose(found[k], at[arm][:3, 3], rtol=0.0, atol=1e-8)
    assert np.abs(values * np.c_[motion.drive_load, motion.follower_load]).max() > 1e-3


def test_every_effect_of_arms_is_one_of_a_robot_with_hands():
    effects = library(ROBOT)
    assert {"joint_axis_error", "transmission_error", "encoder_eccentricity", "link_flexure", "backlash"} <= set(
        effects
    )
    assert len(effects["link_flexure"].parameters) == len(two_arms.DRIVES) + 1
    assert len(effects["transmission_error"].coordinates) == 2 * len(two_arms.DRIVES)


def test_both_hands_tell_a_full_set_of_parameters():
    """Shoulders off by tens of mrad, everything else by millimetres and milliradians, in a frame of the instrument."""
    generator = np.random.default_rng(5)
    reads = MeasurementConfig(tuple(SITES.values()), tuple(SITES.values()), frame=True)
    robot = replace(ROBOT, parameter_set="full", angle_limit_rad=0.5, length_limit_mm=200.0).with_measurement_config(
        reads
    )
    readings = _readings(_own())
    robot = robot.with_identifiable_parameters(DRIVES, _own(), readings)
    sizes = np.where(np.array(robot.parameters.units) == "mm", 3.0, 5e-3)
    true = sizes * generator.uniform(-1.0, 1.0, len(sizes))
    for name in ("dright0", "dright1", "dleft0", "dleft1"):
        true[robot.parameters.index(name)] = generator.choice([-1.0, 1.0]) * 0.05
    twists = robot.twists(true)
    seen = robot.measured(robot.solve(DRIVES, _own(), twists), twists, readings)
    fit = calibrate(TargetPositions(robot, DRIVES, seen, _own(), replace(readings, position_mm=seen)))
    assert len(true) > 45 and fit.identifiability.rank == len(true)
    assert np.abs(fit.residual_mm).max() < 1e-6
    np.testing.assert_allclose(fit.deviations / sizes, true / sizes, rtol=0.0, atol=1e-4)


def test_frames_alone_are_a_set_of_parameters():
    reads = MeasurementConfig(tuple(SITES.values()), tuple(SITES.values()), frame=True)
    robot = (
        replace(ROBOT, parameter_set="frame")
        .with_measurement_config(reads)
        .with_identifiable_parameters(DRIVES, _own(), _readings(_own()))
    )
    assert len(robot.parameters) == 12
    assert {name.rpartition("_")[0] for name in robot.parameters.names} == {
        "reflector_right",
        "reflector_left",
        "world",
    }


def test_a_urdf_with_several_tips_is_the_same_robot(tmp_path):
    path = file_of(tmp_path, two_arms.urdf_text(), "two_arms.urdf")
    robot = make_mechanism("two_arms", {"urdf": str(path), "tips": {"right": "right", "left": "left"}})
    order = [two_arms.DRIVES.index(column.removesuffix("_rad")) for column in robot.parts.columns]
    np.testing.assert_allclose(robot.guess(DRIVES[:, order], ARM), _own(), rtol=0.0, atol=1e-7)
    turned = {"chest", "chest_turned"}
    assert turned == {one.site for one in robot.parts.followers} and turned <= set(robot.legs.arm_joints)
    poses = robot.solve(DRIVES[:, order], _own())
    load = robot.own_load(None, (DRIVES[:, order], 0.0 * DRIVES, 0.0 * DRIVES), poses, gravity(robot))
    drives = robot.legs.per_actuator(load)
    np.testing.assert_allclose(drives, _motion().drive_load[:, order], rtol=1e-5, atol=0.1)
    assert sum(point_mass.mass_kg for point_mass in robot.point_masses) == pytest.approx(
        sum(mass for _, (mass, _) in two_arms.masses())
    )
    np.testing.assert_array_equal(robot.velocity_limits, np.ones(len(order)))
    np.testing.assert_array_equal(robot.effort_limits, np.full(len(order), 1e3))


def test_a_key_says_what_a_hand_carries():
    robot = make_mechanism("two_arms", two_arms.section(carries={"right": ["r1", "r2"]}))
    assert robot.legs.end_effectors == (("r1", "r2"), ("left",))
    np.testing.assert_allclose(
        robot.guess(DRIVES[:2], ["r2", "left"]), [two_arms.seen(DRIVES[0], "right"), two_arms.seen(DRIVES[1], "left")]
    )


def test_the_schema_of_the_configuration_knows_hands():
    from snakemake.utils import validate

    config = yaml.safe_load((ROOT / "config.yaml").read_text())
    tips = {"urdf": "two_arms.urdf", "tips": {"right": "r", "left": "l"}}
    config["robots"] |= {"mine": two_arms.section(carries={"right": ["r1"]}), "tree": tips}
    validate(config, str(ROOT / "rrru/pipeline/config.schema.yaml"))
    config["robots"]["mine"]["hands"]["left"][1]["nothing"] = 1.0
    with pytest.raises(Exception, match="nothing"):
        validate(config, str(ROOT / "rrru/pipeline/config.schema.yaml"))


def _without(section, key):
    return {name: value for name, value in section.items() if name != key}


@pytest.mark.parametrize(
    ("section", "message"),
    [
        (two_arms.section(carries={"third": ["r1"]}), "targets of 'third'; allowed: right, left"),
        (two_arms.section(carries={"right": ["left"]}), "targets left, left; allowed: one or more different names"),
        (two_arms.section(hands={"right": two_arms.section()["hands"]["right"]}), "hands right; allowed: two or more"),
        (_without(two_arms.section(carries={"right": ["r"]}), "hands"), "hands none; allowed: two or more"),
        (
            two_arms.section(hands=dict.fromkeys(two_arms.HANDS, two_arms.section()["hands"]["right"])),
            "two arms have a joint 'right",
        ),
    ],
)
def test_a_wrong_description_is_refused(section, message):
    with pytest.raises(ConfigError, match=message):
        make_mechanism("two_arms", section)


def test_a_target_that_no_hand_carries_is_refused():
    with pytest.raises(ConfigError, match="no end effector carries the target 'third'; allowed: right, left"):
        ROBOT.guess(DRIVES, ["third"] * COUNT)


def test_orientation_of_each_hand_is_read():
    """Rotation vectors of end effectors that are turned at their flanges."""
    numbers, poses = ROBOT.legs.site_numbers, ROBOT.solve(DRIVES, _own())
    twists = ROBOT.twists()
    twists[0, numbers["left flange"], 3:] = [0.01, -0.02, 0.005]
    turn = poses.turn.copy()
    turn[ARM == "left"] = turn[ARM == "left"] @ Rotation.from_rotvec([0.01, -0.02, 0.005]).as_matrix()
    readings = Readings(_own(), turn=turn, characteristic_length_mm=500.0)
    left = reading_residual(ROBOT, readings, ROBOT.solve(DRIVES, _own(), twists), twists)
    np.testing.assert_allclose(left, 0.0, atol=1e-6)
