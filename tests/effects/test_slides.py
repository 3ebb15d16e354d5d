"""Leads that are off and screws that grow: against positions written down by hand, and which robots have any."""

import numpy as np
import pytest

from rrru.effects.library import find
from rrru.robots.delta import Delta
from rrru.robots.ptt3 import Ptt3
from rrru.robots.rrru3 import Rrru3
from tests.diagnosis.gantry import GANTRY, RANGES_MM, motion_of
from tests.effects.robots import TURN_AND_SLIDE

_SHAPE = {"time_constant": 400.0}
# x, y, and z that goes down
_DIRECTIONS = np.diag([1.0, 1.0, -1.0])
every_axis = pytest.mark.parametrize("axis", [0, 1, 2])


def _moved(name, way, time, **values):
    """Displacements (n, 3) of the gantry's tool at values (n, 3) of its slides and times (n,) under an effect."""
    effect = find(name, GANTRY)
    twists = effect.contribute(motion_of(way, time), effect.parameters.vector(values)).twists
    return GANTRY.solve(way, GANTRY.forward(way), twists).point(GANTRY.tool_mm) - GANTRY.forward(way)


def test_robots_that_slide_have_them_and_others_do_not():
    for name in ("lead_error", "screw_growth"):
        assert find(name, Rrru3()) is None and find(name, Delta()) is None
    assert find("lead_error", TURN_AND_SLIDE).parameters.names == ("lead_error2",)
    assert find("lead_error", GANTRY).parameters.names == ("lead_error1", "lead_error2", "lead_error3")
    growth = find("screw_growth", TURN_AND_SLIDE)
    assert growth.parameters.names == ("low_strain2", "high_strain2", "time_constant")
    # the range of these sliders is not stated
    assert find("screw_growth", Ptt3()).parameters.names == (*(f"low_strain{k}" for k in (1, 2, 3)), "time_constant")
    assert find("lead_error", GANTRY).needs == () and find("screw_growth", GANTRY).needs == ("time_s",)


@every_axis
def test_a_slide_goes_a_constant_share_too_far_whatever_the_time_is(axis):
    way = np.random.default_rng(axis).uniform(*RANGES_MM.T, (30, 3))
    for time in (np.linspace(0.0, 2000.0, 30), np.full(30, np.nan)):
        moved = _moved("lead_error", way, time, **{f"lead_error{axis + 1}": -3e-4})
        np.testing.assert_allclose(moved, np.outer(-3e-4 * way[:, axis], _DIRECTIONS[axis]), atol=1e-9)


@pytest.mark.parametrize("held", ["low", "high"])
@every_axis
def test_a_slide_goes_farther_from_the_end_at_which_its_screw_is_held(axis, held):
    way = np.random.default_rng(axis).uniform(*RANGES_MM.T, (30, 3))
    time = np.linspace(0.0, 2000.0, 30)
    moved = _moved("screw_growth", way, time, **{f"{held}_strain{axis + 1}": 2e-4}, **_SHAPE)
    end = RANGES_MM[axis][0 if held == "low" else 1]
    expected = 2e-4 * (way[:, axis] - end) * (1.0 - np.exp(-time / 400.0))
    np.testing.assert_allclose(moved, np.outer(expected, _DIRECTIONS[axis]), atol=1e-9)


def test_a_screw_held_between_its_ends_grows_both_ways():
    low, high = RANGES_MM[0]
    still = 0.75 * low + 0.25 * high
    way = np.array([[still, 100.0, 100.0], [still + 200.0, 100.0, 100.0], [still - 200.0, 100.0, 100.0]])
    moved = _moved("screw_growth", way, np.full(3, 1e6), low_strain1=3e-4, high_strain1=1e-4, **_SHAPE)
    np.testing.assert_allclose(moved[:, 0], [0.0, 0.08, -0.08], atol=1e-9)


def test_nothing_grows_where_nobody_knows_the_time():
    effect = find("screw_growth", GANTRY)
    values = effect.parameters.vector({"low_strain1": 3e-4} | _SHAPE)
    assert not effect.contribute(motion_of(np.full((4, 3), 150.0), np.full(4, np.nan)), values).twists.any()
