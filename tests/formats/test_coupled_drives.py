"""Joints that follow drives: an arm on a torso whose passive joint does, against products of matrices and MuJoCo."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rrru.calibration.calibrate import calibrate
from rrru.effects.library import library
from rrru.effects.motion import Course, make_motion
from rrru.errors import ConfigError
from rrru.estimation.observations.target_positions import TargetPositions
from rrru.formats.robot_file import from_mjcf, from_urdf
from rrru.kinematics.dynamics import GRAVITY_MM_S2, Masses
from rrru.kinematics.point_masses import driven_loads, places
from rrru.robots.catalogue import make_mechanism
from rrru.robots.serial import serial
from tests.formats import humanoid
from tests.formats.mjcf import FOUR_BAR, GEOM, TREE, joint_of, mjcf, servos, urdf

ROBOT = make_mechanism("humanoid", humanoid.section())
DRAWS = np.random.default_rng(1).uniform(-1.4, 1.4, (60, 10))
NEAR = ROBOT.legs.home_drives + np.random.default_rng(2).uniform(-0.4, 0.4, (60, 10))


def test_the_chain_stands_where_products_of_its_matrices_do():
    np.testing.assert_allclose(ROBOT.forward(DRAWS), [humanoid.marker(q) for q in DRAWS], rtol=0.0, atol=1e-9)
    assert ROBOT.parts.columns == [f"{name}_rad" for name in humanoid.DRIVES]
    assert [one.site for one in ROBOT.parts.followers] == ["chest"]


def test_the_chest_stays_upright():
    turn = np.array([humanoid.frames(q)[3][:3, :3] for q in DRAWS])
    level = turn[0].T @ [0.0, 0.0, 1.0]
    np.testing.assert_allclose(turn @ level, np.tile([0.0, 0.0, 1.0], (len(DRAWS), 1)), atol=1e-12)


def test_the_urdf_with_mimics_is_the_same_robot(tmp_path):
    path = humanoid.urdf_file(tmp_path)
    robot = from_urdf(path, tool_mm=humanoid.MARKER_MM)
    assert robot.parts.columns == ROBOT.parts.columns
    np.testing.assert_allclose(robot.forward(DRAWS), ROBOT.forward(DRAWS), rtol=0.0, atol=1e-9)
    poses = robot.solve(DRAWS, np.zeros((len(DRAWS), 3)))
    np.testing.assert_allclose(poses.turn, [humanoid.frames(q)[-1][:3, :3] for q in DRAWS], rtol=0.0, atol=1e-12)
    assert {one.site for one in robot.parts.followers} == {"chest", "chest_turned"}


def test_the_inverse_finds_back():
    positions, poses = ROBOT.forward(NEAR[:8]), ROBOT.solve(NEAR[:8], np.zeros((8, 3)))
    found = ROBOT.inverse(positions, turn=poses.turn)
    np.testing.assert_allclose(ROBOT.forward(found), positions, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(ROBOT.solve(found, positions).turn, poses.turn, atol=1e-7)


def test_masses_are_where_the_rows_frames_carry_them():
    poses = ROBOT.solve(DRAWS, np.zeros((len(DRAWS), 3)))
    expected = [
        [
            1e3 * (frame @ [*com, 1.0])[:3]
            for frame, (_, com) in zip(humanoid.frames(q)[:-1], humanoid.MASSES, strict=True)
        ]
        for q in DRAWS
    ]
    np.testing.assert_allclose(places(ROBOT, DRAWS, poses), expected, rtol=0.0, atol=1e-9)


def _energy(drives, chest_rad=0.0):
    """Potential energy in N mm of the links' masses, the chest's joint turned further."""
    frames = humanoid.frames(drives)
    turned = np.eye(4)
    turned[:3, :3] = Rotation.from_euler("z", chest_rad).as_matrix()
    behind = frames[3] @ turned @ np.linalg.inv(frames[3])
    moved = [*frames[:3], *(behind @ frame for frame in frames[3:-1])]
    heights = [(frame @ [*com, 1.0])[2] for frame, (_, com) in zip(moved, humanoid.MASSES, strict=True)]
    return GRAVITY_MM_S2 * sum(mass * z for z, (mass, _) in zip(heights, humanoid.MASSES, strict=True))


def _motion(robot, drives):
    """A robot that rests at drive values (n, K)."""
    position, still, n = robot.forward(drives), np.zeros((len(drives), 3)), len(drives)
    rest = np.zeros_like(drives)
    course = Course(position, drives, drives, np.arange(n), np.arange(n), still, still, np.zeros(n), (rest, rest))
    return make_motion(robot, Masses(0.0, 0.0, 0.0), course)


def test_static_loads_are_the_slopes_of_the_potential_energy():
    """Of the drives with all that follows them, and of the chest's joint alone."""
    motion, h = _motion(ROBOT, NEAR[:10]), 1e-4
    for k, drives in enumerate(NEAR[:10]):
        steps = h * np.eye(10)
        slope = [(_energy(drives + step) - _energy(drives - step)) / (2.0 * h) for step in steps]
        np.testing.assert_allclose(motion.drive_load[k], -np.array(slope), rtol=1e-5, atol=0.1)
        chest = (_energy(drives, h) - _energy(drives, -h)) / (2.0 * h)
        np.testing.assert_allclose(motion.follower_load[k], -chest, rtol=1e-5, atol=0.1)


