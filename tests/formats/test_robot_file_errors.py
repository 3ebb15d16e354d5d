"""Every file that `rrru.formats.robot_file` refuses, by its message."""

import pytest

from rrru.errors import ConfigError
from rrru.formats.robot_file import from_mjcf, from_urdf
from rrru.robots.delta import Delta
from tests.formats.mjcf import (
    FOUR_BAR,
    GEOM,
    HEXAPOD,
    TREE,
    delta_mjcf,
    file_of,
    joint_of,
    mjcf,
    servos,
    urdf,
)


def _refused(pattern, call, *arguments, **options):
    with pytest.raises(ConfigError, match=pattern) as caught:
        call(*arguments, **options)
    return str(caught.value)


FIXED = TREE + joint_of("j3", "fixed", "two", "three")


@pytest.mark.parametrize(
    ("joints", "options", "pattern"),
    [
        (
            TREE + joint_of("j3", "fixed", "one", "three"),
            {},
            r"no tip is given; allowed: one of two, three; state as `tip` \(--tip\)",
        ),
        (FIXED, {"tip": "hand"}, "tip is 'hand'; allowed: base, one, two, three"),
        (FIXED, {"base": "foot"}, "base is 'foot'"),
        (FIXED, {"home": {"j9": 1.0}}, "home has 'j9'; allowed: j1, j2"),
        (FIXED, {"tip": "base"}, "body base is fixed to the base"),
        (TREE + joint_of("j3", "planar", "two", "three"), {}, "joint j3 is of the type planar; allowed: revolute"),
        (TREE + joint_of("j3", "floating", "two", "three"), {}, "free joint"),
        (TREE + joint_of("j3", "screw", "two", "three"), {}, "invalid joint type"),
        (FIXED, {"colour": 3}, "unknown key 'colour'; allowed: among, angle"),
        (FIXED, {"parameter_set": "x"}, "parameter_set is 'x'"),
        (TREE.replace("revolute", "fixed").replace("prismatic", "fixed"), {"tip": "two"}, "is fixed to the base"),
    ],
)
def test_errors_of_a_urdf(tmp_path, joints, options, pattern):
    path = urdf(tmp_path, joints)
    assert "robot" in _refused(pattern, from_urdf, path, **options)


@pytest.mark.parametrize(
    ("text", "pattern"),
    [
        ("<robot>", "no element found"),
        ("<mujoco/>", "its root is 'mujoco'"),
        ('<robot name="r"/>', "it has no link; allowed: a URDF with links and joints"),
        ('<robot name="r" xmlns:xacro="http://wiki.ros.org/xacro"><xacro:macro/><link name="a"/></robot>', "xacro"),
    ],
)
def test_a_file_that_is_no_urdf_is_refused(tmp_path, text, pattern):
    assert "bad.urdf" in _refused(pattern, from_urdf, file_of(tmp_path, text, "bad.urdf"))


def test_a_file_that_is_not_there_or_cannot_be_read_is_refused(tmp_path):
    for call in (lambda path: from_urdf(path), lambda path: from_mjcf(path, "plate")):
        _refused("none.xml: there is no such file", call, tmp_path / "none.xml")
    _refused("Schema violation|Unrecognized|XML", from_mjcf, file_of(tmp_path, "<mujoco><foo/></mujoco>"), "plate")
    _refused("XML parse error", from_mjcf, file_of(tmp_path, "<mujoco><worldbody>"), "plate")


CONNECT = '<connect name="loop" body1="rocker" body2="coupler" anchor="0 0 0.2"/>'
OPEN = '<keyframe><key qpos="0.3 0 0"/></keyframe>'
PULL = '<tendon><fixed name="t"><joint joint="pivot" coef="1"/></fixed></tendon>'
PLATE = FOUR_BAR + f'<body name="plate"><freejoint/>{GEOM}</body>'
BALL = FOUR_BAR.replace('name="crank" axis="0 1 0"', 'name="crank" type="ball"')
NARROW = FOUR_BAR.replace('name="crank" axis', 'name="crank" limited="true" range="0 1" axis')
SITES = FOUR_BAR.replace('<joint name="pivot"', '<site name="top" pos="0 0 0.2"/><joint name="pivot"').replace(
    '<joint name="pin"', '<site name="arm" pos="0.3 0.0005 0.1"/><joint name="pin"'
)
SECOND, THIRD = CONNECT.replace("loop", "l2"), CONNECT.replace("loop", "l3")


