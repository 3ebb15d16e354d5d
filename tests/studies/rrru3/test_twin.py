"""Candidates of the twin's search: their fast path against the pipeline, what a hypothesis changes."""

import copy
from dataclasses import replace

import numpy as np
import pytest

from rrru.calibration.calibrate import calibrate
from rrru.calibration.mean_distance import least_mean_distance
from rrru.effects import backlash
from rrru.errors import ConfigError, UnreachableError
from rrru.estimation.observations.target_positions import TargetPositions
from rrru.robots.catalogue import make_mechanism
from rrru.robots.rrru3 import Rrru3
from rrru.studies.rrru3 import twin, twin_search
from rrru.studies.rrru3 import twin_kernels as kernels
from rrru.studies.rrru3.linear_fit import linear_fit
from rrru.studies.rrru3.paper import ERRORS_MM

CANDIDATE = twin.Twin(
    {name: 0.5 * (low + high) for name, (low, high) in twin.SEARCH_BOUNDS.items()}
    | {"dtheta1": 0.002, "dL1": 0.4, "dr": 1.5, "clearance1": 0.4, "width2": 0.001, "amplitude3": 0.0005, "ratio": 6.0}
    | {"side": 1.0, "centre_x_mm": -300.0, "radius_start_mm": 50.0, "radius_end_mm": 150.0}
    | {"z_start_mm": 600.0, "z_end_mm": 720.0, "wobble_mm": 0.6}
)
MOTION = {"speed_mm_s": 80.0, "acceleration_mm_s2": 40.0, "dwell_s": 60.0}
CONFIGURED = {
    "lines": {"start_mm": [-800.0, 0.0, 600.0], "end_mm": [-300.0, 0.0, 600.0], "points": 26},
    "spiral": {"points": 40},
}


def draws(first, count=3):
    """Draws by the numbers of their streams."""
    numbers = range(first, first + count)
    return twin_search.draw([[np.random.default_rng([k, part]) for part in range(2)] for k in numbers], 222)


@pytest.mark.parametrize("line_calibration", twin_search.LINE_CALIBRATIONS)
def test_the_fast_path_gives_the_spatial_closures_numbers(task, line_calibration):
    task = replace(task, line_calibration=line_calibration)
    fast, fast_orders = twin_search.simulate(task, CANDIDATE)
    full, full_orders = twin_search.simulate(task, CANDIDATE, kind=twin_search.Spatial)
    assert set(fast) == set(ERRORS_MM)
    for some, others in ((fast, full), (fast_orders, full_orders)):
        assert all(one == pytest.approx(others[item], abs=0.05) for item, one in some.items())


def test_many_draws_at_once_are_each_draws_own(task):
    # each to first order from the draws' mean: with a small non-repeatability this equals a draw alone
    steady = twin.Twin(CANDIDATE.values | {"wobble_mm": 0.05})
    together, orders = twin_search.simulate(task, steady)
    for k in range(3):
        alone, own = twin_search.simulate(replace(task, draws=tuple(part[k : k + 1] for part in task.draws)), steady)
        assert all(values[k] == pytest.approx(alone[item][0], abs=0.03) for item, values in together.items())
        assert all(values[k] == pytest.approx(own[item][0], abs=0.06) for item, values in orders.items())


def test_the_compiled_campaign_is_the_plans(task):
    fast, full = (kind(task, CANDIDATE) for kind in (twin_search.Translational, twin_search.Spatial))
    np.testing.assert_allclose(fast.target, full.target, atol=1e-9)
    np.testing.assert_allclose(fast.theta, full.theta, atol=1e-12)
    np.testing.assert_allclose(fast.singularity, full.singularity, atol=1e-7)
    acceleration = full.robot.course(full.plan, task.mechanism.inverse).acceleration_mm_s2
    np.testing.assert_allclose(task.course(CANDIDATE)[1], acceleration, atol=0.1)
    # commands that a calibration corrects, too
    deviations = np.array([0.004, -0.003, 0.002, 0.8, -0.2, 0.4, -0.6])
    for corrected in (None, deviations):
        (attained, drive), (other, same) = (one.attained(corrected) for one in (fast, full))
        np.testing.assert_allclose(drive, same, atol=1e-12)
        # clearance to first order; at the lines' start the robot is near a singularity
        assert np.linalg.norm(attained - other, axis=1).max() < 0.05


