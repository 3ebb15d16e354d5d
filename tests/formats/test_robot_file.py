"""Robots from URDF and MJCF against MuJoCo's own kinematics and against the robots that have files."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rrru.formats.robot_file import from_mjcf, from_urdf
from rrru.kinematics.chain import Poses, Twists, walks
from rrru.kinematics.point_masses import driven_loads, places
from rrru.robots.delta import Delta
from rrru.robots.hexapod import hexapod
from rrru.robots.rrru3 import Rrru3
from tests.formats.mjcf import (
    ARM,
    CRANKED,
    CRANKED_JOINTS,
    FOUR_BAR,
    GEOM,
    HEXAPOD,
    ROOT,
    RRRU3_HOME,
    TREE,
    delta_mjcf,
    file_of,
    joint_of,
    mjcf,
    rrru3_mjcf,
    rrs3_mjcf,
    servos,
    text_of,
    urdf,
)


def _turned(poses):
    """Rotation vectors (n, 3) of the platform."""
    return Rotation.from_matrix(poses.turn).as_rotvec()


def _lumps(robot, joint):
    """Masses (n,) in kg and places (n, 3) in mm of the point masses behind a joint."""
    own = [point_mass for point_mass in robot.point_masses if point_mass.joint == joint]
    return np.array([one.mass_kg for one in own]), np.array([one.at_mm for one in own])


def _foreign(model, qpos, body, base=0):
    """MuJoCo's own position in mm and turn of a body in the frame of a base, at joint positions qpos."""
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    (near, own), (far, turn) = ((data.xpos[k], data.xmat[k].reshape(3, 3)) for k in (base, model.body(body).id))
    return 1000.0 * own.T @ (far - near), own.T @ turn


def _urdf_model(path):
    """MuJoCo's model of a URDF, links without masses included."""
    spec = mujoco.MjSpec.from_file(str(path))
    spec.compiler.fusestatic = False
    spec.compiler.boundmass = spec.compiler.boundinertia = 1e-12
    return spec.compile()


