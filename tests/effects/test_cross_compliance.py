"""Cross compliance of a trunk: reciprocal, and what a joint on rods looks like where it is described as a drive."""

import numpy as np

from rrru.effects.library import find, library
from rrru.effects.motion import Course, make_motion
from rrru.kinematics.dynamics import Masses
from rrru.robots.catalogue import make_mechanism
from rrru.robots.ptt3 import Ptt3
from tests.formats import humanoid
from tests.robots import two_arms

COUNT = 20
FOLLOWING = make_mechanism("two_arms", two_arms.section())
ARM = np.array(["right", "left"] * COUNT)[:COUNT]
DRIVES = FOLLOWING.legs.home_drives + np.random.default_rng(2).uniform(-0.5, 0.5, (COUNT, len(two_arms.DRIVES)))


def _own_chest():
    """The same robot, its chest with a drive of its own."""
    section = two_arms.section()
    (chest,) = [row for row in section["dh"] if row.get("name") == "chest"]
    del chest["drives"]
    chest["range_deg"] = [-80.0, 80.0]
    return make_mechanism("two_arms", section)


FREE = _own_chest()


def _motion(robot):
    values = dict(zip(two_arms.DRIVES, DRIVES.T, strict=True))
    values["chest"] = -(values["hip"] + values["belly"])
    drives = np.stack([values[column.removesuffix("_rad")] for column in robot.parts.columns], axis=1)
    still, rest, every = np.zeros((COUNT, 3)), np.zeros_like(drives), np.arange(COUNT)
    position = robot.guess(drives, ARM)
    course = Course(position, drives, drives, every, every, still, still, np.zeros(COUNT), (rest, rest))
    return make_motion(robot, Masses(0.0, 0.0, 0.0), course)


def test_only_trunks_that_hands_share_have_the_law():
    assert find("cross_compliance", Ptt3()) is None
    assert find("cross_compliance", make_mechanism("humanoid", humanoid.section())) is None
    names = library(FREE)["cross_compliance"].parameters.names
    assert len(names) == 6 and "cross_belly_chest" in names and not any("right" in name for name in names)


def test_each_joint_deflects_under_the_other_ones_torque():
    """Two joints, each by the load on the other: no more, no less, and with one number."""
    motion, effect = _motion(FREE), library(FREE)["cross_compliance"]
    twists = effect.contribute(motion, effect.parameters.vector({"cross_hip_chest": 2e-8})).twists
    load, order = motion.drive_load, [column.removesuffix("_rad") for column in FREE.parts.columns]
    hip, chest = order.index("hip"), order.index("chest")
    numbers = FREE.legs.site_numbers
    expected = np.zeros_like(twists)
    expected[:, numbers["hip"], 5], expected[:, numbers["chest"], 5] = 2e-8 * load[:, chest], 2e-8 * load[:, hip]
    np.testing.assert_allclose(twists, expected, rtol=0.0, atol=1e-18)
    # Betti: what the other's load does along one's own is the same both ways
    work = twists[:, numbers["hip"], 5] * load[:, hip] - twists[:, numbers["chest"], 5] * load[:, chest]
    np.testing.assert_allclose(work, 0.0, atol=1e-12)


def test_a_chest_on_rods_is_one_of_its_own_with_cross_compliance():
    """C = J K J^T of the springs of two drives and of the chest that follows minus both."""
    hip, belly, chest = 2e-7, 3e-7, 1.5e-7
    rods, free = _motion(FOLLOWING), _motion(FREE)
    springs = library(FOLLOWING)["drive_compliance"]
    order = [column.removesuffix("_rad") for column in FOLLOWING.parts.columns]
    values = {f"compliance{order.index(name) + 1}": one for name, one in (("hip", hip), ("belly", belly))}
    one = springs.contribute(rods, springs.parameters.vector(values | {f"compliance{len(order) + 1}": chest})).twists
    order = [column.removesuffix("_rad") for column in FREE.parts.columns]
    own = {"hip": hip, "belly": belly, "chest": hip + belly + chest}
    effects, between = library(FREE), {"cross_hip_chest": -hip, "cross_belly_chest": -belly}
    values = {f"compliance{order.index(name) + 1}": size for name, size in own.items()}
    other = sum(
        effects[name].contribute(free, effects[name].parameters.vector(numbers)).twists
        for name, numbers in (("drive_compliance", values), ("cross_compliance", between))
    )
    assert np.abs(one).max() > 1e-3
    np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-9)
