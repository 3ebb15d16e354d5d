"""Robots written back as MJCF and URDF: read again, by this package and by MuJoCo, they stand where errors put them."""

from dataclasses import replace
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rrru.formats.file_changes import Found
from rrru.formats.mjcf_home import closed_qpos
from rrru.formats.mjcf_reader import backlash_joints
from rrru.formats.mjcf_writer import to_mjcf
from rrru.formats.robot_file import from_mjcf, from_urdf
from rrru.formats.urdf_writer import to_urdf
from rrru.robots.delta import Delta
from rrru.robots.rrru3 import Rrru3
from tests.formats.mjcf import (
    ARM,
    CRANKED,
    CRANKED_JOINTS,
    HEXAPOD,
    delta_mjcf,
    file_of,
    mjcf,
    rrru3_mjcf,
    rrs3_mjcf,
    servos,
)

_MODELS = {
    "cranked": (lambda folder: mjcf(folder, CRANKED, actuators=servos(*CRANKED_JOINTS)), "tip"),
    "jointed platform": (lambda folder: mjcf(folder, CRANKED, actuators=servos(*CRANKED_JOINTS)), "c"),
    "hexapod": (lambda _: HEXAPOD, "plate"),
    "welds": (lambda folder: rrru3_mjcf(folder, Rrru3()), "plate"),
    "loose rods": (lambda folder: delta_mjcf(folder, Delta(), "loose"), "plate"),
    "rods of the plate": (lambda folder: delta_mjcf(folder, Delta(), "plate"), "plate"),
}
_CHAINS = (None, None), ("base_link", "flange"), ("upper_arm", "wrist"), ("tool0", "base_link")
_seeds = st.integers(0, 2**32 - 1)


def _drawn(robot, seed):
    """Errors at every site but the tool, about a millimetre and a few milliradians, as twists (1, sites, 6)."""
    twists = np.random.default_rng(seed).standard_normal((1, len(robot.legs.sites), 6)) * [
        1.0,
        1.0,
        1.0,
        3e-3,
        3e-3,
        3e-3,
    ]
    twists[:, robot.legs.site_numbers["tool"]] = 0.0
    return twists


def _found(robot, twists, **more):
    return Found(dict(zip(robot.legs.sites, twists[0], strict=True)), **more)


def _written(folder, text, suffix="xml"):
    return file_of(folder, text, f"corrected.{suffix}")


def _check(robot, again, twists, seed):
    """Places and turns of a robot with errors are those of the one that was read again."""
    low, high = robot.drive_range.T
    actuators = robot.legs.home_drives + 0.1 * (high - low) * (np.random.default_rng(seed).random((10, len(low))) - 0.5)
    poses = robot.solve(actuators, np.tile(robot.legs.home_mm, (10, 1)), twists)
    others = again.solve(actuators, np.tile(again.legs.home_mm, (10, 1)))
    assert poses.closed.all()
    np.testing.assert_allclose(again.measured(others, again.twists()), robot.measured(poses, twists), rtol=0, atol=1e-6)
    world = Rotation.from_rotvec(twists[0, robot.legs.site_numbers["world"], 3:]).as_matrix()
    np.testing.assert_allclose(others.turn, world @ poses.turn, rtol=0.0, atol=1e-9)
    return actuators, robot.measured(poses, twists)


@pytest.mark.parametrize("name", _MODELS)
@settings(max_examples=4, deadline=None)
@given(seed=_seeds)
def test_an_mjcf_holds_errors_of_all_its_sites(name, tmp_path_factory, seed):
    folder = tmp_path_factory.mktemp("mjcf")
    make, platform = _MODELS[name]
    file = make(folder)
    robot = from_mjcf(file, platform)
    twists = _drawn(robot, seed)
    text, lost = to_mjcf(file, platform, _found(robot, twists), folder)
    again = from_mjcf(_written(folder, text), platform)
    assert not lost and again.legs.sites == robot.legs.sites
    _check(robot, again, twists, seed)


@pytest.mark.parametrize("chain", _CHAINS)
@settings(max_examples=4, deadline=None)
@given(seed=_seeds)
def test_a_urdf_holds_errors_of_all_its_sites(chain, tmp_path_factory, seed):
    folder = tmp_path_factory.mktemp("urdf")
    robot = from_urdf(ARM, *chain)
    twists = _drawn(robot, seed)
    text, lost = to_urdf(ARM, _found(robot, twists), folder, *chain)
    assert not lost
    _check(robot, from_urdf(_written(folder, text, "urdf"), *chain), twists, seed)