def test_the_compiled_backlash_is_that_of_a_fine_path():
    # drives that turn back between two points, and a corner
    def along(count):
        time = np.linspace(0.0, 1.0, count)
        wave = np.stack([np.sin(7.0 * time), np.cos(5.0 * time), time], axis=1)
        return np.concatenate([wave, wave[-1] + np.linspace(0.0, 1.0, count)[1:, None] * [0.5, -0.3, -0.4]])

    coarse, width = along(81), np.array([0.1, 0.3, 0.2])
    smooth = np.ones(len(coarse), dtype=bool)
    smooth[[0, 80, -1]] = False
    fine = backlash.play(along(8001), 0.5 * width)[::100]
    np.testing.assert_allclose(kernels.backlash(coarse, smooth, width), fine, atol=1e-5)
    assert abs(backlash.play(coarse, 0.5 * width) - fine).max() > 1e-4


def test_the_compiled_jacobian_is_the_mechanisms(rich_poses):
    points, theta = rich_poses
    robot = Rrru3()
    deviations = np.array([0.004, -0.003, 0.002, 0.8, -0.2, 0.4, -0.6])
    legs = robot.numbers(deviations)
    compiled = kernels.parameter_jacobian(points, theta, legs, robot.azimuth_cos_sin, robot.leg_map)
    np.testing.assert_allclose(compiled, robot.parameter_jacobian(points, theta, deviations), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(
        kernels.inverse(points, legs, robot.azimuth_cos_sin), robot.inverse(points, deviations), atol=1e-12
    )


def test_errors_of_the_model_are_the_residuals_of_its_fit(task):
    # fitted to the spiral, its largest residual cannot be far above the mean distance that was made least
    alone = replace(task, draws=tuple(part[:, :1].repeat(2, axis=1) for part in task.draws))
    found, _ = twin_search.simulate(replace(alone, of_model=True), CANDIDATE)
    robot, plan = CANDIDATE.robot(task.mechanism), alone.plan(CANDIDATE)
    target, rows = plan.targets(), slice(-40, None)
    theta = task.mechanism.inverse(target)
    for k in range(3):
        noise = robot.non_repeatability_mm * alone.draws[0][k, 0] + alone.noise_mm * alone.draws[1][k, 0]
        measured = robot.positions(robot.motion(plan, task.mechanism.inverse), target)[0] + noise
        residuals = TargetPositions(task.mechanism, theta[rows], measured[rows], target[rows])
        fit = least_mean_distance(residuals, calibrate(residuals).deviations)
        left = measured[rows] - task.mechanism.forward(theta[rows], fit.deviations, target[rows])
        assert found["spiral_under_spiral_max"][k] == pytest.approx(np.linalg.norm(left, axis=1).max(), abs=0.03)


def test_a_registered_frame_removes_a_rigid_displacement(task):
    rng = np.random.default_rng(2)
    target = rng.uniform(-300.0, 300.0, (30, 3))
    turn, shift = np.array([0.001, -0.002, 0.0005]), np.array([2.0, -1.0, 0.5])
    rigid = shift + np.cross(turn, target - target.mean(axis=0))
    np.testing.assert_allclose(twin_search._rigid_part(target, rigid[None])[0], rigid, atol=1e-12)
    other = rng.normal(size=(1, 30, 3))
    left = other - twin_search._rigid_part(target, other)
    np.testing.assert_allclose(twin_search._rigid_part(target, left), 0.0, atol=1e-12)


def test_spikes_are_errors_of_single_commands_that_the_next_drive_does_not_have(task):
    still = twin.Twin(CANDIDATE.values | {"wobble_mm": 0.0})
    spiked = twin.Twin(still.values | {"spike1": 0.0, "spike2": 0.01, "spike3": 0.0})
    own = replace(task, noise_mm=0.0, more=("spikes",), spikes=True)
    (before, orders), (after, with_spike) = (twin_search.simulate(own, one) for one in (still, spiked))
    # the first drive's arm of 400 mm moves by some millimetres
    assert (abs(after["group1_before_max"] - before["group1_before_max"]) > 0.5).all()
    assert after["spiral_under_spiral_max"] == pytest.approx(before["spiral_under_spiral_max"])
    assert set(orders) == set(with_spike) >= {"spikes_before", "spikes_after"}


@pytest.mark.parametrize("effect", ["leg_asymmetry", "drive_compliance", "base_placement"])
def test_additional_effects_are_searched_and_configured(task, effect):
    own = replace(task, more=(effect,))
    more = {name: 0.3 * high for name, (_, high) in own.bounds.items() if name not in twin.SEARCH_BOUNDS}
    moved = twin.Twin(CANDIDATE.values | more)
    plain, _ = twin_search.simulate(task, CANDIDATE)
    found, _ = twin_search.simulate(own, moved)
    assert abs(found["group1_before_max"] - plain["group1_before_max"]).max() > 0.05
    robot = twin.overlay(moved)["virtual_robots"]["twin"]
    assert set(robot["effects"][effect]) == set(more)
    trajectories = twin.overlay(moved)["trajectories"]["paper"]
    virtual = {"name": "paper", "robot": robot, "trajectories": trajectories}
    assert twin.from_config(virtual).values == pytest.approx(moved.values, rel=1e-5)
    assert set(twin.numbers(virtual)["name"]) == set(moved.values)


def test_a_ratio_at_its_lower_bound_is_one_period_a_turn():
    lowest = twin.Twin(CANDIDATE.values | {"ratio": 0.5})
    assert lowest.robot_section()["effects"]["transmission_error"]["ratio"] == 1.0


def test_a_settled_twin_is_the_same_robot_on_the_same_path(task):
    loose = twin.Twin(CANDIDATE.values | {"ratio": 6.3, "side": -0.2})
    whole = twin.settled(loose)
    assert whole.values["ratio"] == 6.0 and whole.values["side"] == -1.0
    assert whole.robot_section() == loose.robot_section()
    assert whole.trajectory_section() == loose.trajectory_section()


def test_what_is_searched_is_not_stated(task):
    section = {shape: CONFIGURED[shape] | CANDIDATE.trajectory_section()[shape] for shape in CONFIGURED}
    assert twin.stated(section) == CONFIGURED


def test_another_line_calibration_is_refused(task):
    with pytest.raises(ConfigError, match="'spiral'; allowed: group_1, lines"):
        replace(task, line_calibration="spiral")


def test_the_linearised_fit_is_the_pipelines(rich_poses):
    points, theta = rich_poses
    robot = Rrru3()
    truth = np.array([0.004, -0.003, 0.002, 0.8, -0.6, 0.5, 2.0])
    measured = robot.forward(theta, truth, points) + np.random.default_rng(1).normal(0.0, 0.3, points.shape)
    residuals = TargetPositions(robot, theta, measured, points)
    fit = least_mean_distance(residuals, calibrate(residuals).deviations)
    fast, fast_value = linear_fit(robot, theta, measured[None], points)
    assert fast_value[0] == pytest.approx(fit.mean_mm, abs=1e-4)
    high = robot.parameters.high
    np.testing.assert_allclose(fast[0] / high, fit.deviations / high, atol=2e-3)


def test_the_linearised_fit_keeps_the_bounds_as_the_pipelines_does(rich_poses):
    points, theta = rich_poses
    robot = make_mechanism("rrru3", {}, parameter_set="identifiable", length_limit_mm=0.5)
    truth = np.array([0.004, -0.003, 0.002, 0.8, -0.2, 0.4, -0.6])
    measured = robot.forward(theta, truth, points) + np.random.default_rng(1).normal(0.0, 0.3, points.shape)
    residuals = TargetPositions(robot, theta, measured, points)
    fit = least_mean_distance(residuals, calibrate(residuals).deviations)
    fast, fast_value = linear_fit(robot, theta, np.stack([measured, measured + 0.1]), points)
    assert fit.deviations[3] == pytest.approx(0.5) and fast[0, 3] == pytest.approx(0.5, abs=0.02)
    assert fast_value[0] == pytest.approx(fit.mean_mm, abs=5e-3)
    np.testing.assert_allclose(fast[0] / robot.parameters.high, fit.deviations / robot.parameters.high, atol=4e-2)


def test_the_linearised_fit_of_one_line_is_the_pipelines(task):
    """On one line some combinations are hardly determined: parameters end at their bounds, far from least squares."""
    plan = task.plan(CANDIDATE)
    points, robot = plan.targets()[:26], make_mechanism("rrru3", {}, parameter_set="identifiable", length_limit_mm=3.0)
    theta, generator = robot.require_reachable(points), np.random.default_rng(4)
    truth = np.array([0.0098, -0.0054, -0.0043, 1.1, 0.6, 1.5, -0.8])
    # smooth errors that the model lacks, and random ones
    lacking = np.sin(np.linspace(0.0, 5.0, 26))[:, None] * [0.9, 0.0, -0.7]
    attained = robot.forward(theta, truth, points) + lacking
    measured = attained + generator.normal(0.0, 0.2, (6, 26, 3))
    fast, fast_value = linear_fit(robot, theta, measured, points)
    for draw, value, deviations in zip(measured, fast_value, fast, strict=True):
        residuals = TargetPositions(robot, theta, draw, points)
        fit = least_mean_distance(residuals, calibrate(residuals).deviations)
        assert np.isclose(np.abs(fit.deviations[3:6]), 3.0).any()
        assert value == pytest.approx(fit.mean_mm, abs=5e-3)
        assert residuals.mean_distance(deviations[None])[0] == pytest.approx(fit.mean_mm, abs=5e-3)


def test_a_spiral_near_a_singularity_is_refused(task):
    near = twin.Twin(CANDIDATE.values | {"centre_x_mm": -560.0, "radius_end_mm": 210.0})
    with pytest.raises(UnreachableError):
        twin_search.simulate(task, near)
    assert twin_search.cost(list(near.values.values()), task) == 1e6


@pytest.mark.parametrize("kind", [twin_search.Spatial, twin_search.Translational])
def test_a_spiral_out_of_reach_is_refused(task, kind):
    far = twin.Twin(CANDIDATE.values | {"centre_x_mm": -700.0, "radius_end_mm": 420.0, "turns": 2.5})
    assert np.isnan(task.mechanism.inverse(task.plan(far).targets())).any()
    with pytest.raises(UnreachableError):
        twin_search.simulate(task, far, kind)
    residuals = twin_search.residuals(list(far.values.values()), task, 0.0)
    assert np.isnan(residuals).all()
    assert len(residuals) == len(twin_search.residuals(list(CANDIDATE.values.values()), task, 0.0))


def test_the_overlay_is_the_twin_and_the_configured_twin_comes_back():
    overlay = twin.overlay(CANDIDATE)
    robot, own = overlay["virtual_robots"]["twin"], overlay["trajectories"]["paper"]
    assert robot["errors"]["dr"] == 1.5 and robot["effects"]["backlash"]["width2"] == 0.001
    assert robot["wobble_mm"] == 0.6
    driven = CANDIDATE.robot(Rrru3())
    assert driven.deviations == robot["errors"] and driven.non_repeatability_mm == 0.6 and len(driven.effects) == 3
    offsets = own["lines"]["offsets_y_mm"]
    assert offsets[0] == 0.0 and np.allclose(np.add(offsets[1::2], offsets[2::2]), 0.0)
    trajectories = {shape: CONFIGURED[shape] | own[shape] for shape in own}
    virtual = copy.deepcopy({"name": "paper", "robot": robot, "trajectories": trajectories})
    assert twin.from_config(virtual).values == pytest.approx(CANDIDATE.values, rel=1e-5)
    virtual["robot"]["errors"]["dR"] = 1.0
    with pytest.raises(ConfigError, match="dR"):
        twin.from_config(virtual)
