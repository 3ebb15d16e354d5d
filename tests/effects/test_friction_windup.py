"""Wind-up against friction: the model against slow integrations, its limit, and how it is separated from backlash."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.settings import GapSettings
from rrru.effects.backlash import play
from rrru.effects.friction_windup import wound
from rrru.effects.library import find
from rrru.effects.protocol import ActiveEffect
from rrru.robots.ptt3 import Ptt3
from tests.diagnosis import arms
from tests.diagnosis.campaigns import MASSES, NOISE_MM, ROBOT, measure

EFFECT = find("friction_windup", ROBOT)
_LIBRARY = ("backlash", "friction_windup", "drive_compliance", "encoder_eccentricity", "servo_lag", "axis_tilt")
_PATHS = st.lists(st.floats(-3.0, 3.0), min_size=2, max_size=12)


def _dense(path, steps):
    """A path (k,) with so many steps in each piece of it."""
    at = np.arange(steps * (len(path) - 1) + 1) / steps
    return np.interp(at, np.arange(len(path)), path)


def _share(path, travel):
    return wound(np.ascontiguousarray(np.array(path)[:, None]), np.array([travel]))[:, 0]


@settings(max_examples=25, deadline=None)
@given(path=_PATHS, travel=st.floats(0.2, 2.0))
def test_it_is_dahls_equation_stepped_through_along_a_dense_path(path, travel):
    steps, share, expected = 1000, 0.0, [0.0]
    for number, step in enumerate(np.diff(_dense(path, steps)), start=1):
        # midpoint rule
        middle = share + 0.5 * (abs(step) / travel) * (np.sign(step) - share)
        share += abs(step) / travel * (np.sign(step) - middle)
        if number % steps == 0:
            expected.append(share)
    np.testing.assert_allclose(_share(path, travel), expected, atol=1e-4)


@settings(max_examples=50)
@given(path=_PATHS, travel=st.floats(0.05, 5.0))
def test_it_stays_within_its_size_and_forgets_the_sampling(path, travel):
    share = _share(path, travel)
    assert np.abs(share).max() <= 1.0
    np.testing.assert_allclose(_share(_dense(path, 7), travel)[::7], share, atol=1e-12)


def test_from_rest_it_is_a_row_of_many_springs_that_slip_one_after_another():
    """Maxwell-slip elements, stop operators in parallel, whose travels to slip fall off exponentially."""
    travel, path = 0.7, np.linspace(0.0, 4.0, 401)
    edges = np.linspace(0.0, 25.0 * travel, 20001)
    slips = 0.5 * (edges[1:] + edges[:-1])
    stiffness = np.exp(-slips / travel) / travel**2 * np.diff(edges)
    stretch, force = np.zeros(len(slips)), [0.0]
    for step in np.diff(path):
        stretch = np.clip(stretch + step, -slips, slips)
        force.append(float(stiffness @ stretch))
    np.testing.assert_allclose(_share(path, travel), force, atol=1e-5)


def test_over_a_short_travel_it_is_play_of_twice_the_amplitude():
    path = np.array([0.0, 5.0, 1.0, 4.0, -2.0, -1.0])
    amplitude = 0.3
    expected = play(path[:, None], np.array([amplitude]))[1:, 0]
    np.testing.assert_allclose(-amplitude * _share(path, 1e-3)[1:], expected, atol=1e-12)


def test_points_at_which_the_angle_is_unknown_are_passed_over():
    known, travel = [0.0, 1.0, 0.4, 2.0], 0.5
    share = _share([np.nan, 0.0, np.nan, 1.0, 0.4, np.nan, np.nan, 2.0], travel)
    np.testing.assert_array_equal(share[[1, 3, 4, 7]], _share(known, travel))


def test_slides_have_a_travel_of_their_own_and_drives_act_alone():
    sliding = find("friction_windup", Ptt3())
    assert "travel_mm" in sliding.parameters.names and "travel_rad" not in sliding.parameters.names
    assert sliding.parameters.contains(sliding.coordinates.to_values(sliding.coordinates.typical, {"travel_mm": 5.0}))


def _wound_robot(amplitudes, travel, seed=3):
    values = dict(zip(("amplitude1", "amplitude2", "amplitude3"), amplitudes, strict=True)) | {"travel_rad": travel}
    return measure([ActiveEffect(EFFECT, values)], seed=seed)


def _told(frame):
    return diagnose(frame, MeasuredRobot(ROBOT, MASSES, NOISE_MM), GapSettings(_LIBRARY), details=False)


def test_amplitudes_and_travel_of_a_drawn_robot_are_found():
    generator = np.random.default_rng(11)
    amplitudes, travel = generator.uniform(3e-4, 8e-4, 3), float(np.exp(generator.uniform(*np.log([0.04, 0.15]))))
    found = _told(_wound_robot(amplitudes, travel))
    assert found.verdict["effects"] == "friction_windup" and not found.verdict["confounded_with"]
    (fitted,) = found.state.effects.values()
    np.testing.assert_allclose(fitted, amplitudes, rtol=0.1)
    assert found.state.shape_values["friction_windup"]["travel_rad"] == pytest.approx(travel, rel=0.2)


def test_it_holds_play_and_goes_with_it():
    """Without backlash among the effects it must not reappear as wind-up over no travel."""
    assert GapSettings(("backlash", "friction_windup", "servo_lag")).without("backlash").effects == ("servo_lag",)


def test_play_stays_play_beside_it():
    widths = {"width1": 8e-4, "width2": 5e-4, "width3": 6e-4}
    found = _told(measure([ActiveEffect(find("backlash", ROBOT), widths)], seed=5))
    assert found.verdict["effects"] == "backlash"


def test_at_stops_far_apart_play_and_wind_up_stand_in_for_each_other():
    """Every move there is many travels long: the two effects are confounded, and the answer states it."""
    effect = find("friction_windup", arms.ARM)
    frame = arms.measure([arms.active("friction_windup", np.full(arms.DRIVES, 4e-4), {"travel_rad": 0.02}, effect)])
    known = MeasuredRobot(arms.reading(frame), arms.MASSES, arms.NOISE_MM, noise_rad=arms.NOISE_RAD)
    found = diagnose(frame, known, GapSettings(("backlash", "friction_windup", "servo_lag")), details=False)
    named = {found.verdict["effects"], *found.verdict["confounded_with"].split(", ")}
    assert {"backlash", "friction_windup"} <= named and found.verdict["probability"] < 0.9