def test_mujoco_stands_where_the_calibrated_arm_does(tmp_path):
    robot = from_urdf(ARM)
    twists = _drawn(robot, 3)
    path = _written(tmp_path, to_urdf(ARM, _found(robot, twists), tmp_path)[0], "urdf")
    spec = mujoco.MjSpec.from_file(str(path))
    spec.compiler.fusestatic = False
    spec.compiler.boundmass = spec.compiler.boundinertia = 1e-12
    model = spec.compile()
    actuators, places = _check(robot, from_urdf(path), twists, 4)
    data = mujoco.MjData(model)
    for values, place in zip(actuators, places, strict=True):
        data.qpos[:] = values
        mujoco.mj_kinematics(model, data)
        np.testing.assert_allclose(1000.0 * data.body("tool0").xpos, place, rtol=0.0, atol=1e-6)


def test_mujoco_closes_the_corrected_hexapod_where_the_calibrated_one_stands(tmp_path):
    robot = from_mjcf(HEXAPOD, "plate")
    twists = _drawn(robot, 5)
    path = _written(tmp_path, to_mjcf(HEXAPOD, "plate", _found(robot, twists), tmp_path)[0])
    model = mujoco.MjModel.from_xml_path(str(path))
    actuators, places = _check(robot, from_mjcf(path, "plate"), twists, 6)
    data, held = mujoco.MjData(model), [model.joint(f"leg{k}").id for k in range(1, 7)]
    for values, place in zip(actuators, places, strict=True):
        mujoco.mj_resetDataKeyframe(model, data, 0)
        data.qpos[model.jnt_qposadr[held]] = values / 1000.0
        data.qpos[:] = closed_qpos(model, data.qpos, held)
        mujoco.mj_kinematics(model, data)
        np.testing.assert_allclose(1000.0 * data.body("plate").xpos, place, rtol=0.0, atol=1e-6)


def test_the_keyframe_is_closed_and_has_a_place_for_every_joint(tmp_path):
    robot = from_mjcf(HEXAPOD, "plate")
    found = _found(
        robot, _drawn(robot, 7), play={k: (0.05, 1e-3) for k in range(6)}, loads=dict.fromkeys(range(6), 50.0)
    )
    path = _written(tmp_path, to_mjcf(HEXAPOD, "plate", found, tmp_path)[0])
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    assert len(backlash_joints(model)) == 6 and np.abs(data.efc_pos[: data.ne]).max() < 1e-11
    assert from_mjcf(path, "plate").parts.columns == robot.parts.columns


def test_a_corrected_file_can_be_corrected_again(tmp_path):
    """Its own anchors, backlash and frames are replaced, not doubled."""
    robot = from_mjcf(HEXAPOD, "plate")
    more = {"play": {2: (0.05, 1e-3)}, "loads": {2: 50.0}, "reflectors": {"ball": np.array([60.0, 0.0, 40.0])}}
    first, second = _drawn(robot, 8), _drawn(robot, 9)
    path = _written(tmp_path, to_mjcf(HEXAPOD, "plate", _found(robot, first, **more), tmp_path)[0])
    before = from_mjcf(path, "plate")
    again = file_of(tmp_path, to_mjcf(path, "plate", _found(before, second, **more), tmp_path)[0], "again.xml")
    model = mujoco.MjModel.from_xml_path(str(again))
    assert len(backlash_joints(model)) == model.ntendon == 1 and model.nsite == 13
    _check(before, from_mjcf(again, "plate"), second, 10)
    tool = Found({"tool": np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])})
    arm = _written(tmp_path, to_urdf(ARM, tool, tmp_path)[0], "urdf")
    twice = Found({"tool": np.array([2.0, 0.0, 0.0, 0.0, 0.0, 0.0])})
    text, _ = to_urdf(arm, twice, tmp_path, tip="tool0")
    assert text.count('"measured_tool"') == 2 and 'xyz="0.002 0 0"' in text


@pytest.mark.parametrize(("side", "axis"), [("rods", "y"), ("plate", "y")])
def test_axes_of_a_ball_joint_that_do_not_meet_are_named(tmp_path, side, axis):
    file = rrs3_mjcf(tmp_path, side)
    twist = {f"ball2 {axis}": np.array([0.3, 0.2, 0.1, 0.0, 0.0, 0.0])}
    text, lost = to_mjcf(file, "plate", Found(twist), tmp_path)
    assert [one.partition(":")[0] for one in lost] == [f"ball2 {axis}"]
    assert "corrected" not in text