@pytest.mark.parametrize(
    ("changes", "pattern"),
    [
        ({"platform": "plate"}, "platform is 'plate'; allowed: crank, coupler, rocker"),
        ({"actuators": ""}, "no actuator drives a joint of the legs"),
        ({"more": OPEN}, r"leg through pivot, loop misses the platform by \d+\.\d+ mm"),
        (
            {"equality": CONNECT + '<joint joint1="crank" joint2="pivot"/>'},
            "joint crank follows pivot and has an actuator, too",
        ),
        (
            {"equality": CONNECT + '<tendon name="pull" tendon1="t"/>', "more": PULL},
            "equality pull is of the kind tendon; allowed: connect, weld, joint",
        ),
        ({"actuators": '<position joint="crank" gear="2"/>'}, "actuator 1 has the gear 2; allowed: 1"),
        (
            {"world": BALL, "actuators": '<motor name="m" joint="crank"/>'},
            "m drives the ball joint crank; allowed: hinge, slide",
        ),
        (
            {"actuators": servos("crank") + '<motor name="winch" tendon="t"/>', "more": PULL},
            "winch drives by tendon; allowed: a joint",
        ),
        ({"equality": CONNECT + SECOND.replace("0 0 0.2", "0 0.1 0.2") + THIRD}, "3 connects between"),
        ({"equality": CONNECT + SECOND}, "loop and l2 are at one point"),
        (
            {"world": NARROW, "actuators": '<position joint="crank" ctrllimited="true" ctrlrange="2 3"/>'},
            "joint crank works from 2 to 1; allowed: a range that is not empty",
        ),
        (
            {"world": SITES, "equality": '<connect site1="top" site2="arm"/>'},
            r"the loops stay open by 0\.\d+ mm; allowed: up to 0.01 mm",
        ),
        ({"equality": ""}, r"free to turn about the direction y through the platform"),
        ({"world": PLATE, "platform": "plate"}, "no joints lead from the base to plate"),
        (
            {"world": PLATE, "equality": CONNECT + '<weld body1="plate"/>', "platform": "plate"},
            "body plate is fixed to the base",
        ),
    ],
)
def test_errors_of_an_mjcf(tmp_path, changes, pattern):
    """A four-bar linkage with a driven crank, of which something is different."""
    parts = {"world": FOUR_BAR, "equality": CONNECT, "actuators": servos("crank"), "platform": "coupler"} | changes
    platform = parts.pop("platform")
    assert "robot.xml" in _refused(pattern, from_mjcf, mjcf(tmp_path, **parts), platform)


def test_a_passive_joint_of_several_legs_that_leaves_the_platform_free_is_refused(tmp_path):
    text = delta_mjcf(tmp_path, Delta()).read_text().replace('<position joint="theta2" kp="100"/>', "")
    _refused("body plate is free to shift along", from_mjcf, file_of(tmp_path, text), "plate")


def test_a_joint_behind_which_legs_have_met_is_refused_by_name(tmp_path):
    text = (
        HEXAPOD.read_text()
        .replace(
            '<geom type="cylinder" size="0.18 0.01" mass="4"/>',
            f'<geom size="0.01" mass="4"/><body name="tool"><joint name="spindle"/>{GEOM}</body>',
        )
        .replace("0.5 1 0 0 0  0", "0.5 1 0 0 0 0  0")
        .replace("</actuator>", '<motor joint="spindle"/></actuator>')
    )
    _refused("joint spindle is in leg 1, leg 2, .* behind different joints", from_mjcf, file_of(tmp_path, text), "tool")


@pytest.mark.parametrize(
    ("removed", "pattern"),
    [
        ((), None),
        (
            (1,),
            "body plate is free to turn about the direction .* through .* mm while shifting along it by .* mm per rad",
        ),
        ((1, 2, 3, 4, 5, 6), "no joints lead from the base to plate"),
    ],
)
def test_the_hexapod_without_some_legs_says_how_its_plate_moves(tmp_path, removed, pattern):
    lines = [line for line in HEXAPOD.read_text().splitlines() if not any(f'name="ball{k}"' in line for k in removed)]
    path = file_of(tmp_path, "\n".join(lines))
    if pattern:
        _refused(pattern, from_mjcf, path, "plate")
    else:
        from_mjcf(path, "plate")


@pytest.mark.parametrize(
    ("joints", "pattern"),
    [
        (
            '<joint name="q" axis="0 0 1"/>',
            "free to turn about the vertical through the platform at the home pose; allowed",
        ),
        (
            '<joint name="q" axis="0 0 1" pos="0.1 0 0"/>',
            r"turn about the vertical through \(100.000, 0.000, \d+.000\) mm",
        ),
        ('<joint name="q" type="slide" axis="1 0 0"/>', "free to shift along the direction x"),
        (
            '<joint name="q" type="slide" axis="1 1 0"/><joint name="s" axis="0 0 1"/>',
            r"free to shift along the direction \(0.707, 0.707, 0.000\); turn about the vertical through the platform",
        ),
        ('<joint name="q" type="ball"/>', "free to turn about the .*; turn about the .*; turn about the .* through"),
    ],
)
def test_free_motions_are_said_in_words(tmp_path, joints, pattern):
    world = f"""<body name="a"><joint name="lift" type="slide" axis="0 0 1"/>{GEOM}
    <body name="plate" pos="0 0 0.2">{joints}{GEOM}</body></body>"""
    _refused(pattern, from_mjcf, mjcf(tmp_path, world, actuators=servos("lift")), "plate")
