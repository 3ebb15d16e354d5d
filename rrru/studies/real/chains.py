"""Robots of data sets with a file that describes the kinematic chain: elastic torsos with two arms.

A chain's file has DH rows after Craig in m and rad for the trunk and each arm, fixed frames as matrices (4, 4) between
them, masses, and in `torso_q` the joint values as text: "-(q_torso1 + q_torso2)" for one that follows others. A robot
is an entry of `robots:` for `rrru.robots.catalogue.make_mechanism`. Lengths in mm, angles in degrees.
"""

import re

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.errors import ConfigError

END_EFFECTORS = ("right", "left")
# joint ranges for the search of home poses and workspaces; the files state none
_RANGE_DEG = [-180.0, 180.0]


def robot_section(chain):
    """The `robots:` entry of a chain's mapping; the columns of its drives are those of the data set's file."""
    masses = chain["masses"]
    trunk = [_frame(chain["base_to_torso"])]
    for number, (row, mass) in enumerate(zip(chain["torso"], masses["torso"], strict=True)):
        name, drives = _joint(chain, number)
        joint = {"name": name, "drives": drives} if drives else {"name": name, "range_deg": _RANGE_DEG}
        trunk.append(joint | _row(row, mass))
    head = _head_centre(chain)
    trunk.append({"xyz_mm": [0.0, 0.0, 0.0], "mass_kg": masses["head"]["mass_kg"], "com_mm": head.tolist()})
    end_effectors = {}
    for hand in END_EFFECTORS:
        links = zip(chain[hand], masses[hand], strict=True)
        rows = [
            {"name": f"q_{hand}{k}", "range_deg": _RANGE_DEG} | _row(row, mass) for k, (row, mass) in enumerate(links)
        ]
        last = _frame(chain["wrist_to_hand"]) | _mass(masses["hand"])
        end_effectors[hand] = [_frame(chain[f"torso_to_{hand}"]), *rows, last]
    return {"dh": trunk, "hands": end_effectors, "convention": "modified"}


def _frame(matrix):
    """The row of a fixed frame from a placement (4, 4) in m."""
    placement = np.asarray(matrix, dtype=float)
    turn = Rotation.from_matrix(placement[:3, :3]).as_euler("xyz", degrees=True)
    return {"xyz_mm": (1e3 * placement[:3, 3]).tolist(), "rpy_deg": turn.tolist()}


def _mass(link):
    """The keys of a link's mass."""
    return {"mass_kg": link["mass_kg"], "com_mm": (1e3 * np.asarray(link["com_m"], dtype=float)).tolist()}


def _row(row, mass):
    """A DH row's numbers and its link's mass."""
    lengths = {"a_mm": 1e3 * row["a"], "d_mm": 1e3 * row["d"]}
    angles = {"alpha_deg": np.degrees(row["alpha"]).item(), "theta_deg": np.degrees(row["theta0"]).item()}
    return lengths | angles | _mass(mass)


def _joint(chain, number):
    """Name of a joint of the trunk, and the factors by drive of one that follows others.

    Raises ConfigError for a value that is neither a drive nor minus a sum of drives in brackets.
    """
    value = chain["torso_q"][number]
    if value.isidentifier():
        return value, {}
    found = re.fullmatch(r"-\((\w+(?: \+ \w+)*)\)", value)
    if not found:
        raise ConfigError(f"chain: torso_q has {value!r}; allowed: a drive, or -(drive1 + drive2)")
    return f"q_follows{number}", dict.fromkeys(found[1].split(" + "), -1.0)


def _head_centre(chain):
    """Centre of mass (3,) of the head in mm in the trunk's last frame, both head joints at zero."""
    here = np.asarray(chain["torso_to_head"], dtype=float)
    for row in chain["head"]:
        tilt, turn = (Rotation.from_euler(*one).as_matrix() for one in (("x", row["alpha"]), ("z", row["theta0"])))
        placement = np.eye(4)
        placement[:3, :3] = tilt @ turn
        placement[:3, 3] = np.array([row["a"], 0.0, 0.0]) + tilt @ np.array([0.0, 0.0, row["d"]])
        here = here @ placement
    return 1e3 * (here @ [*chain["masses"]["head"]["com_m"], 1.0])[:3]
