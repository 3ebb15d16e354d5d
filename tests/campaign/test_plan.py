"""Trajectories, motion profile and plan against integration and geometry."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from rrru.campaign.plan import make_plan, make_run
from rrru.campaign.speed_profile import Trapezoid
from rrru.campaign.trajectories import Line, Spiral, line_groups, sample
from rrru.errors import ConfigError, UnreachableError
from rrru.robots.rrru3 import Rrru3

_SPIRAL = Spiral("spiral", (-300.0, 20.0), (50.0, 200.0), (600.0, 750.0), 3.0, 40, 30.0)


@pytest.mark.parametrize("length", [500.0, 160.0, 100.0, 3.0])
def test_trapezoid_is_the_integral_of_its_acceleration(length):
    profile = Trapezoid(length, 80.0, 40.0)
    time = np.linspace(0.0, profile.duration_s, 200_001)
    speed = cumulative_trapezoid(profile.acceleration(time), time, initial=0.0)
    distance = cumulative_trapezoid(speed, time, initial=0.0)
    np.testing.assert_allclose(profile.speed(time), speed, atol=0.01)
    assert distance[-1] == pytest.approx(length, rel=1e-3) and speed.max() <= 80.0 + 0.01
    np.testing.assert_allclose(
        profile.time(np.linspace(0, length, 50)), np.interp(np.linspace(0, length, 50), distance, time), atol=0.05
    )


def test_paper_profile_by_hand():
    """500 mm at 80 mm/s and 40 mm/s^2: 2 s ramps of 80 mm, 340 mm at speed."""
    profile = Trapezoid(500.0, 80.0, 40.0)
    assert profile.duration_s == pytest.approx(2.0 + 340.0 / 80.0 + 2.0)
    np.testing.assert_allclose(profile.time([0.0, 20.0, 80.0, 250.0, 500.0]), [0.0, 1.0, 2.0, 4.125, 8.25])


def test_a_run_moves_as_its_time_stamps_say():
    """Velocity and acceleration are derivatives of the position by the time stamps, centripetal part included."""
    fine = Spiral("spiral", (-300.0, 20.0), (50.0, 200.0), (600.0, 750.0), 3.0, 4001, 30.0)
    run = make_run(fine, 80.0, 40.0)
    velocity = np.gradient(run.points_mm, run.time_s, axis=0)
    inner = slice(200, -200)
    np.testing.assert_allclose(run.velocity_mm_s[inner], velocity[inner], atol=0.1)
    acceleration = np.gradient(velocity, run.time_s, axis=0)
    steady = (np.linalg.norm(run.velocity_mm_s, axis=1) > 79.99) & (np.arange(4001) > 300) & (np.arange(4001) < 3700)
    np.testing.assert_allclose(run.acceleration_mm_s2[steady], acceleration[steady], atol=0.5)
    assert np.linalg.norm(run.acceleration_mm_s2[steady], axis=1).max() > 20.0


def test_reverse_runs_pass_the_same_points_backwards():
    there, back = make_run(_SPIRAL, 80.0, 40.0), make_run(_SPIRAL, 80.0, 40.0, reverse=True)
    np.testing.assert_array_equal(there.points_mm, back.points_mm[::-1])
    np.testing.assert_allclose(there.time_s, (back.time_s[-1] - back.time_s)[::-1], atol=1e-9)


def test_the_path_holds_the_sampled_points_and_the_transfers():
    plan = make_plan(
        (*line_groups((-600.0, 0.0, 600.0), (-300.0, 0.0, 600.0), (0.0, 40.0), 11), _SPIRAL),
        [
            {"reverse": False, "payload_kg": 0.0},
            {"reverse": True, "payload_kg": 2.0, "trajectories": ["line_2"], "speed_mm_s": 300.0},
        ],
        80.0,
        40.0,
        60.0,
    )
    path, index = plan.path()
    np.testing.assert_allclose(path[index], plan.targets(), atol=1e-6)
    assert np.linalg.norm(np.diff(path, axis=0), axis=1).max() < 30.0
    table = plan.commands(Rrru3())
    assert table["trajectory"].drop_duplicates().tolist() == ["line_1", "line_2", "spiral"]
    assert table.groupby("run").size().tolist() == [11, 11, 40, 11]
    assert (
        (np.diff(table["time_s"]) > 0.0).all()
        and table["payload_kg"].iloc[-1] == 2.0
        and table["speed_mm_s"].iloc[-1] == 300.0
    )
    starts = table.groupby("run")["time_s"].first().to_numpy()
    ends = table.groupby("run")["time_s"].last().to_numpy()
    np.testing.assert_allclose(starts[1:] - ends[:-1], 60.0)


def test_spiral_has_its_stated_shape():
    points = sample(_SPIRAL)
    radius = np.hypot(points[:, 0] + 300.0, points[:, 1] - 20.0)
    np.testing.assert_allclose(radius, np.linspace(50.0, 200.0, 40))
    np.testing.assert_allclose(points[:, 2], np.linspace(600.0, 750.0, 40))
    angle = np.unwrap(np.arctan2(points[:, 1] - 20.0, points[:, 0] + 300.0))
    assert np.degrees(angle[0]) == pytest.approx(30.0) and angle[-1] - angle[0] == pytest.approx(6.0 * np.pi)


def test_impossible_plans_are_refused():
    with pytest.raises(ConfigError, match="trajectory spiral: 1 points; allowed: at least 2"):
        Spiral("spiral", (0.0, 0.0), (50.0, 100.0), (600.0, 700.0), 3.0, 1)
    with pytest.raises(ConfigError, match="start_mm and end_mm are the same point"):
        Line("line_1", (1.0, 2.0, 3.0), (1.0, 2.0, 3.0), 5)
    far = make_plan(
        (Line("line_1", (0.0, 0.0, 600.0), (0.0, 2000.0, 600.0), 5),),
        [{"reverse": False, "payload_kg": 0.0}],
        80.0,
        40.0,
        0.0,
    )
    with pytest.raises(UnreachableError, match="out of reach"):
        far.commands(Rrru3())


def test_a_robot_that_rests_at_every_point_takes_longer_and_has_no_speed_there():
    trajectories = line_groups((-500.0, 0.0, 600.0), (-300.0, 0.0, 600.0), [0.0, 20.0], 5)
    plan = make_plan(
        trajectories, [{"payload_kg": 0.0, "reverse": False}, {"payload_kg": 0.0, "reverse": True}], 80.0, 40.0, 2.0
    )
    rests = plan.resting(3.0)
    moved, waited = plan.time_s(), rests.time_s()
    np.testing.assert_allclose(np.diff(waited), np.diff(moved) + np.where(np.diff(moved) == 2.0, 0.0, 3.0))
    assert not any(run.velocity_mm_s.any() or run.acceleration_mm_s2.any() for run in rests.runs)
    assert rests.resting(3.0) is rests
    np.testing.assert_array_equal(rests.targets(), plan.targets())