def _check_against_mujoco(robot, model, draws, body, base=0):
    """Positions and turns of a robot of one chain at qpos (n, K) are MuJoCo's."""
    units = np.array([1000.0 if unit == "mm" else 1.0 for unit in robot.parts.units])
    actuators = (draws - model.qpos0[: draws.shape[1]]) * units
    poses = robot.solve(actuators, np.zeros((len(draws), 3)))
    expected = [_foreign(model, qpos, body, base) for qpos in draws]
    np.testing.assert_allclose(poses.position_mm, [position for position, _ in expected], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(poses.turn, [turn for _, turn in expected], rtol=0.0, atol=1e-12)


def test_an_arm_stands_where_mujoco_says():
    robot = from_urdf(ARM)
    low, high = robot.drive_range.T
    draws = np.random.default_rng(1).uniform(low, high, (50, 6))
    _check_against_mujoco(robot, _urdf_model(ARM), draws, "tool0")
    assert robot.parts.columns == [f"axis{k}_rad" for k in range(1, 7)]
    assert robot.parts.drives[3].site == "axis4" and robot.name == "arm6" and robot.up == (0.0, 0.0, 1.0)
    np.testing.assert_allclose(robot.drive_range[1], [-1.7, 2.2])
    np.testing.assert_allclose(robot.legs.home_mm, _foreign(_urdf_model(ARM), np.zeros(6), "tool0")[0], atol=1e-9)


def test_a_part_of_an_arm_is_an_arm_and_stands_in_its_base_s_frame():
    robot = from_urdf(ARM, base="upper_arm", tip="wrist", home={"axis4": 0.4})
    model = _urdf_model(ARM)
    draws = np.random.default_rng(2).uniform(-1.0, 1.0, (10, 3))
    qpos = np.concatenate([np.zeros((10, 2)), draws, np.zeros((10, 1))], axis=1)
    poses = robot.solve(draws, np.zeros((10, 3)))
    for k in range(10):
        position, turn = _foreign(model, qpos[k], "wrist", model.body("upper_arm").id)
        np.testing.assert_allclose(poses.position_mm[k], position, atol=1e-9)
        np.testing.assert_allclose(poses.turn[k], turn, atol=1e-12)
    np.testing.assert_allclose(robot.legs.home_drives, [0.0, 0.4, 0.0])


def test_an_arm_may_be_read_from_its_tip_to_its_root():
    robot, model = from_urdf(ARM, base="tool0", tip="base_link"), _urdf_model(ARM)
    draws = np.random.default_rng(3).uniform(-1.0, 1.0, (10, 6))
    poses = robot.solve(draws[:, ::-1], np.zeros((10, 3)))
    for k in range(10):
        position, turn = _foreign(model, draws[k], "base_link", model.body("tool0").id)
        np.testing.assert_allclose(poses.position_mm[k], position, atol=1e-9)
        np.testing.assert_allclose(poses.turn[k], turn, atol=1e-12)
    # the root stands still in the file, but moves in this frame
    assert _lumps(robot, "platform")[0].sum() == pytest.approx(14.0)


def test_an_inverse_of_an_arm_is_undone_by_mujoco():
    robot, model = from_urdf(ARM), _urdf_model(ARM)
    wanted = robot.legs.home_mm + np.random.default_rng(4).uniform(-150.0, 150.0, (10, 3))
    actuators = robot.inverse(wanted)
    assert np.isfinite(actuators).all()
    for k in range(10):
        position, turn = _foreign(model, actuators[k], "tool0")
        np.testing.assert_allclose(position, wanted[k], atol=1e-6)
        np.testing.assert_allclose(turn, robot.legs.home_turn, atol=1e-8)


def test_oblique_axes_anchors_references_and_several_joints_of_a_body(tmp_path):
    path = mjcf(tmp_path, CRANKED, actuators=servos(*CRANKED_JOINTS))
    robot, model = from_mjcf(path, "tip"), mujoco.MjModel.from_xml_path(str(path))
    draws = np.random.default_rng(5).uniform(-1.0, 1.0, (50, 6)) * [1.0, 0.2, 1.0, 1.0, 1.0, 1.0]
    _check_against_mujoco(robot, model, draws, "tip")
    assert robot.parts.columns == ["turn_rad", "push_mm", "one_rad", "two_rad", "world_rad", "last_rad"]
    # a site of its own, not that of the world's frame; every drive's error is one number of its site
    assert robot.parts.drives[4].site == "world 2"
    assert all(np.isclose(np.abs(drive.twist).max(), 1.0) for drive in robot.parts.drives)
    np.testing.assert_allclose(robot.drive_range[:2], [[-1.4, 1.6], [-100.0, 100.0]])


def test_a_drive_error_of_an_imported_robot_is_a_change_of_its_joint(tmp_path):
    path = mjcf(tmp_path, CRANKED, actuators=servos(*CRANKED_JOINTS))
    robot, draws = from_mjcf(path, "tip"), np.random.default_rng(6).uniform(-1.0, 1.0, (5, 6))
    change = np.array([0.01, 0.3, -0.02, 0.01, 0.02, 0.01])
    np.testing.assert_allclose(robot.forward(draws, change), robot.forward(draws + change), atol=1e-9)


def test_the_range_is_the_joint_s_and_its_servo_s(tmp_path):
    actuators = '<position joint="turn" ctrlrange="-3 1" ctrllimited="true"/><motor joint="push" ctrlrange="-9 9"/>'
    actuators += '<velocity joint="push" kv="3"/>' + servos(*CRANKED_JOINTS[2:])
    robot = from_mjcf(mjcf(tmp_path, CRANKED, actuators=actuators), "tip")
    np.testing.assert_allclose(robot.drive_range[:2], [[-1.4, 0.6], [-100.0, 100.0]])
    assert len(robot.parts.drives) == 6


@pytest.fixture(scope="module")
def six():
    return from_mjcf(HEXAPOD, "plate")


def _hexapod_qpos(robot, model, actuators, poses):
    """MuJoCo's qpos of one pose of the hexapod: the plate's, then universal joints that look along the legs."""
    data = mujoco.MjData(model)
    data.qpos[:3] = poses.position_mm[0] / 1000.0
    data.qpos[3:7] = Rotation.from_matrix(poses.turn[0]).as_quat(scalar_first=True)
    for k, leg in enumerate(robot.legs.legs, 1):
        body = model.body(f"cylinder{k}")
        far = poses.position_mm[0] + poses.turn[0] @ leg.bar.platform_mm
        line = Rotation.from_quat(body.quat, scalar_first=True).inv().apply(far / 1000.0 - body.pos)
        line /= np.linalg.norm(line)
        data.joint(f"leg{k}_u").qpos = np.arctan2(-line[1], line[2])
        data.joint(f"leg{k}_v").qpos = np.arcsin(line[0])
        data.joint(f"leg{k}").qpos = actuators[k - 1] / 1000.0
    return data


def test_closed_legs_of_the_hexapod_meet_mujoco_s_constraints(six):
    model = mujoco.MjModel.from_xml_path(str(HEXAPOD))
    for actuators in np.random.default_rng(7).uniform(-60.0, 60.0, (20, 6)):
        poses = six.solve(actuators[None], six.legs.home_mm[None])
        assert poses.closed.all()
        data = _hexapod_qpos(six, model, actuators, poses)
        mujoco.mj_forward(model, data)
        assert np.abs(data.efc_pos[data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY]).max() < 1e-9


def test_the_hexapod_of_the_file_is_the_one_of_its_points(six):
    assert all(leg.bar for leg in six.legs.legs) and six.parts.columns == [f"leg{k}_mm" for k in range(1, 7)]
    base = [leg.joints[-1].shift_mm for leg in six.legs.legs]
    plate = [leg.bar.platform_mm for leg in six.legs.legs]
    known = hexapod(base, plate, 500.0)
    changes = np.random.default_rng(8).uniform(-60.0, 60.0, (20, 6))
    np.testing.assert_allclose(six.forward(changes), known.forward(known.legs.home_drives + changes), atol=1e-9)
    points = six.legs.home_mm + np.random.default_rng(9).uniform(-50.0, 50.0, (20, 3))
    np.testing.assert_allclose(six.inverse(points), known.inverse(points) - known.legs.home_drives, atol=1e-9)
    np.testing.assert_allclose(six.drive_range, np.tile([-100.0, 100.0], (6, 1)))


def test_the_hexapod_as_general_chains_stands_where_its_bars_do(six, tmp_path):
    """Servos that count against the leg's length make no bars."""
    text = HEXAPOD.read_text().replace('type="slide" axis="0 0 1"', 'type="slide" axis="0 0 -1"')
    chains = from_mjcf(file_of(tmp_path, text), "plate")
    assert not any(leg.bar for leg in chains.legs.legs)
    changes = np.random.default_rng(10).uniform(-40.0, 40.0, (10, 6))
    np.testing.assert_allclose(chains.forward(-changes), six.forward(changes), atol=1e-8)


def test_bars_are_found_behind_any_joints_that_make_them(six, tmp_path):
    """Cylinders on ball joints, which may spin; tops on the plate, on a spin along the leg and a universal joint."""
    lines = [line for line in HEXAPOD.read_text().splitlines() if 'name="ball' not in line]
    text = "\n".join(lines)
    text, equality = text[: text.index("<keyframe>")] + "</mujoco>", ""
    spin = '<joint axis="0 0 1" pos="0 0 -0.1"/><joint axis="1 0 0"/><joint axis="0 1 0"/>'
    for k, leg in enumerate(six.legs.legs, 1):
        if k < 4:
            text = text.replace(f'name="leg{k}_u" axis="1 0 0"', f'name="leg{k}_u" type="ball"')
            text = text.replace(f'<joint name="leg{k}_v" axis="0 1 0"/>', "")
            anchor = text_of(leg.bar.platform_mm / 1000.0)
            equality += f'<connect body1="plate" body2="piston{k}" anchor="{anchor}"/>'
        else:
            top = f'<body name="top{k}" pos="0 0 {leg.bar.length_mm / 1000.0 - 0.2!r}">{spin}{GEOM}</body>'
            text = text.replace(f'<joint name="leg{k}" class="stroke"/>', f'<joint name="leg{k}" class="stroke"/>{top}')
            equality += f'<weld body1="top{k}" body2="plate"/>'
    path = file_of(tmp_path, text.replace("<equality>", f"<equality>{equality}"))
    robot, changes = from_mjcf(path, "plate"), np.random.default_rng(16).uniform(-40.0, 40.0, (5, 6))
    assert all(leg.bar for leg in robot.legs.legs)
    np.testing.assert_allclose(robot.forward(changes), six.forward(changes), atol=1e-9)
    # the tops are parts of the plate
    assert _lumps(robot, "platform")[0].sum() == pytest.approx(4.9)


def test_mujoco_s_simulation_of_the_hexapod_comes_to_rest_on_the_closed_form(six):
    """An example that is ready to be simulated: the loops stay closed, and servos sag by their load over their kp."""
    model = mujoco.MjModel.from_xml_path(str(HEXAPOD))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.ctrl[:] = np.array([10.0, 0.0, 0.0, -5.0, 0.0, 3.0]) / 1000.0
    mujoco.mj_step(model, data, 6000)
    legs = np.array([[1000.0 * data.joint(f"leg{k}").qpos[0] for k in range(1, 7)]])
    np.testing.assert_allclose(six.forward(legs)[0], 1000.0 * data.body("plate").xpos, atol=1e-4)
    # a servo pushes with kp times its sag against what the masses load it with
    still = np.zeros((1, 6))
    load = driven_loads(
        six, (legs, still, still), six.solve(legs, six.legs.home_mm[None]), np.array([0.0, 0.0, -9810.0])
    )
    np.testing.assert_allclose(
        1000.0 * data.ctrl - legs[0], -load[0] / (model.actuator_gainprm[:, 0] / 1000.0), rtol=1e-3
    )


def test_a_3_rrru_of_a_file_stands_where_the_closed_form_does(tmp_path):
    known = Rrru3()
    robot = from_mjcf(rrru3_mjcf(tmp_path, known), "plate", parameter_set="full")
    points = RRRU3_HOME + np.random.default_rng(11).uniform(-150.0, 150.0, (40, 3))
    theta = known.inverse(points)
    np.testing.assert_allclose(robot.forward(theta, guess_mm=points), points, atol=1e-9)
    np.testing.assert_allclose(robot.forward(theta, guess_mm=points), known.forward(theta, guess_mm=points), atol=1e-9)
    assert robot.parts.columns == [f"leg {k} drive_rad" for k in (1, 2, 3)]
    # the key's angles are rounded, which the loops undo
    theta = np.round(known.inverse([RRRU3_HOME]), 6)
    np.testing.assert_allclose(robot.legs.home_drives, theta[0], atol=1e-12)
    np.testing.assert_allclose(robot.legs.home_mm, known.forward(theta, guess_mm=[RRRU3_HOME])[0], atol=1e-9)
    assert 1e-5 < np.abs(robot.legs.home_mm - RRRU3_HOME).max() < 1e-2


def test_far_from_home_a_robot_stays_in_the_assembly_of_home():
    """The closed form's, over a box of a metre by 0.4 m: from positions, from drive values near them or alone."""
    closed_form, robot = Rrru3(), from_mjcf(ROOT / "data/models/rrru3.xml", "plate")
    position = np.random.default_rng(5).uniform((-500.0, -500.0, 500.0), (500.0, 500.0, 900.0), (100, 3))
    actuators = closed_form.inverse(position)
    near = {"rtol": 0.0, "atol": 1e-8}
    np.testing.assert_allclose(robot.inverse(position), actuators, **near)
    np.testing.assert_allclose(robot.forward(actuators, guess_mm=position + 1.0), position, **near)
    np.testing.assert_allclose(robot.forward(actuators), position, **near)


@pytest.mark.parametrize("rods", ["ball", "plate", "loose"])
def test_a_delta_of_a_file_stands_where_the_closed_form_does(tmp_path, rods):
    known = Delta()
    robot = from_mjcf(delta_mjcf(tmp_path, known, rods), "plate")
    assert len(robot.legs.legs) == 6 and all(leg.bar and leg.bar.drive is None for leg in robot.legs.legs)
    assert len(robot.legs.passive_joints) == 0 and robot.parts.columns == ["theta1_rad", "theta2_rad", "theta3_rad"]
    theta = np.random.default_rng(12).uniform(-0.4, 0.8, (40, 3))
    np.testing.assert_allclose(robot.forward(theta), known.forward(theta), atol=1e-9)
    assert robot.drive_range.tolist() == [[-1.0, 1.2]] * 3


def _rrs3_qpos(robot, model, side, cranks, poses):
    """MuJoCo's qpos of one pose of the 3-RRS, whose own values count from those of the home pose's ball."""
    data = mujoco.MjData(model)
    values = dict(zip((joint.name for joint in robot.legs.passive_joints), poses.passive[0], strict=True))
    for leg in (1, 2, 3):
        data.joint(f"crank{leg}").qpos = cranks[leg - 1]
        name = f"ball{leg}"
        if side == "rods":
            data.joint(f"knee{leg}").qpos = values[f"knee{leg}"]
        if side == "plate" or leg == 1:
            turn = Rotation.from_euler("XYZ", [values[f"{name} {axis}"] for axis in "xyz"])
            home = model.key_qpos[0, model.joint(name).qposadr[0] :][:4] if model.nkey else [1.0, 0.0, 0.0, 0.0]
            home = Rotation.from_quat(home, scalar_first=True)
            # a ball that a leg meets from its far end turns backwards
            turn = turn * home if side == "rods" else (home.inv() * _backwards(values, name)).inv()
            data.joint(name).qpos = turn.as_quat(scalar_first=True)
    if side == "plate":
        data.qpos[np.arange(7) + model.jnt_qposadr[model.jnt_type == mujoco.mjtJoint.mjJNT_FREE][0]] = np.concatenate(
            [poses.position_mm[0] / 1000.0, Rotation.from_matrix(poses.turn[0]).as_quat(scalar_first=True)]
        )
    return data.qpos


def _backwards(values, name):
    return Rotation.from_euler("ZYX", [-values[f"{name} {axis}"] for axis in "zyx"])


@pytest.mark.parametrize("side", ["rods", "plate"])
def test_ball_joints_of_chains_meet_mujoco_s_constraints_from_any_home_pose(tmp_path, side):
    path = rrs3_mjcf(tmp_path, side)
    robot, model = from_mjcf(path, "plate"), mujoco.MjModel.from_xml_path(str(path))
    assert not any(leg.bar for leg in robot.legs.legs)
    cranks = np.array([0.15, -0.1, 0.05])
    poses = robot.solve(cranks[None], robot.legs.home_mm[None])
    qpos = _rrs3_qpos(robot, model, side, cranks, poses)
    key = f'<keyframe><key qpos="{text_of(qpos)}"/></keyframe>'
    path = rrs3_mjcf(tmp_path, side, key)
    again, model = from_mjcf(path, "plate"), mujoco.MjModel.from_xml_path(str(path))
    np.testing.assert_allclose(again.legs.home_mm, poses.position_mm[0], atol=1e-9)
    np.testing.assert_allclose(again.legs.home_turn, poses.turn[0], atol=1e-12)
    for cranks in np.random.default_rng(13).uniform(-0.15, 0.15, (10, 3)):
        first = robot.solve(cranks[None], robot.legs.home_mm[None])
        poses = again.solve(cranks[None], again.legs.home_mm[None])
        np.testing.assert_allclose(poses.position_mm, first.position_mm, atol=1e-9)
        data = mujoco.MjData(model)
        data.qpos[:] = _rrs3_qpos(again, model, side, cranks, poses)
        mujoco.mj_forward(model, data)
        assert np.abs(data.efc_pos[data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY]).max() < 1e-9
        np.testing.assert_allclose(1000.0 * data.body("plate").xpos, poses.position_mm[0], atol=1e-9)


def _four_bar_angle(crank):
    """Turn of the coupler about y by the law of cosines, for crank 0.1, coupler (0.3, 0, 0.1), rocker 0.2, base 0.3."""
    pin = 100.0 * np.array([np.sin(crank), np.cos(crank)])
    line = np.array([300.0, 0.0]) - pin
    distance, coupler, rocker = np.linalg.norm(line), np.hypot(300.0, 100.0), 200.0
    inner = np.arccos((distance**2 + coupler**2 - rocker**2) / (2.0 * distance * coupler))
    return -(np.arctan2(line[1], line[0]) + inner) + np.arctan2(100.0, 300.0)


@pytest.mark.parametrize("pins", ["hinge", "ball"])
def test_a_planar_four_bar_follows_the_law_of_cosines(tmp_path, pins):
    anchors = ("0 0.05 0.2", "0 -0.05 0.2") if pins == "hinge" else ("0 0 0.2",)
    connects = "".join(f'<connect body1="rocker" body2="coupler" anchor="{anchor}"/>' for anchor in anchors)
    robot = from_mjcf(mjcf(tmp_path, FOUR_BAR, connects, servos("crank")), "coupler")
    crank = np.linspace(-0.5, 0.5, 11)
    poses = robot.solve(crank[:, None], np.tile(robot.legs.home_mm, (11, 1)))
    assert poses.closed.all()
    np.testing.assert_allclose(_turned(poses)[:, 1], [_four_bar_angle(one) for one in crank], atol=1e-12)
    np.testing.assert_allclose(
        poses.position_mm[:, ::2], 100.0 * np.stack([np.sin(crank), np.cos(crank)], 1), atol=1e-9
    )
    np.testing.assert_allclose(_turned(poses)[:, ::2], 0.0, atol=1e-12)


def test_sites_hold_together_too(tmp_path):
    """A connect and a weld between sites instead of bodies."""
    world = FOUR_BAR.replace('<joint name="pivot"', '<site name="top" pos="0 0 0.2"/><joint name="pivot"').replace(
        '<joint name="pin"', '<site name="arm" pos="0.3 0 0.1"/><site name="here" pos="0 0.1 0"/><joint name="pin"'
    )
    world += (
        f'<body name="hand" pos="0.5 0.6 0.7" euler="1 2 3"><freejoint/>{GEOM}<site name="there" euler="0 0 1"/></body>'
    )
    equality = '<connect site1="top" site2="arm"/><weld site1="here" site2="there"/>'
    robot = from_mjcf(mjcf(tmp_path, world, equality, servos("crank")), "coupler")
    poses = robot.solve(np.array([[0.3]]), robot.legs.home_mm[None])
    np.testing.assert_allclose(_turned(poses)[0, 1], _four_bar_angle(0.3), atol=1e-12)
    # the body "hand" is a part of the platform, wherever it is placed in the file
    _, points = _lumps(robot, "platform")
    np.testing.assert_allclose(points[6:].mean(axis=0), [0.0, 100.0, 0.0], atol=1e-9)


def test_a_home_pose_of_rounded_numbers_is_closed(tmp_path):
    connect = '<connect body1="rocker" body2="coupler" anchor="0 0 0.2"/>'
    crank, coupler = 0.3, _four_bar_angle(0.3)
    point = 100.0 * np.array([np.sin(crank), np.cos(crank)])
    corner = point + np.array([[np.cos(coupler), np.sin(coupler)], [-np.sin(coupler), np.cos(coupler)]]) @ [
        300.0,
        100.0,
    ]
    qpos = f"{crank} {coupler - crank + 1e-4:.12f} {np.arctan2(corner[0] - 300.0, corner[1]):.12f}"
    robot = from_mjcf(
        mjcf(tmp_path, FOUR_BAR, connect, servos("crank"), f'<keyframe><key qpos="{qpos}"/></keyframe>'), "coupler"
    )
    home = Poses(robot.legs.home_mm[None], robot.legs.home_turn[None], robot.legs.home_passive[None], None, None)
    np.testing.assert_allclose(_turned(home)[0, 1], coupler, atol=1e-12)
    ways = walks(robot.legs, robot.legs.home_drives[None], home, Twists(robot.legs))
    assert not any(leg.bar for leg in robot.legs.legs)
    for way in ways:
        assert np.abs(way.place - home.position_mm).max() < 1e-9
        assert np.abs(way.turn - home.turn).max() < 1e-12


def _inertia(points, mass):
    """Inertia (3, 3) in kg mm^2 of points (n, 3) with masses (n,) about their origin."""
    square = np.einsum("n,ni,nj->ij", mass, points, points)
    return np.trace(square) * np.eye(3) - square


def test_lumps_have_mass_centre_and_inertia_of_their_bodies():
    robot, model = from_urdf(ARM), _urdf_model(ARM)
    for joint, body in (("axis1", "shoulder"), ("axis2", "upper_arm"), ("axis3", "elbow"), ("axis5", "wrist")):
        mass, points = _lumps(robot, joint)
        own = model.body(body)
        assert mass.sum() == pytest.approx(own.mass[0], rel=1e-12)
        np.testing.assert_allclose(mass @ points / mass.sum(), 1000.0 * own.ipos, atol=1e-9)
        turn = Rotation.from_quat(own.iquat, scalar_first=True).as_matrix()
        expected = 1e6 * turn @ np.diag(own.inertia) @ turn.T
        np.testing.assert_allclose(_inertia(points - 1000.0 * own.ipos, mass), expected, atol=1e-6)
    # the flange behind the tool's frame, the base not at all
    np.testing.assert_allclose(_lumps(robot, "platform")[1].mean(axis=0), [0.0, 0.0, -10.0], atol=1e-9)
    assert sum(point_mass.mass_kg for point_mass in robot.point_masses) == pytest.approx(31.2)


def test_lumps_of_a_bar_lie_along_it(six):
    model = mujoco.MjModel.from_xml_path(str(HEXAPOD))
    mass, cylinder = _lumps(six, "leg 2 bar")
    centre = cylinder[:, 0].mean()
    assert mass.sum() == pytest.approx(1.4) and centre == pytest.approx(125.0)
    assert mass @ (cylinder[:, 0] - centre) ** 2 == pytest.approx(1e6 * model.body("cylinder2").inertia.max())
    # its middle is 100 mm before its body, which is 200 mm up the leg
    _, piston = _lumps(six, "leg 2 end")
    assert piston[:, 0].mean() == pytest.approx(300.0 - six.legs.legs[1].bar.length_mm)


def _mass_centre(robot, actuators, poses):
    """Mass in kg and its centre (3,) in mm of a robot's point masses at actuator values (K,) and one pose."""
    mass = np.array([point_mass.mass_kg for point_mass in robot.point_masses])
    return mass.sum(), mass @ places(robot, actuators[None], poses)[0] / mass.sum()


def test_lumps_go_where_mujoco_moves_the_masses(six, tmp_path):
    for actuators in np.random.default_rng(14).uniform(-60.0, 60.0, (5, 6)):
        model = mujoco.MjModel.from_xml_path(str(HEXAPOD))
        poses = six.solve(actuators[None], six.legs.home_mm[None])
        data = _hexapod_qpos(six, model, actuators, poses)
        mujoco.mj_forward(model, data)
        mass, centre = _mass_centre(six, actuators, poses)
        assert mass == pytest.approx(16.0)
        np.testing.assert_allclose(centre, 1000.0 * data.subtree_com[0], atol=1e-9)
    path = mjcf(tmp_path, CRANKED, actuators=servos(*CRANKED_JOINTS))
    robot, model = from_mjcf(path, "tip"), mujoco.MjModel.from_xml_path(str(path))
    for qpos in np.random.default_rng(15).uniform(-1.0, 1.0, (5, 6)):
        actuators = (qpos - model.qpos0) * [1.0, 1000.0, 1.0, 1.0, 1.0, 1.0]
        data = mujoco.MjData(model)
        data.qpos[:] = qpos
        mujoco.mj_forward(model, data)
        mass, centre = _mass_centre(robot, actuators, robot.solve(actuators[None], np.zeros((1, 3))))
        assert mass == pytest.approx(0.9)
        np.testing.assert_allclose(centre, 1000.0 * data.subtree_com[0], atol=1e-9)


def test_loads_of_lumps_are_mujoco_s_inverse_dynamics():
    robot, model, generator = from_urdf(ARM), _urdf_model(ARM), np.random.default_rng(17)
    model.opt.gravity[2] = -9.80665
    values, rates, accelerations = (generator.uniform(-1.0, 1.0, (5, 6)) for _ in range(3))
    poses = robot.solve(values, np.zeros((5, 3)))
    loads = driven_loads(robot, (values, rates, accelerations), poses, np.array([0.0, 0.0, -9806.65]))
    data = mujoco.MjData(model)
    for k in range(5):
        data.qpos[:], data.qvel[:], data.qacc[:] = values[k], rates[k], accelerations[k]
        mujoco.mj_inverse(model, data)
        np.testing.assert_allclose(loads[k], -1000.0 * data.qfrc_inverse, rtol=1e-5, atol=0.1)


def test_what_hangs_on_a_leg_is_carried_by_it(tmp_path):
    gripper = f'<body name="gripper"><joint name="jaw" pos="0 0 0.1"/>{GEOM}</body>'
    path = mjcf(
        tmp_path,
        CRANKED.replace('euler="1 1 1"/>', f'euler="1 1 1">{gripper}</body>'),
        actuators=servos(*CRANKED_JOINTS),
    )
    robot = from_mjcf(path, "tip")
    mass, points = _lumps(robot, "platform")
    assert mass.sum() == pytest.approx(0.6) and len(robot.parts.drives) == 6
    np.testing.assert_allclose(points[6:].mean(axis=0), 0.0, atol=1e-9)


def test_meshes_that_are_not_there_and_links_without_mass_do_no_harm(tmp_path):
    robot = from_urdf(urdf(tmp_path, TREE + joint_of("j3", "continuous", "two", "three")))
    assert robot.parts.columns == ["j1_rad", "j2_mm", "j3_rad"] and robot.point_masses == ()
    np.testing.assert_allclose(robot.drive_range, [[-1.0, 1.0], [-1000.0, 1000.0], [-1.0, 1.0]])
    robot = from_urdf(
        urdf(tmp_path, TREE + joint_of("j3", "fixed", "two", "three")), home={"j2": 50.0}, tool_mm=(1, 2, 3)
    )
    np.testing.assert_allclose(robot.legs.home_drives, [0.0, 50.0])
    np.testing.assert_allclose(robot.forward([[0.0, 50.0]])[0], [301.0, 2.0, 653.0], atol=1e-9)


def test_a_home_value_outside_of_its_range_is_the_range_s_middle(tmp_path):
    path = urdf(tmp_path, (TREE + joint_of("j3", "fixed", "two", "three")).replace('"-1"', '"0.2"', 1))
    np.testing.assert_allclose(from_urdf(path).legs.home_drives, [0.6, 0.0])
    np.testing.assert_allclose(from_urdf(path, home={"j1": 0.3}).legs.home_drives, [0.3, 0.0])


def test_connects_and_joints_of_one_name_are_two_sites(tmp_path):
    connect = '<connect name="pin x" body1="rocker" body2="coupler" anchor="0 0 0.2"/>'
    world = FOUR_BAR.replace('name="pin"', 'name="pin x x"').replace('name="crank" axis', 'name="tool" axis')
    robot = from_mjcf(mjcf(tmp_path, world, connect, servos("tool")), "coupler")
    assert len(set(robot.legs.sites)) == len(robot.legs.sites) == 11 and robot.parts.columns == ["tool_rad"]
    assert robot.parts.drives[0].site == "tool 2"
    crank = np.array([[0.2]])
    turned = _turned(robot.solve(crank, robot.legs.home_mm[None]))
    np.testing.assert_allclose(turned[0, 1], _four_bar_angle(0.2), atol=1e-12)


def test_a_root_that_floats_is_no_part_of_a_chain(tmp_path):
    joints = joint_of("float", "floating", "world", "base") + TREE
    robot = from_urdf(urdf(tmp_path, joints, ("world", "base", "one", "two")), base="base")
    assert robot.parts.columns == ["j1_rad", "j2_mm"]


def test_a_mimicking_joint_beside_the_chain_does_no_harm(tmp_path):
    path = urdf(tmp_path, TREE + joint_of("j3", "revolute", "two", "three", '<mimic joint="j1"/>'))
    assert from_urdf(path, tip="two").parts.columns == ["j1_rad", "j2_mm"]


def test_a_passive_part_beside_the_legs_does_no_harm(tmp_path):
    """A gripper with a tendon, coupled fingers and a loop of its own."""
    gripper = "".join(f'<body name="{jaw}"><joint name="{jaw}"/>{GEOM}</body>' for jaw in ("jaw", "jaw2"))
    world = CRANKED.replace('<body name="tip"', gripper + '<body name="tip"')
    path = mjcf(
        tmp_path,
        world,
        '<joint joint1="jaw" joint2="jaw2"/><connect body1="jaw" body2="jaw2" anchor="0 0 0"/>',
        servos(*CRANKED_JOINTS) + '<position tendon="split"/>',
        '<tendon><fixed name="split"><joint joint="jaw" coef="0.5"/><joint joint="jaw2" coef="0.5"/></fixed></tendon>',
    )
    assert len(from_mjcf(path, "tip").parts.drives) == 6


def test_options_reach_the_robot():
    robot = from_mjcf(
        HEXAPOD, "plate", name="mine", parameter_set="full", tool_mm=(0.0, 0.0, 40.0), length_limit_mm=2.0
    )
    lengths = [one.high for one in robot.parameters if one.unit == "mm"]
    # a drive may have lost its zero
    assert robot.name == "mine" and lengths[:6] == [100.0] * 6 and set(lengths[6:]) == {2.0}
    np.testing.assert_allclose(robot.forward(np.zeros((1, 6)))[0], [0.0, 0.0, 540.0], atol=1e-9)
    assert len(robot.parameters.names) == 42 or robot.gauge


def test_efforts_and_velocities_that_a_file_allows_are_those_of_the_drives(tmp_path):
    arm = from_urdf(ARM)
    np.testing.assert_allclose(arm.velocity_limits, [2.4, 2.4, 2.8, 5.0, 5.0, 7.0])
    np.testing.assert_allclose(arm.effort_limits, [250e3, 250e3, 140e3, 40e3, 40e3, 20e3])
    text = ARM.read_text().replace('effort="250" velocity="2.4"', 'effort="0" velocity="0"')
    unknown = from_urdf(file_of(tmp_path, text, "unknown.urdf"))
    assert np.isnan(unknown.velocity_limits[:2]).all() and np.isnan(unknown.effort_limits[:2]).all()
    assert unknown.velocity_limits[2] == 2.8


def test_the_force_that_an_mjcf_allows_a_servo_is_its_effort(tmp_path):
    assert from_mjcf(HEXAPOD, "plate").effort_limits is None
    limits = '<position forcelimited="true" forcerange="-400 300" name="servo1"'
    limited = HEXAPOD.read_text().replace('<position name="servo1"', limits)
    robot = from_mjcf(file_of(tmp_path, limited, "limited.xml"), "plate")
    assert robot.effort_limits[0] == 300.0 and np.isnan(robot.effort_limits[1:]).all()
    assert robot.velocity_limits is None


def _rotary_hexapod(tmp_path):
    """An MJCF of six cranks and six rods, whose drives have each a range of its own but depend on each other."""
    base, plate = np.radians([-12, 12, 108, 132, 228, 252]), np.radians([-48, 48, 72, 168, 192, 288])
    lean = base + np.radians(35) * np.tile([-1, 1], 3)
    world, connects = f'<body name="plate" pos="0 0 0.32"><freejoint/>{GEOM}</body>', ""
    for k in range(6):
        foot = 0.26 * np.array([np.cos(base[k]), np.sin(base[k]), 0.0])
        ball = 0.11 * np.array([np.cos(plate[k]), np.sin(plate[k]), 0.0])
        crank = 0.18 * np.array([np.cos(lean[k]), np.sin(lean[k]), 0.0])
        rod, axis = ball - foot - crank + np.array([0.0, 0.0, 0.32]), [np.sin(lean[k]), -np.cos(lean[k]), 0.0]
        world += (
            f'<body pos="{text_of(foot)}"><joint name="m{k}" axis="{text_of(axis)}" range="-1.2 1.2"/>{GEOM}'
            f'<body name="rod{k}" pos="{text_of(crank)}" zaxis="{text_of(rod)}"><joint type="ball"/>{GEOM}</body>'
            "</body>"
        )
        connects += f'<connect body1="plate" body2="rod{k}" anchor="{text_of(ball)}"/>'
    return mjcf(tmp_path, world, connects, servos(*(f"m{k}" for k in range(6))))


def test_parameters_of_a_rotary_hexapod_are_separable_without_a_campaign(tmp_path):
    """Each leg has 11: the drive's zero, six of the circle of the crank's ball, the rod's length and three of the ball
    on the plate. The orientation of the plate's own frame, which no position of its origin shows, is no parameter.
    """
    robot = from_mjcf(_rotary_hexapod(tmp_path), "plate", parameter_set="full")
    assert len(robot.parameters) == 6 * 11 - 3
