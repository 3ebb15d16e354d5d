"""Point-to-point campaigns: where the points lie, in which order, and what the plan of them says."""

import numpy as np
import pytest
from scipy.spatial.distance import pdist

from rrru.campaign.speed_profile import Trapezoid
from rrru.studies.methods.regions import cylinder_points, nearest_first, stops


def test_points_fill_their_cylinder_evenly():
    points = cylinder_points((10.0, -20.0), 50.0, (300.0, 100.0), 256, np.random.default_rng(0))
    radius = np.hypot(points[:, 0] - 10.0, points[:, 1] + 20.0)
    assert (
        points.shape == (256, 3)
        and radius.max() <= 50.0
        and points[:, 2].min() >= 100.0
        and points[:, 2].max() <= 300.0
    )
    # half the area lies within 1 / sqrt(2) of the radius, half the volume in each half of the height and of the turn
    for half in (radius < 50.0 / np.sqrt(2.0), points[:, 2] < 200.0, points[:, 0] < 10.0):
        assert abs(half.mean() - 0.5) < 0.02
    random = np.random.default_rng(0).uniform(-1.0, 1.0, (256, 3))
    # a Sobol sequence leaves no two points as close as chance does
    assert pdist(points / points.std(axis=0)).min() > pdist(random / random.std(axis=0)).min()


def test_a_shorter_campaign_is_the_beginning_of_a_longer_one():
    long = cylinder_points((0.0, 0.0), 50.0, (0.0, 10.0), 100, np.random.default_rng(3))
    np.testing.assert_array_equal(
        long[:64], cylinder_points((0.0, 0.0), 50.0, (0.0, 10.0), 128, np.random.default_rng(3))[:64]
    )


def test_the_order_visits_every_point_once_on_shorter_ways():
    points = np.random.default_rng(1).uniform(0.0, 100.0, (60, 3))
    ordered = nearest_first(points)
    assert sorted(map(tuple, ordered)) == sorted(map(tuple, points)) and tuple(ordered[0]) == tuple(points[0])
    ways = [np.linalg.norm(np.diff(p, axis=0), axis=1).sum() for p in (points, ordered)]
    assert ways[1] < 0.6 * ways[0]


def test_the_plan_stands_still_at_every_point_and_takes_the_ways_and_rests_between():
    points = np.array([[0.0, 0.0, 500.0], [100.0, 0.0, 500.0], [100.0, 50.0, 500.0]])
    plan = stops("stops", points, 80.0, 400.0, 2.0)
    (run,) = plan.runs
    np.testing.assert_array_equal(run.points_mm, points)
    assert not run.velocity_mm_s.any() and not run.acceleration_mm_s2.any()
    ways = [Trapezoid(length, 80.0, 400.0).duration_s for length in (100.0, 50.0)]
    np.testing.assert_allclose(plan.time_s(), [2.0, 4.0 + ways[0], 6.0 + sum(ways)])
    path, index = plan.path()
    np.testing.assert_allclose(path[index], points, atol=1e-12)
    assert np.linalg.norm(np.diff(path, axis=0), axis=1).sum() == pytest.approx(150.0)
