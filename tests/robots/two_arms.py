"""A torso with two arms, numbers made up: three drives, a passive chest joint that follows two of them, four joints an
arm and a head without drives. Everything by plain products of matrices.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.kinematics.dynamics import GRAVITY_MM_S2
from tests.formats.mjcf import text_of
from tests.kinematics import craig

# Craig's rows: d in mm, theta in degrees, a in mm, alpha in degrees; mass in kg and its centre in mm
TRUNK = {
    "waist": ((110.0, 0.0, 0.0, 0.0), 4.0, (3.0, 12.0, 8.0)),
    "hip": ((0.0, -80.0, 20.0, -90.0), 5.0, (180.0, -14.0, 6.0)),
    "belly": ((5.0, 10.0, 280.0, 3.0), 3.0, (140.0, -25.0, 2.0)),
    "chest": ((0.0, 0.0, 310.0, 0.0), 6.0, (50.0, 70.0, 5.0)),
}
ARMS = {
    "right": {
        "right0": ((0.0, 0.0, 0.0, 10.0), 2.5, (4.0, 20.0, -45.0)),
        "right1": ((15.0, 20.0, 30.0, 90.0), 2.2, (3.0, 110.0, 16.0)),
        "right2": ((300.0, -90.0, 10.0, -80.0), 2.0, (2.0, 16.0, -110.0)),
        "right3": ((20.0, 0.0, 250.0, 70.0), 1.5, (5.0, 100.0, 12.0)),
    },
    "left": {
        "left0": ((0.0, 0.0, 0.0, 170.0), 2.6, (-4.0, -21.0, 44.0)),
        "left1": ((-12.0, 15.0, 28.0, 90.0), 2.1, (-3.0, -112.0, 15.0)),
        "left2": ((-310.0, -90.0, 12.0, -85.0), 1.9, (-2.0, -15.0, 112.0)),
        "left3": ((18.0, 5.0, 245.0, -75.0), 1.6, (6.0, -101.0, 13.0)),
    },
}
BASE, SHOULDERS = (
    ((0, 0, 590), (0, 0, 0)),
    {"right": ((190, 88, -256), (0, 150, 5)), "left": ((185, 90, 260), (4, 30, 0))},
)
HANDS = {"right": ((10, 118, 5), (90, 0, 180)), "left": ((-8, 121, 3), (85, 0, 175))}
HEAD_KG, HEAD_MM, HAND_KG, HAND_MM = 3.0, (230.0, 80.0, 20.0), 2.0, (0.0, 5.0, 90.0)
MARKERS = {"right": (-100.0, -30.0, 90.0), "left": (-95.0, 35.0, 60.0)}
DRIVES = ("waist", "hip", "belly", *ARMS["right"], *ARMS["left"])
HOME_DEG = dict(zip(DRIVES, (5.0, -20.0, 50.0, 20.0, -60.0, 15.0, 70.0, -15.0, 55.0, 25.0, -65.0), strict=True))
FOLLOWS = {"hip": -1.0, "belly": -1.0}


def section(**more):
    """The `robots:` entry."""

    def row(name, numbers, mass, com):
        lengths = dict(zip(("d_mm", "theta_deg", "a_mm", "alpha_deg"), numbers, strict=True))
        own = {"drives": FOLLOWS} if name == "chest" else {"range_deg": [-80.0, 80.0], "home_deg": HOME_DEG[name]}
        return {"name": name, **lengths, **own, "mass_kg": mass, "com_mm": list(com)}

    def fixed(place, **mass):
        return {"xyz_mm": list(place[0]), "rpy_deg": list(place[1]), **mass}

    trunk = [fixed(BASE), *(row(name, *one) for name, one in TRUNK.items())]
    head = {"xyz_mm": [0.0, 0.0, 0.0], "mass_kg": HEAD_KG, "com_mm": list(HEAD_MM)}
    hands = {
        arm: [
            fixed(SHOULDERS[arm]),
            *(row(name, *one) for name, one in rows.items()),
            fixed(HANDS[arm], mass_kg=HAND_KG, com_mm=list(HAND_MM)),
        ]
        for arm, rows in ARMS.items()
    }
    return {"dh": [*trunk, head], "hands": hands, "convention": "modified", **more}


def frames(drives, turned=()):
    """Placements (4, 4) in mm of all rows' frames by name, and of the end effectors by theirs, at drive values (11,).

    turned: by joint's name what it turns further, in rad.
    """
    q = dict(zip(DRIVES, drives, strict=True))
    q["chest"] = -(q["hip"] + q["belly"])
    for name, angle in dict(turned).items():
        q[name] = q[name] + angle
    result, here = {}, craig.fixed(*BASE)
    for name, (numbers, *_) in TRUNK.items():
        result[name] = here = here @ craig.row(numbers, q[name])
    for arm, rows in ARMS.items():
        at = here @ craig.fixed(*SHOULDERS[arm])
        for name, (numbers, *_) in rows.items():
            result[name] = at = at @ craig.row(numbers, q[name])
        result[arm] = at @ craig.fixed(*HANDS[arm])
    return result


def seen(drives, arm, place_mm=(0.0, 0.0, 0.0)):
    """Position (3,) in mm of a point of an end effector's frame."""
    return (frames(drives)[arm] @ [*place_mm, 1.0])[:3]


