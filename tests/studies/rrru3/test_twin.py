"""The twin's search: its fast path against the pipeline, its bounds, its reproducibility."""

import copy
from dataclasses import replace

import numpy as np
import pytest

from rrru.calibration.calibrate import calibrate
from rrru.calibration.mean_distance import least_mean_distance
from rrru.errors import ConfigError, UnreachableError
from rrru.estimation.observations.target_positions import TargetPositions
from rrru.robots.catalogue import make_mechanism
from rrru.robots.rrru3 import Rrru3
from rrru.simulation.virtual_robot import VirtualRobot
from rrru.studies.rrru3 import twin, twin_search
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
SMALL = {"seed": 3, "generations": 1, "population": 1, "share": 0.02}


@pytest.fixture(scope="module")
def task():
    draws = twin_search.draw([[np.random.default_rng([k, part]) for part in range(2)] for k in range(3)], 222)
    return twin_search.Task(Rrru3(), MOTION, CONFIGURED, 0.02, draws)


@pytest.mark.parametrize("line_calibration", twin_search.LINE_CALIBRATIONS)
def test_the_fast_path_gives_the_spatial_closures_numbers(task, line_calibration):
    task = replace(task, line_calibration=line_calibration)
    fast, fast_orders = twin_search.simulate(task, CANDIDATE)
    full, full_orders = twin_search.simulate(task, CANDIDATE, kind=VirtualRobot)
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


def test_misfit_is_zero_for_the_paper_itself_and_grows_with_every_number():
    holds = {"centre_before": 0.1, "group6_after": 0.1}
    assert twin_search.misfit(ERRORS_MM, holds) == 0.0
    for item in ERRORS_MM:
        worse = twin_search.misfit(ERRORS_MM | {item: 1.3 * ERRORS_MM[item]}, holds)
        assert worse > 1.0
    assert twin_search.misfit(ERRORS_MM | {"spiral_under_lines_z_abs_max": 1.0}, holds) == 0.0
    assert twin_search.misfit(ERRORS_MM, holds | {"group6_after": -0.01}) > 1.0


def test_a_spiral_near_a_singularity_is_refused(task):
    near = twin.Twin(CANDIDATE.values | {"centre_x_mm": -560.0, "radius_end_mm": 210.0})
    with pytest.raises(UnreachableError):
        twin_search.simulate(task, near)
    assert twin_search.cost(list(near.values.values()), task) == 1e6


def test_same_seed_same_twin_and_it_stays_in_its_bounds(task):
    (best, misfit), again = (twin_search.search(task, SMALL) for _ in range(2))
    assert (best, misfit) == again and np.isfinite(misfit)
    for name, (low, high) in twin.SEARCH_BOUNDS.items():
        assert low <= best.values[name] <= high


def test_a_refinement_is_never_worse(task):
    before = twin_search.cost(list(CANDIDATE.values.values()), task)
    _, after = twin_search.search(task, SMALL, start=CANDIDATE)
    assert after <= before


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
