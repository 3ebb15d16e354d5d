"""Effects in lengths and joints, seen through the virtual robot's full loop closure."""

import numpy as np

from rrru.kinematics import singularity
from rrru.robots.rrru3 import Rrru3
from tests.effects.robots import FORWARD, LINE, LOADED, ROBOT, SPIRAL, drive, per_leg, plan_of


def _along_legs(motion, change):
    """How far (n, 3) the platform moves along the legs' forearms, where it does not turn."""
    along = singularity.leg_forces(ROBOT, motion.position_mm, ROBOT.inverse(motion.position_mm))
    return np.einsum("nla,na->nl", along, change)


def test_link_flexure_shortens_the_forearms_by_their_force():
    flexure = np.array([2e-4, 4e-4, 1e-4])
    plan = plan_of(FORWARD, LOADED)
    motion, position, turned = drive({"link_flexure": per_leg("flexure", flexure)}, plan)
    np.testing.assert_allclose(
        _along_legs(motion, position - plan.targets()), -flexure * motion.force_n, rtol=1e-3, atol=1e-5
    )
    assert turned.max() < 1e-12


def test_link_flexure_lets_the_platform_sink_in_proportion_to_the_payload():
    plan = plan_of(FORWARD, LOADED, LOADED | {"payload_kg": 10.0})
    _, position, _ = drive({"link_flexure": per_leg("flexure", 2e-4)}, plan)
    empty, five, ten = np.split(position - plan.targets(), 3)
    assert (empty[:, 2] > 0.0).all()
    np.testing.assert_allclose(five, empty * 9.8 / 4.8, rtol=0.01, atol=1e-5)
    np.testing.assert_allclose(ten - empty, 2.0 * (five - empty), rtol=0.01, atol=1e-5)


def test_clearance_jumps_where_the_force_changes_its_sign():
    clearance = np.array([0.02, 0.05, 0.01])
    plan = plan_of(FORWARD, LOADED, trajectories=(LINE, SPIRAL))
    motion, position, _ = drive({"joint_clearance": per_leg("clearance", clearance)}, plan)
    along = _along_legs(motion, position - plan.targets())
    for leg in range(3):
        push = motion.force_n[:, leg] > 0.0
        assert push.any() and not push.all()
        np.testing.assert_allclose(along[push, leg], -clearance[leg], atol=1e-4)
        np.testing.assert_allclose(along[~push, leg], clearance[leg], atol=1e-4)


def test_leg_asymmetry_is_the_papers_robot_with_fourteen_errors():
    generator = np.random.default_rng(4)
    values = generator.uniform(-2.0, 2.0, (3, 3))
    section = {f"dL{link}_leg{leg}": values[leg - 1, link - 1] for leg in (1, 2, 3) for link in (1, 2, 3)}
    plan = plan_of(FORWARD, trajectories=(LINE, SPIRAL))
    motion, position, turned = drive({"leg_asymmetry": section}, plan)
    paper = Rrru3(parameter_set="published")
    named = {f"dL{leg}{link}": values[leg - 1, link - 1] for leg in (1, 2, 3) for link in (1, 2, 3)}
    assert set(named) < set(Rrru3.PARAMETER_NAMES["published"])
    exact = paper.forward(motion.drive, paper.parameters.vector(named), plan.targets())
    np.testing.assert_allclose(position, exact, atol=1e-8)
    assert turned.max() < 1e-12


def test_a_warm_robot_is_the_cold_one_enlarged():
    """All angles stay, so that the position grows by the strain itself, e (1 - exp(-t / tau)), and later passes end
    further out.
    """
    plan = plan_of(FORWARD, FORWARD, FORWARD)
    motion, position, _ = drive({"thermal_growth": {"strain": 2e-3, "time_constant": 100.0}}, plan)
    np.testing.assert_allclose(motion.time_s, plan.commands(ROBOT)["time_s"].to_numpy())
    strain = 2e-3 * (1.0 - np.exp(-motion.time_s / 100.0))
    np.testing.assert_allclose(position, plan.targets() * (1.0 + strain[:, None]), atol=1e-8)
    first, second, third = np.split(np.linalg.norm(position, axis=1), 3)
    assert (second > first).all() and (third > second).all()
    # at the start it is cold
    np.testing.assert_allclose(position[0], plan.targets()[0], atol=1e-9)


def test_links_that_grow_are_those_of_a_robot_with_longer_links():
    """Of each leg the arm by one strain, offset and forearm by another, against the closed form of unequal legs."""
    arms, rods = np.array([[2e-3, 0.0, 1e-3], [0.0, 3e-3, 5e-4]])
    section = per_leg("arm_strain", arms) | per_leg("rod_strain", rods) | {"time_constant": 1.0}
    plan = plan_of(FORWARD, trajectories=(LINE, SPIRAL))
    motion, position, turned = drive({"link_growth": section}, plan)
    warm = motion.time_s > 40.0
    assert warm.any() and turned.max() < 1e-12
    paper, lengths = Rrru3(parameter_set="published"), (ROBOT.L1_mm, ROBOT.L2_mm, ROBOT.L3_mm)
    longer = np.transpose([arms, rods, rods]) * lengths
    named = {f"dL{leg}{link}": longer[leg - 1, link - 1] for leg in (1, 2, 3) for link in (1, 2, 3)}
    exact = paper.forward(motion.drive[warm], paper.parameters.vector(named), plan.targets()[warm])
    np.testing.assert_allclose(position[warm], exact, atol=1e-8)