def masses():
    """Mass in kg and centre in mm of every link by its row, of head and end effectors."""
    links = {name: one[1:] for rows in (TRUNK, *ARMS.values()) for name, one in rows.items()}
    return [*links.items(), ("chest", (HEAD_KG, HEAD_MM)), *((arm, (HAND_KG, HAND_MM)) for arm in ARMS)]


def energy(drives, turned=()):
    """Potential energy in N mm of everything at drive values (11,), joints turned further by name."""
    at = frames(drives, turned)
    return GRAVITY_MM_S2 / 1e3 * sum(mass * (at[name] @ [*com, 1.0])[2] for name, (mass, com) in masses())


def urdf_text():
    """The tree as a URDF in m; a mimic follows one joint, so that the chest's joint is two at one place."""
    joints, links = "", '<link name="base"/><link name="chest_turned"/>'
    links += "".join(_link(arm, HAND_KG, HAND_MM) for arm in ARMS) + _link("head", HEAD_KG, HEAD_MM)
    parent, placement = "base", craig.fixed(*BASE)
    for name, (numbers, mass, com) in TRUNK.items():
        placement, more = placement @ craig.row(numbers, 0.0), ""
        if name == "chest":
            more = '<mimic joint="hip" multiplier="-1" offset="0"/>'
            joints += _joint("chest_turned", parent, placement, more)
            parent, placement, more = "chest_turned", np.eye(4), '<mimic joint="belly" multiplier="-1"/>'
        joints, links = joints + _joint(name, parent, placement, more), links + _link(name, mass, com)
        parent, placement = name, np.eye(4)
    joints += _joint("head", "chest", np.eye(4), kind="fixed")
    for arm, rows in ARMS.items():
        parent, placement = "chest", craig.fixed(*SHOULDERS[arm])
        for name, (numbers, mass, com) in rows.items():
            joints, links = (
                joints + _joint(name, parent, placement @ craig.row(numbers, 0.0)),
                links + _link(name, mass, com),
            )
            parent, placement = name, np.eye(4)
        joints += _joint(arm, parent, craig.fixed(*HANDS[arm]), kind="fixed")
    return f'<robot name="two_arms">{links}{joints}</robot>'


def _link(name, mass, com):
    inertia = '<inertia ixx="1e-9" iyy="1e-9" izz="1e-9" ixy="0" ixz="0" iyz="0"/>'
    origin = f'<origin xyz="{text_of(np.asarray(com) / 1e3)}"/>'
    return f'<link name="{name}"><inertial>{origin}<mass value="{mass}"/>{inertia}</inertial></link>'


def _joint(child, parent, placement, more="", kind="revolute"):
    rpy = Rotation.from_matrix(placement[:3, :3]).as_euler("xyz")
    limit = '<axis xyz="0 0 1"/><limit lower="-1.4" upper="1.4" effort="1" velocity="1"/>' if kind == "revolute" else ""
    return (
        f'<joint name="{child}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{text_of(placement[:3, 3] / 1e3)}" rpy="{text_of(rpy)}"/>{limit}{more}</joint>'
    )
