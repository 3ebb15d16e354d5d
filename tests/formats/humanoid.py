"""An elastic humanoid's torso and right arm: ten drives, and a passive third torso joint that keeps the chest upright.

DH numbers, masses and fixed frames of DLR's Agile Justin as published with Tenhumberg and Baeuml, "Calibration of an
Elastic Humanoid Upper Body and Efficient Compensation for Motion Planning", Humanoids 2021.
"""

import warnings

import numpy as np
from scipy.spatial.transform import Rotation

from tests.formats.mjcf import file_of, text_of
from tests.kinematics import craig

# Craig's rows: d in m, theta, a in m, alpha; the fourth one's joint turns by -(q1 + q2)
TORSO = ((0.1055, 0, 0, 0), (0, -90, 0, -90), (0, 0, 0.3, 0), (0, 0, 0.3, 0))
ARM = (
    *((0, 0, 0, 0), (0, 0, 0, 90), (0.4, -90, 0, -90), (0, 0, 0, 90), (0.39, -180, 0, -90), (0, 90, 0, 90)),
    (0, -90, 0, 90),
)
BASE, SHOULDER, HAND = ((0, 0, 588.4), (0, 0, 0)), ((190, 88, -256), (0, 150, 0)), ((0, 118, 0), (90, 0, 180))
MARKER_MM = (-100.0, -30.0, 100.0)
# masses in kg and centres in m in the rows' frames
MASSES = (
    (4.651, (0.0013342422, 0.015386544, 0.0074260405)),
    (5.47, (0.21859133, -0.013019641, 0.0062231342)),
    (2.925, (0.15320139, -0.022720538, 0.0019282567)),
    (5.759, (0.053666155, 0.07457050, 0.00068257189)),
    (2.637, (-0.00041410813, 0.020290376, -0.045943169)),
    (2.326, (-2.9e-05, 0.11406515, 0.016447191)),
    (2.239, (-3.0e-05, 0.01651189, -0.11329461)),
    (2.204, (-3.1e-05, 0.11374485, 0.016369065)),
    (1.101, (0.00010916025, 0.021900792, -0.10562437)),
    (1.641, (0.00049984737, -0.0078452020, -0.0087059954)),
    (0.675, (0.02908318, 0.078114352, 0.019575027)),
)
NAMES = ("torso0", "torso1", "torso2", "chest", *(f"right{k}" for k in range(7)))
DRIVES = tuple(name for name in NAMES if name != "chest")
HOME_DEG = (5.0, -20.0, 50.0, *(20.0, -60.0, 15.0, 70.0, 10.0, -30.0, 25.0))
FOLLOWS = {"torso1": -1.0, "torso2": -1.0}


def section(**more):
    """The `robots:` entry."""
    homes, rows = dict(zip(DRIVES, HOME_DEG, strict=True)), []
    for name, (d, theta, a, alpha), (mass, com) in zip(NAMES, (*TORSO, *ARM), MASSES, strict=True):
        row = {"name": name, "d_mm": 1e3 * d, "theta_deg": theta, "a_mm": 1e3 * a, "alpha_deg": alpha}
        own = {"drives": FOLLOWS} if name == "chest" else {"range_deg": [-90.0, 90.0], "home_deg": homes[name]}
        rows.append(row | own | {"mass_kg": mass, "com_mm": [1e3 * x for x in com]})
    fixed = [{"xyz_mm": list(xyz), "rpy_deg": list(rpy)} for xyz, rpy in (BASE, SHOULDER, HAND)]
    return {
        "dh": [fixed[0], *rows[:4], fixed[1], *rows[4:], fixed[2]],
        "convention": "modified",
        "tool_mm": list(MARKER_MM),
        **more,
    }


def _fixed(xyz_mm, rpy_deg):
    """Placement (4, 4) in m."""
    return craig.fixed(np.asarray(xyz_mm) / 1e3, rpy_deg)


def frames(drives):
    """Placements (4, 4) in m of the eleven rows' frames and of the tool, at drive values (10,), by products."""
    q = dict(zip(DRIVES, drives, strict=True))
    q["chest"] = -(q["torso1"] + q["torso2"])
    here, result = _fixed(*BASE), []
    for k, (name, row) in enumerate(zip(NAMES, (*TORSO, *ARM), strict=True)):
        here = (here @ _fixed(*SHOULDER) if k == len(TORSO) else here) @ craig.row(row, q[name])
        result.append(here)
    return [*result, here @ _fixed(*HAND)]


def marker(drives):
    """Place (3,) in mm of the marker."""
    return 1e3 * (frames(drives)[-1] @ [*np.asarray(MARKER_MM) / 1e3, 1.0])[:3]


def urdf_file(tmp_path):
    """The chain as a URDF. A mimic follows one joint: the chest's joint is two at one place, one for each."""
    joints, links, placement, parent = "", ["base", "hand", "chest_turned"], _fixed(*BASE), "base"
    bodies = ""
    for k, (name, row, (mass, com)) in enumerate(zip(NAMES, (*TORSO, *ARM), MASSES, strict=True)):
        placement = placement @ (_fixed(*SHOULDER) if k == len(TORSO) else np.eye(4)) @ craig.row(row, 0.0)
        more = ""
        if name == "chest":
            more = '<mimic joint="torso1" multiplier="-1" offset="0"/>'
            joints += _urdf_joint("chest_turned", "revolute", parent, "chest_turned", placement, more)
            parent, placement, more = "chest_turned", np.eye(4), '<mimic joint="torso2" multiplier="-1"/>'
        joints += _urdf_joint(name, "revolute", parent, name, placement, more)
        inertial = f'<inertial><origin xyz="{text_of(com)}"/><mass value="{mass}"/>'
        inertial += '<inertia ixx="1e-9" iyy="1e-9" izz="1e-9" ixy="0" ixz="0" iyz="0"/></inertial>'
        bodies += f'<link name="{name}">{inertial}</link>'
        parent, placement = name, np.eye(4)
    joints += _urdf_joint("wrist", "fixed", parent, "hand", _fixed(*HAND), "")
    bodies += "".join(f'<link name="{name}"/>' for name in links)
    return file_of(tmp_path, f'<robot name="humanoid">{bodies}{joints}</robot>', "humanoid.urdf")


def _urdf_joint(name, kind, parent, child, placement, more):
    with warnings.catch_warnings():
        # where two of three angles turn about one axis any split of them does
        warnings.simplefilter("ignore")
        rpy = Rotation.from_matrix(placement[:3, :3]).as_euler("xyz")
    limit = '<axis xyz="0 0 1"/><limit lower="-1.5" upper="1.5" effort="1" velocity="1"/>' if kind == "revolute" else ""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{text_of(placement[:3, 3])}" rpy="{text_of(rpy)}"/>{limit}{more}</joint>'
    )
