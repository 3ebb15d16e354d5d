"""The twin's search: its fast path against the pipeline, its bounds, its reproducibility."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from rrru.studies.rrru3.paper_a import ERRORS_MM

from rrru.errors import ConfigError, UnreachableError
from rrru.fit.least_squares import least_squares
from rrru.fit.mean_distance import least_mean_distance
from rrru.fit.residuals import Residuals
from rrru.plant.virtual_robot import VirtualRobot
from rrru.robots.rrru3 import Rrru3
from rrru.studies import config as parts
from rrru.studies.rrru3 import twin, twin_search
from tests.places import ROOT

_VALUES = {name: 0.5 * (low + high) for name, (low, high) in twin.SEARCH_BOUNDS.items()} | {
    "dtheta1": 0.002,
    "dL1": 0.4,
    "dr": 1.5,
    "clearance1": 0.4,
    "width2": 0.001,
    "amplitude3": 0.0005,
    "centre_x_mm": -300.0,
    "radius_start_mm": 50.0,
    "radius_end_mm": 150.0,
    "z_start_mm": 600.0,
    "z_end_mm": 720.0,
    "wobble_mm": 0.6,
}


@pytest.fixture(scope="module")
def draws():
    generator = np.random.default_rng(0)
    return tuple(twin_search.draw(generator, 222) for _ in range(2))


@pytest.mark.parametrize("line_calibration", twin_search.LINE_CALIBRATIONS)
def test_the_fast_path_gives_the_spatial_closures_numbers(draws, line_calibration):
    candidate = twin.Twin(_VALUES)
    fast, fast_orders = twin_search.simulate(Rrru3(), candidate, 0.02, draws, line_calibration)
    full, full_orders = twin_search.simulate(Rrru3(), candidate, 0.02, draws, line_calibration, kind=VirtualRobot)
    assert set(fast) == set(ERRORS_MM)
    for item, value in full.items():
        assert fast[item] == pytest.approx(value, abs=0.05), item
    assert fast_orders == pytest.approx(full_orders, abs=0.05)


def test_the_linearised_fit_is_the_pipelines(rich_poses):
    points, theta = rich_poses
    robot = Rrru3()
    truth = np.array([0.004, -0.003, 0.002, 0.8, -0.6, 0.5, 2.0])
    measured = robot.forward(theta, truth, points) + np.random.default_rng(1).normal(0.0, 0.3, points.shape)
    residuals = Residuals(robot, theta, measured, points)
    fit = least_mean_distance(residuals, least_squares(residuals).deviations)
    fast, fast_value = twin_search._linear_fit(robot, theta, measured, points)
    assert fast_value == pytest.approx(fit.mean_mm, abs=1e-4)
    np.testing.assert_allclose(
        fast / residuals.mechanism.parameters.high, fit.deviations / residuals.mechanism.parameters.high, atol=2e-3
    )


def test_misfit_is_zero_for_the_paper_itself_and_grows_with_every_number():
    holds = {"centre_before": 0.1, "group6_after": 0.1}
    assert twin_search.misfit(ERRORS_MM, holds) == 0.0
    for item in ERRORS_MM:
        worse = twin_search.misfit(ERRORS_MM | {item: 1.3 * ERRORS_MM[item]}, holds)
        assert worse > 1.0
    assert twin_search.misfit(ERRORS_MM | {"spiral_under_lines_z_abs_max": 1.0}, holds) == 0.0
    assert twin_search.misfit(ERRORS_MM, holds | {"group6_after": -0.01}) > 1.0


def test_a_spiral_near_a_singularity_is_refused(draws):
    near = twin.Twin(_VALUES | {"centre_x_mm": -560.0, "radius_end_mm": 210.0})
    with pytest.raises(UnreachableError):
        twin_search.simulate(Rrru3(), near, 0.02, draws)


def test_same_seed_same_twin_and_it_stays_in_its_bounds(draws):
    found = [twin_search.search(Rrru3(), 0.02, draws, "group_1", 3, generations=1, population=1) for _ in range(2)]
    assert found[0] == found[1] and np.isfinite(found[0][1])
    for name, (low, high) in twin.SEARCH_BOUNDS.items():
        assert low <= found[0][0].values[name] <= high


def test_the_overlay_is_the_twin():
    overlay = twin.overlay(twin.Twin(_VALUES))
    robot = overlay["virtual_robots"]["twin"]
    assert (
        robot["errors"]["dr"] == 1.5 and robot["effects"]["backlash"]["width2"] == 0.001 and robot["wobble_mm"] == 0.6
    )
    candidate = twin.Twin(_VALUES).robot(Rrru3())
    assert replace(candidate, effects=()).deviations == robot["errors"]
    offsets = overlay["trajectories"]["paper"]["lines"]["offsets_y_mm"]
    assert offsets[0] == 0.0 and np.allclose(np.add(offsets[1::2], offsets[2::2]), 0.0)


def test_the_configured_twin_comes_back_and_a_refinement_is_never_worse(draws):
    root = ROOT
    config = yaml.safe_load((root / "config.yaml").read_text())
    configured = twin.from_config(parts.virtual(config, "paper"))
    assert set(configured.values) == set(twin.SEARCH_BOUNDS)
    overlay = twin.overlay(configured)
    assert overlay["virtual_robots"]["twin"]["errors"] == config["virtual_robots"]["twin"]["errors"]
    assert overlay["trajectories"]["paper"]["spiral"].items() <= config["trajectories"]["paper"]["spiral"].items()
    vector = [configured.values[name] for name in twin.SEARCH_BOUNDS]
    before = twin_search.cost(vector, Rrru3(), 0.02, draws, "group_1")
    _, after = twin_search.search(Rrru3(), 0.02, draws, "group_1", 4, generations=1, population=1, start=configured)
    assert after <= before
    config["virtual_robots"]["twin"]["errors"]["dR"] = 1.0
    with pytest.raises(ConfigError, match="dR"):
        twin.from_config(parts.virtual(config, "paper"))
