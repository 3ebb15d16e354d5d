"""Robots as URDF and MJCF for tests: an arm with every oddity, closed loops, and the robots that have files."""

import numpy as np
from scipy.spatial.transform import Rotation

from tests.places import ROOT

ARM, HEXAPOD = ROOT / "data/models/arm6.urdf", ROOT / "data/models/hexapod.xml"
GEOM = '<geom size="0.02" mass="0.3"/>'


def text_of(values):
    return " ".join(repr(float(value)) for value in values)


def quaternion(turn):
    """MuJoCo's quaternion of a turn (3, 3), as text."""
    return text_of(Rotation.from_matrix(turn).as_quat(scalar_first=True))


def file_of(tmp_path, text, name="robot.xml"):
    path = tmp_path / name
    path.write_text(text)
    return path


def mjcf(tmp_path, world, equality="", actuators="", more=""):
    """An MJCF of its parts, angles in rad."""
    return file_of(
        tmp_path,
        f"""<mujoco><compiler angle="radian"/><default><geom contype="0" conaffinity="0"/></default>
        <worldbody>{world}</worldbody><equality>{equality}</equality><actuator>{actuators}</actuator>{more}</mujoco>""",
    )


def servos(*joints):
    return "".join(f'<position joint="{joint}" kp="100"/>' for joint in joints)


CRANKED = f"""
<body name="a" pos="0.1 0.2 0.3" euler="0.3 -0.2 0.1">
  <joint name="turn" axis="1 2 3" pos="0.05 -0.02 0.1" ref="0.4" range="-1 2" limited="true"/>
  <joint name="push" type="slide" axis="0 1 1" pos="0.3 0.1 0.2" ref="0.05"/>{GEOM}
  <body name="b" pos="0.2 0 0.4" quat="1 2 3 4">
    <joint name="one" axis="0 -1 0" pos="0 0 -0.1"/><joint name="two" axis="1 0 0" pos="0.1 0 0"/>
    <joint name="world" axis="0 0 1" ref="-0.3"/>{GEOM}
    <body name="c" pos="0 0.1 0.2" euler="0 1 0"><body name="d" pos="0.01 0.02 0.03"><joint name="last"/>{GEOM}
    <body name="tip" pos="0.1 0.2 0.3" euler="1 1 1"/></body></body>
  </body>
</body>"""
CRANKED_JOINTS = ("turn", "push", "one", "two", "world", "last")


FOUR_BAR = f"""
<body name="crank"><joint name="crank" axis="0 1 0"/>{GEOM}
  <body name="coupler" pos="0 0 0.1"><joint name="pin" axis="0 1 0"/>{GEOM}</body></body>
<body name="rocker" pos="0.3 0 0"><joint name="pivot" axis="0 1 0"/>{GEOM}</body>"""


RRRU3_HOME = np.array([20.0, -30.0, 700.0])


def rrru3_mjcf(tmp_path, robot):
    """The 3-RRRU as bodies and hinges, zero where its own joints are, the ends of its three legs welded to the plate.

    At RRRU3_HOME to a tenth of a micrometre and a microradian: the key's numbers are rounded.
    """
    theta = robot.inverse([RRRU3_HOME])
    passive = iter(robot.passive_near([RRRU3_HOME], theta)[0])
    world, welds, keys = '<body name="plate"><freejoint/><geom size="0.1" mass="3"/></body>', "", ""
    for number, leg in enumerate(robot.legs.legs, 1):
        ends, placement = "", np.eye(4)
        for joint in leg.joints:
            placement = placement @ placed(joint.turn, joint.shift_mm)
            if joint.kind == "R":
                world += f'<body name="{joint.name}" {pose(placement)}>{GEOM}'
                world += f'<joint name="{joint.name}" axis="{text_of(joint.axis)}"/>'
                ends, placement = ends + "</body>", np.eye(4)
                keys += f" {theta[0, joint.drive] if joint.drive is not None else next(passive):.6f}"
        world += f'<body name="hand{number}" {pose(placement)}>{GEOM}</body>{ends}'
        relative = f"0 0 0 {quaternion(leg.end_turn)}"
        welds += f'<weld name="weld{number}" body1="hand{number}" body2="plate" relpose="{relative}"/>'
    key = f'<keyframe><key qpos="{text_of(RRRU3_HOME / 1000.0)} 1 0 0 0 {keys}"/></keyframe>'
    return mjcf(tmp_path, world, welds, servos(*(f"leg {k} drive" for k in (1, 2, 3))), key)


def placed(turn, shift):
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = turn, shift
    return result


def pose(placement):
    """Attributes of a body at a placement in mm."""
    return f'pos="{text_of(placement[:3, 3] / 1000.0)}" quat="{quaternion(placement[:3, :3])}"'


