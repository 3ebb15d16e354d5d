"""The virtual robot as a whole: statics by virtual work, what is reported, reproducibility."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from rrru.campaign import measurements as rows
from rrru.campaign.plan import make_plan
from rrru.campaign.trajectories import Line, Spiral
from rrru.effects.library import active_effects
from rrru.effects.protocol import Contribution
from rrru.errors import ConfigError
from rrru.kinematics import singularity
from rrru.kinematics.dynamics import GRAVITY_MM_S2
from rrru.robots.rrru3 import Rrru3
from rrru.simulation import virtual_robot
from rrru.simulation.virtual_robot import VirtualRobot
from tests.reference import rrru3_slow
from tests.reference.spatial_chain import LENGTHS, PLACES

_ONCE = ({"reverse": False, "payload_kg": 0.0},)


def _plan(x=(-800.0, -300.0), passes=_ONCE):
    lines = (
        Line("line_1", (x[0], 0.0, 600.0), (x[1], 0.0, 600.0), 26),
        Spiral("spiral", (-300.0, 0.0), (50.0, 150.0), (600.0, 700.0), 2.0, 40),
    )
    return make_plan(lines, passes, 80.0, 40.0, 60.0)


def _section(**changes):
    return {
        "errors": {},
        "axis_errors": {"position_mm": 0.0, "angle_rad": 0.0, "seed": 0},
        "effects": {},
        "wobble_mm": 0.0,
        "platform_mass_kg": 3.0,
        "forearm_mass_kg": 1.2,
        "arm_mass_kg": 2.0,
        "rotation_limit_rad": 0.05,
    } | changes


def test_a_perfect_robot_goes_where_it_is_told():
    measurements, truth = VirtualRobot().run(_plan(), 0.0, np.random.default_rng(0))
    error = (
        measurements[[f"measured_{a}_mm" for a in "xyz"]].to_numpy()
        - measurements[[f"command_{a}_mm" for a in "xyz"]].to_numpy()
    )
    assert np.abs(error).max() < 1e-8
    assert truth["platform_rotation_rad"].max() < 1e-12


def test_leg_forces_do_the_work_of_the_load():
    """Virtual work with the drives' Jacobian: tau = -J^T W equals the leg forces' moments, f_i dF_i/dtheta_i / |grad
    F_i|.
    """
    robot, plan = VirtualRobot(), _plan()
    target = plan.targets()
    motion = robot.motion(plan, robot.mechanism.inverse)
    mass = robot.masses.platform_kg + 1.5 * robot.masses.forearm_kg
    acceleration = np.concatenate([run.acceleration_mm_s2 for run in plan.runs])
    load = mass * (np.array([0.0, 0.0, GRAVITY_MM_S2]) - acceleration) / 1000.0
    drive = robot.mechanism.actuator_jacobian(target, motion.drive)
    torque = -np.einsum("nak,na->nk", drive, load)
    gradient, by_leg = robot.mechanism.closure_jacobians(target, motion.drive)
    moment = -motion.force_n * by_leg[..., 0] / np.linalg.norm(gradient, axis=-1)
    np.testing.assert_allclose(torque, moment, rtol=1e-9, atol=1e-9 * np.abs(moment).max())
    along = singularity.leg_forces(robot.mechanism, target, motion.drive)
    np.testing.assert_allclose(np.einsum("nl,nla->na", motion.force_n, along), -load, atol=1e-9)


def _constraint(measurements):
    return singularity.constraint_measure(Rrru3(), rows.command(measurements), rows.actuators(measurements, Rrru3()))


def test_commands_near_the_constraint_singularity_are_reported():
    measurements, _ = VirtualRobot().run(_plan(), 0.0, np.random.default_rng(0))
    measure = _constraint(measurements)
    marked = rows.mark_near_singularity(measurements, measure, 0.1)
    assert (measure < 0.1).any() and (marked["status"] == np.where(measure < 0.1, "near_singularity", "ok")).all()
    spoilt = rows.mark_near_singularity(measurements.assign(status="outlier"), measure, 0.1)
    assert (spoilt["status"] == "outlier").all()


def test_crooked_axes_near_the_singularity_are_unsolved_not_guessed():
    crooked = virtual_robot.from_config(
        Rrru3(), _section(axis_errors={"position_mm": 0.2, "angle_rad": 5e-4, "seed": 3})
    )
    measurements, truth = crooked.run(_plan(), 0.02, np.random.default_rng(0))
    lost = measurements["status"] == "unsolved"
    assert lost.any()
    assert measurements.loc[lost, "measured_x_mm"].isna().all() and _constraint(measurements)[lost].max() < 0.1
    assert truth.loc[~lost, "platform_rotation_rad"].max() <= 0.05
    # away from it the platform turns a little, and nothing is lost
    clear, _ = crooked.run(_plan(x=(-600.0, -100.0)), 0.02, np.random.default_rng(0))
    assert (clear["status"] == "ok").all()


def test_same_seed_same_bytes_and_a_lost_point_changes_no_other():
    plan = _plan()
    runs = [VirtualRobot(non_repeatability_mm=0.3).run(plan, 0.02, np.random.default_rng(7))[0] for _ in range(2)]
    assert runs[0].equals(runs[1])
    strict = VirtualRobot(non_repeatability_mm=0.3, rotation_limit_rad=1e-18).run(plan, 0.02, np.random.default_rng(7))[
        0
    ]
    solved = strict["measured_x_mm"].notna()
    assert 0 < solved.sum() < len(solved) or solved.sum() == 0
    assert strict.loc[solved, "measured_x_mm"].equals(runs[0].loc[solved, "measured_x_mm"])


def test_noise_and_wobble_have_the_stated_size():
    plan = make_plan((Line("line_1", (-600.0, 0.0, 600.0), (-300.0, 0.0, 600.0), 5000),), _ONCE, 80.0, 40.0, 0.0)
    measurements, truth = VirtualRobot(non_repeatability_mm=0.6).run(plan, 0.02, np.random.default_rng(0))
    command = measurements[[f"command_{a}_mm" for a in "xyz"]].to_numpy()
    true = truth[[f"true_{a}_mm" for a in "xyz"]].to_numpy()
    measured = measurements[[f"measured_{a}_mm" for a in "xyz"]].to_numpy()
    distance = np.linalg.norm(true - command, axis=1)
    # uniform in a ball: the cube of the distance is uniform, the mean distance 3/4 of the radius
    assert 0.59 < distance.max() <= 0.6 and distance.mean() == pytest.approx(0.45, rel=0.02)
    assert (true - command).std(axis=0) == pytest.approx([0.6 / np.sqrt(5.0)] * 3, rel=0.05)
    assert (measured - true).std(axis=0) == pytest.approx([0.02] * 3, rel=0.05)


def test_payload_reaches_the_effects():
    plan = _plan(passes=({"reverse": False, "payload_kg": 0.0}, {"reverse": False, "payload_kg": 5.0}))
    force = VirtualRobot().motion(plan, Rrru3().inverse).force_n
    empty, loaded = np.split(force, 2)
    np.testing.assert_allclose(loaded, empty * (3.0 + 1.8 + 5.0) / (3.0 + 1.8), rtol=1e-9)


_LOOSE = {"joint_clearance": {f"clearance{k}": 0.5 for k in (1, 2, 3)}}


def test_clearance_moves_the_platform_down_under_its_weight():
    """The bores lag behind the pins, so that gravity is followed: the platform's shift does positive work on the
    load.
    """
    plan = _plan()
    loose = VirtualRobot(effects=active_effects(_LOOSE, Rrru3()))
    measurements, _ = loose.run(plan, 0.0, np.random.default_rng(0))
    assert (measurements["measured_z_mm"] - measurements["command_z_mm"] > 0.0).all()


@dataclass(frozen=True)
class _Everything:
    """A contribution at every site at once."""

    contribution: Contribution
    effect = SimpleNamespace(needs=())

    def contribute(self, motion):
        return self.contribution


def test_a_contribution_at_every_site_reaches_the_loop_closure():
    """Twists of all joints, of the world and of the tool at once, against a general solver on 18 equations."""
    plan, generator = _plan(x=(-600.0, -300.0)), np.random.default_rng(11)
    target = plan.targets()
    n = len(target)
    twists = generator.normal(size=(n, 26, 6)) * np.repeat([0.3, 0.001], 3)
    twists[:, 0] = [3.0, -1.0, 2.0, 0.01, -0.02, 0.015]
    twists[:, 25, 3:] = 0.0
    deviations, change = {"dtheta2": 0.002, "dL13": 0.7, "dr": -0.5, "dR": 0.3}, Contribution(twists)
    robot = VirtualRobot(deviations=deviations, effects=(_Everything(change),))
    position, _ = robot.positions(robot.motion(plan, robot.mechanism.inverse), target)
    theta = robot.mechanism.inverse(target)
    passive = robot.mechanism.passive_angles(target, theta)
    lengths = LENGTHS + np.array([0.3, 0.0, 0.0, 0.0, -0.5])
    lengths[0, 3] += 0.7
    for k in range(0, n, 9):
        guess = np.concatenate([passive[k].ravel(), np.zeros(3), target[k]])
        own = twists[k, 1:25].reshape(3, 8, 6).copy()
        # rotation vectors at one site add up; theta counts about minus y
        own[1, PLACES.index("drive"), 4] -= 0.002
        pose = rrru3_slow.close(theta[k], lengths, own, guess)
        seen = rrru3_slow.transform(twists[k, 0, 3:], twists[k, 0, :3]) @ pose
        seen = seen @ rrru3_slow.transform(shift=twists[k, 25, :3])
        np.testing.assert_allclose(position[k], seen[:3, 3], atol=1e-7)


def test_a_heavier_arm_loads_its_drive_only():
    plan = _plan()
    light, heavy = (
        virtual_robot.from_config(Rrru3(), _section(arm_mass_kg=mass)).motion(plan, Rrru3().inverse)
        for mass in (2.0, 5.0)
    )
    np.testing.assert_array_equal(light.force_n, heavy.force_n)
    more = 3.0 * (GRAVITY_MM_S2 * 200.0 * np.cos(light.drive) - light.drive_acceleration * 400.0**2 / 3.0) / 1000.0
    np.testing.assert_allclose(heavy.drive_load - light.drive_load, more, rtol=1e-9)


def test_unknown_names_in_the_configuration_are_named():
    with pytest.raises(ConfigError, match="unknown error 'dL4'"):
        virtual_robot.from_config(Rrru3(), _section(errors={"dL4": 1.0}))
    with pytest.raises(ConfigError, match="unknown effect 'slack'"):
        virtual_robot.from_config(Rrru3(), _section(effects={"slack": {}}))
    with pytest.raises(ConfigError, match="unknown parameter 'width'"):
        virtual_robot.from_config(Rrru3(), _section(effects={"backlash": {"width": 0.1}}))
    with pytest.raises(ConfigError, match=r"width1 is 1\.0 rad; allowed: 0\.0 to 0\.02"):
        virtual_robot.from_config(Rrru3(), _section(effects={"backlash": {"width1": 1.0}}))