def test_compliance_acts_at_drives_and_at_the_chest():
    """To first order: drives that err, by products of matrices, and a chest that turns further by its own load."""
    motion, effect = _motion(ROBOT, NEAR[:10]), library(ROBOT)["drive_compliance"]
    assert len(effect.parameters) == 11 and effect.parameters.names[-1] == "compliance11"
    values = np.random.default_rng(3).uniform(1e-10, 3e-10, 11)
    twists = effect.contribute(motion, values).twists
    found = ROBOT.measured(ROBOT.solve(motion.drive, motion.position_mm, twists), twists)
    chest = values[10] * motion.follower_load[:, 0]
    for k, drives in enumerate(motion.drive + values[:10] * motion.drive_load):
        frames, turned = humanoid.frames(drives), np.eye(4)
        turned[:3, :3] = Rotation.from_euler("z", chest[k]).as_matrix()
        tool = frames[3] @ turned @ np.linalg.inv(frames[3]) @ frames[-1]
        expected = 1e3 * (tool @ [*np.asarray(humanoid.MARKER_MM) / 1e3, 1.0])[:3]
        np.testing.assert_allclose(found[k], expected, rtol=0.0, atol=1e-9)
    assert np.abs(chest).min() > 1e-7


def test_a_link_behind_a_joint_that_follows_grows_with_the_drive_before_it():
    """An arm whose hand a parallelogram holds level, against the same arm with the longer lengths."""
    turning = {"range_deg": [-90, 90]}
    lengths, strain, constant_s = np.array([500.0, 400.0, 300.0, 80.0]), np.array([1e-4, 3e-4, 2e-4]), 600.0

    def arm(lengths_mm):
        rows = [{"d_mm": lengths_mm[0], "alpha_deg": 90.0, **turning}]
        rows += [{"a_mm": lengths_mm[1], **turning}, {"a_mm": lengths_mm[2], **turning}]
        rows += [{"a_mm": lengths_mm[3], "drives": {"q2": -1, "q3": -1}}]
        return make_mechanism("level", {"dh": rows})

    robot, drives = arm(lengths), np.random.default_rng(7).uniform(-1.0, 1.0, (10, 3))
    effect, motion = library(robot)["link_growth"], replace(_motion(robot, drives), time_s=np.full(10, 1e6))
    twists = effect.contribute(motion, np.array([*strain, constant_s])).twists
    found = robot.measured(robot.solve(drives, motion.position_mm, twists), twists)
    longer = arm(lengths * (1.0 + strain[[0, 1, 2, 2]]))
    np.testing.assert_allclose(found, longer.forward(drives), rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("name", ["backlash", "encoder_eccentricity", "transmission_error", "servo_lag"])
def test_what_errs_at_a_drive_moves_the_chest_as_well(name):
    """An effect's twists are those of changed drive values."""
    motion, effect = _motion(ROBOT, NEAR[:10]), library(ROBOT)[name]
    values = np.random.default_rng(4).uniform(0.2, 0.8, len(effect.parameters))
    values = effect.parameters.low + values * (effect.parameters.high - effect.parameters.low)
    values = np.where(np.array(effect.parameters.units) == "rad", 1e-3 * values, values)
    motion = replace(motion, drive_rate=np.random.default_rng(5).normal(size=(10, 10)))
    twists = effect.contribute(motion, values).twists
    changes = ROBOT.drive_errors(twists)
    assert np.abs(changes).max() > 0.0
    found = ROBOT.measured(ROBOT.solve(motion.drive, motion.position_mm, twists), twists)
    np.testing.assert_allclose(found, ROBOT.forward(motion.drive + changes), rtol=0.0, atol=1e-9)


def test_the_chests_axis_is_one_of_those_that_may_be_off():
    names = library(ROBOT)["joint_axis_error"].parameters.names
    assert {f"{kind}_{axis}_chest" for kind in ("shift", "tilt") for axis in "xy"} <= set(names)


def test_a_full_calibration_finds_a_wrong_robot():
    """The errors of drives, chest and links are found, except unidentifiable ones; 60 poses, no noise."""
    full = replace(ROBOT, parameter_set="full", angle_limit_rad=0.3, length_limit_mm=100.0)
    robot = full.with_identifiable_parameters(NEAR, ROBOT.forward(NEAR))
    names = robot.parameters.names
    # the torso's offsets and the chest's own are separable
    assert {"dtorso1", "dtorso2", "dright3"} <= set(names) and len(names) > 40
    generator = np.random.default_rng(6)
    sizes = {one.name: 1.0 if one.unit == "mm" else 0.005 for one in robot.candidates}
    truth = {name: size * generator.normal() for name, size in sizes.items()}
    twists = robot.twists_of(truth)
    measured = robot.measured(robot.solve(NEAR, np.zeros((len(NEAR), 3)), twists), twists)
    found = calibrate(TargetPositions(robot, NEAR, measured, robot.forward(NEAR))).deviations
    fresh = ROBOT.legs.home_drives + np.random.default_rng(9).uniform(-0.4, 0.4, (40, 10))
    true = robot.measured(robot.solve(fresh, np.zeros((len(fresh), 3)), twists), twists)
    assert np.linalg.norm(ROBOT.forward(fresh) - true, axis=1).mean() > 5.0
    assert np.linalg.norm(robot.forward(fresh, found) - true, axis=1).max() < 0.1


def test_belts_and_differentials_couple_drives():
    """A belt from the base to the elbow; two drives that turn a wrist by their sum and difference."""
    rows = [
        {"a": 300.0},
        {"a": 250.0, "drives": {"q2": 1.0, "q1": -1.0}},
        {"alpha": np.pi / 2.0, "drives": {"q3": 0.5, "q4": 0.5}},
        {"alpha": -np.pi / 2.0, "a": 40.0, "drives": {"q3": 0.5, "q4": -0.5}},
    ]
    draws = np.random.default_rng(7).uniform(-1.0, 1.0, (20, 4))
    joints = draws @ np.array([[1, 0, 0, 0], [-1, 1, 0, 0], [0, 0, 0.5, 0.5], [0, 0, 0.5, -0.5]]).T
    options = {"drive_range": np.tile([-1.0, 1.0], (4, 1)), "home": np.full(4, 0.2), "tool_mm": (10.0, 20.0, 30.0)}
    plain = serial([{key: row[key] for key in row if key != "drives"} for row in rows], **options)
    belts = serial(rows, **options)
    np.testing.assert_allclose(belts.forward(draws), plain.forward(joints), rtol=0.0, atol=1e-9)
    assert not belts.parts.followers
    changes = np.random.default_rng(8).normal(size=(20, 4))
    twists = _motion(belts, draws).at_drives(changes).twists
    np.testing.assert_allclose(belts.drive_errors(twists), changes, atol=1e-12)
    # the drives' offsets and those of the joints are the same four numbers
    full = replace(belts, parameter_set="full")
    assert set(full.parameters.names[:4]) == {"dq1", "dq2", "dq3", "dq4"}
    assert not {"joint_2_rz", "joint_3_rz", "joint_4_rz"} & set(full.parameters.names)


_JOINT = {"a": 100.0}


@pytest.mark.parametrize(
    ("rows", "pattern"),
    [
        ([_JOINT, _JOINT | {"drives": {"q9": 1.0}}], "joint q2 follows 'q9'; allowed: joints with drives .*, q1"),
        (
            [_JOINT, _JOINT | {"drives": {"q1": 1.0}}, _JOINT | {"drives": {"q2": 1.0}}],
            "joint q3 follows 'q2'; allowed: joints with drives of their own, q1",
        ),
        ([_JOINT | {"drives": {"q2": 1.0}}, _JOINT | {"drives": {"q1": 1.0}}], "no row has a drive of its own"),
        ([_JOINT, _JOINT | {"drives": {"q1": 0.0}}], "joint q2 follows q1 times 0.0; allowed: not 0"),
        ([_JOINT, _JOINT | {"name": "q1"}], "two joints or frames are called 'q1'"),
        ([_JOINT, _JOINT | {"name": "flange"}], "two joints or frames are called 'flange'"),
        # places that rows without a name get
        ([_JOINT, _JOINT | {"name": "joint 1"}], "two joints or frames are called 'joint 1'"),
        ([{"xyz_mm": [0.0, 0.0, 1.0]}, _JOINT | {"name": "frame 1"}], "two joints or frames are called 'frame 1'"),
        ([{"xyz_mm": [0.0, 0.0, 1.0]}], "no row has a drive of its own"),
        ([_JOINT, _JOINT | {"gear": 3}], "row 2 has 'gear'; allowed: a, alpha"),
        ([_JOINT, {"xyz_mm": [0, 0, 1], "a": 3}], "row 2 has 'a'; allowed: xyz_mm"),
    ],
)
def test_what_does_not_fit_together_is_refused(rows, pattern):
    with pytest.raises(ConfigError, match=pattern):
        serial(rows, [[-1.0, 1.0]], [0.0])


@pytest.mark.parametrize(
    ("change", "pattern"),
    [
        ({"range_deg": None}, "row 2 has no range_deg"),
        ({"angle_deg": 3.0}, "row 2 has 'angle_deg'"),
    ],
)
def test_entries_are_refused_by_name(change, pattern):
    section = humanoid.section()
    section["dh"][1] = {key: value for key, value in (section["dh"][1] | change).items() if value is not None}
    with pytest.raises(ConfigError, match=pattern):
        make_mechanism("humanoid", section)
    with pytest.raises(ConfigError, match="convention is 'craig'; allowed: standard, modified"):
        make_mechanism("humanoid", humanoid.section(convention="craig"))


def _mimic(name, more, link="three", kind="revolute"):
    return TREE + joint_of(name, kind, "two", link, f"<mimic {more}/>")


def test_a_mimic_has_its_factor_and_offset(tmp_path):
    """One that turns with a slide, in rad per m, and one that slides with a turn."""
    third = 'joint="j2" multiplier="-0.5" offset="0.3"'
    robot = from_urdf(urdf(tmp_path, _mimic("j3", third)), tool_mm=(50.0, 0.0, 0.0))
    q = np.array([[0.4, 120.0]])
    base, link = [100.0, 0.0, 200.0], [200.0, 0.0, 400.0 + 120.0]
    turned = Rotation.from_euler("z", 0.4 - 0.5 * 0.12 + 0.3).apply([50.0, 0.0, 0.0])
    expected = base + Rotation.from_euler("z", 0.4).apply(link) + turned
    np.testing.assert_allclose(robot.forward(q)[0], expected, atol=1e-9)
    sliding = _mimic("j3", 'joint="j1" multiplier="0.2" offset="0.01"', kind="prismatic")
    robot = from_urdf(urdf(tmp_path, sliding))
    height = 3 * 200.0 + 120.0 + 0.2 * 400.0 + 10.0
    expected = np.array([100.0, 0.0, 0.0]) + Rotation.from_euler("z", 0.4).apply([200.0, 0.0, height])
    np.testing.assert_allclose(robot.forward(q)[0], expected, atol=1e-9)


@pytest.mark.parametrize(
    ("more", "options", "pattern"),
    [
        ('joint="j9"', {}, "joint j3 mimics 'j9'; allowed: driven joints of the chain, j1, j2"),
        ('joint="j3"', {}, "joint j3 mimics 'j3'; allowed: driven joints of the chain, j1, j2"),
        ('joint="j1"', {"base": "one"}, "joint j3 mimics 'j1'; allowed: driven joints of the chain, j2"),
        ('joint="j1" multiplier="two"', {}, "multiplier of joint j3's mimic is 'two'; allowed: a number"),
        ('joint="j1"', {"home": {"j3": 0.1}}, "home has 'j3'; allowed: j1, j2"),
    ],
)
def test_mimics_that_cannot_be_are_refused(tmp_path, more, options, pattern):
    with pytest.raises(ConfigError, match=pattern):
        from_urdf(urdf(tmp_path, _mimic("j3", more)), **options)


def test_a_second_mimic_is_refused_where_the_joint_is_of_the_chain(tmp_path):
    """As that of a wrist that two drives hold level: the first one was ignored."""
    text = TREE + joint_of("j3", "revolute", "two", "three", '<mimic joint="j1"/><mimic joint="j2"/>')
    file = urdf(tmp_path, text)
    with pytest.raises(ConfigError, match="joint j3 has 2 elements mimic; allowed: one, and a joint of its own on the"):
        from_urdf(file, tip="three")
    assert from_urdf(file, tip="two").parts.columns == ["j1_rad", "j2_mm"]


def test_a_mimic_of_a_mimic_is_refused(tmp_path):
    joints = _mimic("j3", 'joint="j1"') + joint_of("j4", "revolute", "three", "four", '<mimic joint="j3"/>')
    with pytest.raises(ConfigError, match="joint j4 mimics 'j3'; allowed: driven joints of the chain, j1, j2"):
        from_urdf(urdf(tmp_path, joints, ("base", "one", "two", "three", "four")))


ELBOW = f"""
<body name="one"><joint name="base" axis="0 0 1" ref="0.2"/>{GEOM}
  <body name="two" pos="0.3 0 0"><joint name="elbow" axis="0 1 0" ref="0.1"/>{GEOM}
    <body name="three" pos="0.2 0 0"><joint name="out" type="slide" axis="1 0 0"/>{GEOM}
      <body name="tip" pos="0.1 0 0.05"/></body></body></body>"""
COUPLED = (
    '<joint joint1="out" joint2="base" polycoef="0.02 0.05"/><joint joint1="elbow" joint2="base" polycoef="0 -1"/>'
)


def test_joint_equalities_are_mujoco_s(tmp_path):
    """MuJoCo's own kinematics at values that meet its equalities, and what a simulation of them moves."""
    path = mjcf(tmp_path, ELBOW, COUPLED, servos("base"), '<keyframe><key qpos="0.2 0.1 0.02"/></keyframe>')
    robot, model = from_mjcf(path, "tip"), mujoco.MjModel.from_xml_path(str(path))
    assert robot.parts.columns == ["base_rad"] and {one.unit for one in robot.parts.followers} == {"mm", "rad"}
    data = mujoco.MjData(model)
    for q in (-0.7, 0.0, 0.9):
        data.qpos[:] = 0.2 + q, 0.1 - q, 0.02 + 0.05 * q
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(data.efc_pos[: model.neq], 0.0, atol=1e-12)
        poses = robot.solve(np.array([[q]]), np.zeros((1, 3)))
        np.testing.assert_allclose(poses.position_mm[0], 1e3 * data.body("tip").xpos, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(poses.turn[0].ravel(), data.body("tip").xmat, rtol=0.0, atol=1e-12)


def test_loads_of_a_coupled_drive_are_mujoco_s(tmp_path):
    """By virtual work: inverse dynamics of all joints without the coupling, summed by it."""
    path = mjcf(tmp_path, ELBOW, COUPLED, servos("base"), '<keyframe><key qpos="0.2 0.1 0.02"/></keyframe>')
    robot, model = from_mjcf(path, "tip"), mujoco.MjModel.from_xml_path(str(path))
    model.eq_active0[:] = 0
    model.opt.gravity[:] = 0.0, 0.0, -9.80665
    q, rate, bend = 0.4, 0.7, -0.3
    data, along = mujoco.MjData(model), np.array([1.0, -1.0, 0.05])
    data.qpos[:] = np.array([0.2, 0.1, 0.02]) + q * along
    data.qvel[:], data.qacc[:] = rate * along, bend * along
    mujoco.mj_inverse(model, data)
    values = tuple(np.array([[one]]) for one in (q, rate, bend))
    poses = robot.solve(values[0], np.zeros((1, 3)))
    loads = driven_loads(robot, values, poses, np.array([0.0, 0.0, -9806.65]))
    np.testing.assert_allclose(
        robot.legs.per_actuator(loads)[0, 0], -1e3 * along @ data.qfrc_inverse, rtol=1e-5, atol=1e-3
    )


@pytest.mark.parametrize(
    ("equality", "driven", "pattern"),
    [
        ('<joint joint1="elbow"/>', ("base", "out"), "joint elbow is held by equality 1"),
        (
            '<joint joint1="elbow" joint2="base"/>',
            ("base", "elbow", "out"),
            "elbow follows base and has an actuator, too",
        ),
        ('<joint joint1="elbow" joint2="out"/>', ("base",), "joint elbow follows out; allowed: a joint of the legs"),
        (
            COUPLED.replace("-1", "-1 0.3"),
            ("base",),
            "joint elbow follows base along a curve; allowed: polycoef of two",
        ),
    ],
)
def test_joint_equalities_that_cannot_be_are_refused(tmp_path, equality, driven, pattern):
    with pytest.raises(ConfigError, match=pattern):
        from_mjcf(mjcf(tmp_path, ELBOW, equality, servos(*driven)), "tip")


def test_a_loop_may_hold_a_joint_that_follows(tmp_path):
    """Two cranks, geared against each other, and two rods that meet: where they do stays in the middle."""
    world = (
        FOUR_BAR[: FOUR_BAR.index('<body name="rocker"')]
        + f"""
    <body name="other" pos="0.3 0 0"><joint name="other" axis="0 1 0"/>{GEOM}
      <body name="second" pos="0 0 0.1"><joint name="pin2" axis="0 1 0"/>{GEOM}</body></body>"""
    )
    loop = '<connect name="loop" body1="coupler" body2="second" anchor="0.15 0 0.2"/>'
    gear = '<joint joint1="other" joint2="crank" polycoef="0 -1"/>'
    path = mjcf(tmp_path, world, loop + gear, servos("crank"))
    robot = from_mjcf(path, "coupler", tool_mm=(150.0, 0.0, 200.0))
    crank = np.linspace(-0.6, 0.6, 9)
    end = 100.0 * np.sin(crank), 100.0 * np.cos(crank)
    height = end[1] + np.sqrt(250.0**2 - (150.0 - end[0]) ** 2)
    expected = np.stack([np.full(9, 150.0), np.zeros(9), height], axis=1)
    np.testing.assert_allclose(robot.forward(crank[:, None]), expected, rtol=0.0, atol=1e-8)
    at, h = robot.map_at(crank[:, None], expected), 1e-5
    slope = (robot.forward(crank[:, None] + h) - robot.forward(crank[:, None] - h)) / (2.0 * h)
    np.testing.assert_allclose(at.drive_response[:, :, 0], slope, rtol=0.0, atol=1e-5)


def test_moments_across_the_joints_are_slopes_of_the_potential_energy():
    """All that a joint carries is turned about directions across its axis; about the axis itself nothing is left."""
    motion, h = _motion(ROBOT, NEAR[:5]), 1e-4
    joints = [joint for joint in ROBOT.legs.joints if joint.name in ROBOT.legs.arm_joints]
    assert motion.across.shape == (5, len(joints), 3)
    at = ROBOT.map_at(motion.drive, motion.position_mm)
    for k, joint in enumerate(joints):
        np.testing.assert_allclose(motion.across[:, k] @ joint.axis, 0.0, atol=1e-6)
        site = ROBOT.legs.site_numbers[joint.name]
        for direction in np.eye(3):
            direction = direction - (direction @ joint.axis) * joint.axis
            slope = [_lifted(motion, at, site, sign * h * direction) for sign in (1.0, -1.0)]
            expected = -(slope[0] - slope[1]) / (2.0 * h)
            np.testing.assert_allclose(motion.across[:, k] @ direction, expected, rtol=1e-4, atol=0.5)


def _lifted(motion, at, site, turn):
    """Potential energy (n,) in N mm of the masses behind a site after a turn (3,) of its frame."""
    frame, place = at.frames[site]
    order = [joint.name for joint in ROBOT.legs.legs[0].joints]
    name, up = ROBOT.legs.sites[site], ROBOT.up
    total = np.zeros(len(motion))
    now = places(ROBOT, motion.drive, at.poses)
    whole = frame @ Rotation.from_rotvec(turn).as_matrix() @ np.swapaxes(frame, 1, 2)
    for number, point_mass in enumerate(ROBOT.point_masses):
        if point_mass.joint not in order or order.index(point_mass.joint) >= order.index(name):
            moved = np.einsum("nab,nb->na", whole, now[:, number] - place) + place
            total += point_mass.mass_kg * GRAVITY_MM_S2 / 1e3 * (moved @ up)
    return total


def test_links_that_bend_turn_the_hand_about_the_joints():
    """To first order the tool turns about every joint by the compliance times the moment across its axis."""
    motion, effect = _motion(ROBOT, NEAR[:5]), library(ROBOT)["link_flexure"]
    assert len(effect.parameters) == len(ROBOT.legs.arm_joints)
    values = np.random.default_rng(6).uniform(1e-11, 3e-11, len(effect.parameters))
    twists = effect.contribute(motion, values).twists
    found = ROBOT.measured(ROBOT.solve(motion.drive, motion.position_mm, twists), twists)
    at, shift = ROBOT.map_at(motion.drive, motion.position_mm), 0.0
    for k, name in enumerate(ROBOT.legs.arm_joints):
        frame, place = at.frames[ROBOT.legs.site_numbers[name]]
        turn = np.einsum("nab,nb->na", frame, values[k] * motion.across[:, k])
        shift = shift + np.cross(turn, motion.position_mm - place)
    np.testing.assert_allclose(found - motion.position_mm, shift, rtol=1e-4, atol=1e-8)
    assert np.linalg.norm(shift, axis=1).min() > 1e-4