def delta_mjcf(tmp_path, robot, rods="ball"):
    """The Delta at zero drive angles: arms, on each two rods on ball joints, which connects hold to the plate.

    rods: "ball" as said; "plate": on ball joints of the plate, connects at the arms; "loose": connects at both ends.
    """
    half, radius = 0.5 * robot.spacing_mm / 1000.0, robot.platform_mm / 1000.0
    arms, loose, plate, connects = "", "", "", ""
    for leg, azimuth in enumerate(robot.azimuth_rad, 1):
        turn = Rotation.from_euler("z", azimuth).as_matrix()
        at = turn @ [robot.a_mm + robot.platform_mm, 0.0, 0.0] + [0.0, 0.0, robot.origin_depth_mm]
        own = ""
        for name, side in (("a", -half), ("b", half)):
            rod = f"rod {leg}{name}"
            elbow = np.array([robot.l1_mm / 1000.0, side, 0.0])
            start, end = turn @ elbow + at / 1000.0, turn @ [radius, side, 0.0]
            ball = f'<joint name="{rod}" type="ball"/>'
            if rods == "ball":
                own += f'<body name="{rod}" pos="{text_of(elbow)}">{ball}{GEOM}</body>'
                connects += f'<connect name="end {rod}" body1="plate" body2="{rod}" anchor="{text_of(end)}"/>'
            elif rods == "plate":
                plate += f'<body name="{rod}" pos="{text_of(end)}">{ball}{GEOM}</body>'
                connects += f'<connect body1="arm {leg}" body2="{rod}" anchor="{text_of(elbow)}"/>'
            else:
                loose += f'<body name="{rod}" pos="{text_of(start)}"><freejoint/>{GEOM}</body>'
                connects += f'<connect body1="{rod}" body2="arm {leg}" anchor="0 0 0"/>'
                connects += f'<connect body1="plate" body2="{rod}" anchor="{text_of(end)}"/>'
        arms += f"""<body name="arm {leg}" pos="{text_of(at / 1000.0)}" quat="{quaternion(turn)}">
        <joint name="theta{leg}" axis="0 1 0" range="-1 1.2" limited="true"/>{GEOM}{own}</body>"""
    arms += f'<body name="plate"><freejoint/><geom size="0.05" mass="1"/>{plate}</body>{loose}'
    return mjcf(tmp_path, arms, connects, servos("theta1", "theta2", "theta3"))


def rrs3_mjcf(tmp_path, side, key=""):
    """A 3-RRS: driven cranks, rods on hinges, balls at the plate, of which the first leg carries it.

    side: "rods" as said, connects at the other two balls; "plate": all rods are on balls of a free plate, two connects
    to the crank make a rod's hinge.
    """
    world, plate, connects = "", "", ""
    for leg, azimuth in enumerate((0.0, 2.0, 4.0), 1):
        turn = Rotation.from_euler("z", azimuth).as_matrix()
        crank = f'<joint name="crank{leg}" axis="0 1 0"/>{GEOM}'
        place, knee = pose(placed(turn, turn @ [300.0, 0.0, 0.0])), np.array([0.1, 0.0, 0.2])
        ball = turn @ [0.2, 0.0, 0.0]
        if side == "plate":
            plate += f'<body name="rod{leg}" pos="{text_of(ball)}" quat="{quaternion(turn)}">'
            plate += f'<joint name="ball{leg}" type="ball"/>{GEOM}</body>'
            for y in (-0.03, 0.04):
                anchor = text_of([knee[0], y, knee[2]])
                connects += f'<connect name="knee{leg}{y}" body1="crank{leg}" body2="rod{leg}" anchor="{anchor}"/>'
            world += f'<body name="crank{leg}" {place}>{crank}</body>'
            continue
        own = ""
        if leg == 1:
            own = f'<body name="plate" pos="-0.4 0 0.25"><joint name="ball1" type="ball" pos="0.2 0 0"/>{GEOM}</body>'
        else:
            connects += f'<connect name="ball{leg}" body1="plate" body2="rod{leg}" anchor="{text_of(ball)}"/>'
        rod = f'<body name="rod{leg}" pos="{text_of(knee)}"><joint name="knee{leg}" axis="0 1 0"/>{GEOM}{own}</body>'
        world += f'<body name="crank{leg}" {place}>{crank}{rod}</body>'
    if side == "plate":
        world += f'<body name="plate" pos="0 0 0.45"><freejoint/>{GEOM}{plate}</body>'
    return mjcf(tmp_path, world, connects, servos("crank1", "crank2", "crank3"), key)


LINK = '<link name="{}"><visual><geometry><mesh filename="package://none/a.stl"/></geometry></visual></link>'


def urdf(tmp_path, joints, links=("base", "one", "two", "three"), before=""):
    names = "".join(LINK.format(name) for name in links)
    return file_of(tmp_path, f'<robot name="r">{before}{names}{joints}</robot>', "robot.urdf")


def joint_of(name, kind, parent, child, more=""):
    limit = '<limit lower="-1" upper="1" effort="1" velocity="1"/>' if kind in ("revolute", "prismatic") else ""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0.1 0 0.2"/><axis xyz="0 0 1"/>{limit}{more}</joint>'
    )


TREE = joint_of("j1", "revolute", "base", "one") + joint_of("j2", "prismatic", "one", "two")
