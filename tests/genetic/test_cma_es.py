"""The evolution strategy: known minima, bounds, and what every search promises."""

from dataclasses import replace

import numpy as np
import pytest

from rrru.calibration.calibrate import calibrate
from rrru.calibration.mean_distance import least_mean_distance
from rrru.estimation.observations.target_positions import TargetPositions
from rrru.genetic.algorithm import minimise
from rrru.genetic.settings import GeneticSettings
from rrru.robots.rrru3 import Rrru3

LOW, HIGH = np.array([-2.0, 0.0, 5.0, -1.0]), np.array([2.0, 10.0, 6.0, 1.0])
SETTINGS = GeneticSettings(operators="cma_es", populations=(12,), generations=300, stall_generations=0)
TURN = np.linalg.qr(np.random.default_rng(0).standard_normal((4, 4)))[0]
AT = LOW + np.array([0.3, 0.55, 0.4, 0.7]) * (HIGH - LOW)


def valley(values):
    """Askew, a thousand times as long as wide; least, 0.25, at AT."""
    off = ((values - AT) / (HIGH - LOW)) @ TURN
    return 0.25 + (off**2 * [1.0, 1e2, 1e4, 1e6]).sum(axis=1)


def test_the_end_of_a_narrow_valley_is_found():
    result = minimise(valley, LOW, HIGH, SETTINGS, 3)
    np.testing.assert_allclose(result.deviations, AT, atol=1e-6)
    assert result.objective == valley(result.deviations[None])[0]


def test_a_minimum_in_a_corner_is_found_and_nothing_is_asked_beyond_the_bounds():
    asked = []

    def slope(values):
        asked.append(values.copy())
        return values @ [1.0, -1.0, 1.0, 2.0]

    result = minimise(slope, LOW, HIGH, replace(SETTINGS, generations=80), 1)
    np.testing.assert_allclose(result.deviations, [LOW[0], HIGH[1], LOW[2], LOW[3]])
    every = np.concatenate(asked)
    assert (every >= LOW - 1e-12).all() and (every <= HIGH + 1e-12).all()
    assert len(every) == result.evaluations == 12 * (result.generations + 1)


def test_the_best_so_far_is_kept_and_a_seed_gives_its_bytes():
    first, again, other = (minimise(valley, LOW, HIGH, SETTINGS, seed) for seed in (7, 7, 8))
    assert (np.diff(first.best_history) <= 0.0).all()
    np.testing.assert_allclose(valley(first.found), first.best_history, rtol=1e-12)
    assert first.found.tobytes() == again.found.tobytes() != other.found.tobytes()


@pytest.mark.parametrize("flat", [0.5, np.inf])
def test_where_nothing_is_better_a_run_still_ends(flat):
    result = minimise(lambda values: np.full(len(values), flat), LOW, HIGH, replace(SETTINGS, generations=50), 2)
    assert (result.stopped, result.generations, result.objective) == ("generations", 50, flat)


def test_a_run_ends_where_it_stalls_or_has_no_spread_left():
    endless = replace(SETTINGS, generations=5000)
    runs = [minimise(valley, LOW, HIGH, endless, seed) for seed in range(9)]
    assert {run.stopped for run in runs} == {"stalled"}
    # where exactly a run has no spread left, rounding decides
    assert np.median([run.generations for run in runs]) < 1000
    settings = replace(endless, stall_generations=20, stall_tolerance=1e-6)
    stopped = minimise(valley, LOW, HIGH, settings, 4)
    assert stopped.found.tobytes() == runs[4].stalled(20, 1e-6).found.tobytes()


def test_infeasible_individuals_do_not_lead_it_astray():
    def holed(values):
        return np.where(values[:, 0] > 0.5, np.inf, valley(values))

    np.testing.assert_allclose(minimise(holed, LOW, HIGH, SETTINGS, 5).deviations, AT, atol=1e-6)


def test_a_calibration_ends_at_the_least_mean_distance():
    """Where Newton's method, started at least squares, ends as well."""
    line = np.linspace(-600.0, 0.0, 26)
    points = np.concatenate([np.column_stack([line, np.full(26, y), np.full(26, 650.0)]) for y in (0.0, 90.0, -90.0)])
    tied, robot = Rrru3(parameter_set="tied"), Rrru3()
    theta = robot.inverse(points)
    truth = tied.parameters.vector({"dtheta1": 0.0012, "dL1": 0.3, "dL3": -0.2, "dr": 0.9})
    measured = tied.forward(theta, truth, points) + np.random.default_rng(1).normal(0.0, 0.1, points.shape)
    searched, identified = (TargetPositions(one, theta, measured, points) for one in (tied, robot))
    best = least_mean_distance(identified, calibrate(identified).deviations)
    bounds = tied.parameters.low, tied.parameters.high
    settings = GeneticSettings(operators="cma_es", generations=400, stall_generations=0)
    for seed in range(3):
        result = minimise(searched.mean_distance, *bounds, settings, seed)
        assert best.mean_mm - 1e-9 < result.objective < best.mean_mm * (1.0 + 1e-6)