def test_what_is_written_beside_the_numbers(tmp_path):
    """The user's names and comments, what stood there, and standard errors."""
    step = {"axis3": np.array([[0.0, 0.0, 0.02, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 3e-4, 0.0, 0.0]])}
    found = Found({"axis3": np.array([0.0, 0.0, 0.4, 1e-3, 0.0, 0.0])}, step)
    text, _ = to_urdf(ARM, found, tmp_path)
    changed = [line for line in text.splitlines() if line not in ARM.read_text().splitlines()]
    note, origin = changed
    was = 'was xyz="0 0 0.52"'
    assert note.strip() == f"<!-- corrected: xyz +- 0 0 2e-05 m, turn about own axes +- 0.0003 0 0 rad; {was} -->"
    assert '<origin xyz="0 0 0.5204" rpy="0.001 0 0"/>' in origin
    untouched, _ = to_mjcf(HEXAPOD, "plate", Found({}), tmp_path)
    assert ElementTree.canonicalize(untouched, strip_text=True) == ElementTree.canonicalize(
        HEXAPOD.read_text(), strip_text=True
    )


def test_tool_and_reflectors_are_frames_on_the_platform(tmp_path):
    robot = replace(from_mjcf(HEXAPOD, "plate"), tool_mm=(10.0, 0.0, 30.0))
    tool, own = np.array([1.0, 2.0, 3.0, 0.01, -0.02, 0.03]), np.array([0.5, -0.5, 0.2, 0.0, 0.0, 0.0])
    found = Found({"tool": tool, "ball": own}, reflectors={"ball": np.array([60.0, 0.0, 40.0])}, tool_mm=robot.tool_mm)
    path = _written(tmp_path, to_mjcf(HEXAPOD, "plate", found, tmp_path)[0])
    model = mujoco.MjModel.from_xml_path(str(path))
    turn = Rotation.from_rotvec(tool[3:])
    np.testing.assert_allclose(1000.0 * model.site("measured_tool").pos, [11.0, 2.0, 33.0], atol=1e-9)
    np.testing.assert_allclose(model.site("measured_tool").quat, turn.as_quat(scalar_first=True), atol=1e-9)
    expected = np.array([11.0, 2.0, 33.0]) + turn.apply([50.0, 0.0, 10.0]) + own[:3]
    np.testing.assert_allclose(1000.0 * model.site("ball").pos, expected, atol=1e-9)
    arm, _ = to_urdf(ARM, replace(found, tool_mm=(0.0, 0.0, 0.0)), tmp_path)
    place = next(one for one in ElementTree.fromstring(arm).iter("joint") if one.get("name") == "measured_tool_mount")
    assert place.find("parent").get("link") == "tool0" and place.find("origin").get("xyz") == "0.001 0.002 0.003"


def test_a_frame_on_the_tip_without_an_origin_gets_one(tmp_path):
    found = Found({"tool": np.array([1.0, 2.0, 3.0, 0.0, 0.0, 0.0])})
    root = ElementTree.fromstring(to_urdf(ARM, found, tmp_path)[0])
    mount = next(one for one in root.iter("joint") if one.get("name") == "measured_tool_mount")
    mount.remove(mount.find("origin"))
    path = _written(tmp_path, ElementTree.tostring(root, encoding="unicode"), "urdf")
    again = ElementTree.fromstring(to_urdf(path, found, tmp_path, tip="tool0")[0])
    mount = next(one for one in again.iter("joint") if one.get("name") == "measured_tool_mount")
    assert mount.find("origin").attrib == {"xyz": "0.001 0.002 0.003", "rpy": "0 0 0"}


def test_files_beside_a_urdf_are_found_from_the_new_place_and_plugins_keep_their_names(tmp_path):
    extra = (
        '<gazebo><plugin name="control" filename="libgazebo_ros2_control.so"/></gazebo>'
        '<link name="shape"><visual><geometry><mesh filename="meshes/arm.stl"/></geometry></visual></link>'
        '<joint name="shape_joint" type="fixed"><parent link="tool0"/><child link="shape"/></joint></robot>'
    )
    old, new = tmp_path / "old", tmp_path / "new"
    for folder in (old / "meshes", new):
        folder.mkdir(parents=True)
    path = old / "arm.urdf"
    path.write_text(ARM.read_text().replace("</robot>", extra))
    robot = from_urdf(path, tip="tool0")
    text, _ = to_urdf(path, _found(robot, robot.twists()), new, tip="tool0")
    assert 'filename="libgazebo_ros2_control.so"' in text and 'filename="../old/meshes/arm.stl"' in text
