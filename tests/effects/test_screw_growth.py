"""Screws that grow: against positions written down by hand, and which robots have any."""

import numpy as np
import pytest

from rrru.effects.library import find
from rrru.robots.delta import Delta
from rrru.robots.from_dh import from_dh
from rrru.robots.ptt3 import Ptt3
from rrru.robots.rrru3 import Rrru3
from tests.diagnosis.gantry import GANTRY, RANGES_MM, motion_of

_SHAPE = {"time_constant": 400.0}


def test_robots_that_slide_have_it_and_others_do_not():
    assert find("screw_growth", Rrru3()) is None and find("screw_growth", Delta()) is None
    turning = from_dh(
        [{"d_mm": 300, "a_mm": 200, "range_deg": [-90, 90]}, {"sliding": True, "range_mm": [0, 200]}], name="arm"
    )
    assert find("screw_growth", turning).parameters.names == ("low_strain2", "high_strain2", "time_constant")
    # the range of these sliders is not stated
    assert find("screw_growth", Ptt3()).parameters.names == (*(f"low_strain{k}" for k in (1, 2, 3)), "time_constant")


@pytest.mark.parametrize("held", ["low", "high"])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_slide_goes_farther_from_the_end_at_which_its_screw_is_held(axis, held):
    effect = find("screw_growth", GANTRY)
    generator = np.random.default_rng(axis)
    way = generator.uniform(*RANGES_MM.T, (30, 3))
    time = np.linspace(0.0, 2000.0, 30)
    motion = motion_of(way, time)
    values = effect.parameters.vector({f"{held}_strain{axis + 1}": 2e-4} | _SHAPE)
    twists = effect.contribute(motion, values).twists
    moved = GANTRY.solve(way, GANTRY.forward(way), twists).point(GANTRY.tool_mm) - GANTRY.forward(way)
    # x, y, and z that goes down
    direction = np.diag([1.0, 1.0, -1.0])[axis]
    end = RANGES_MM[axis][0 if held == "low" else 1]
    expected = 2e-4 * (way[:, axis] - end) * (1.0 - np.exp(-time / 400.0))
    np.testing.assert_allclose(moved, np.outer(expected, direction), atol=1e-9)


def test_a_screw_held_between_its_ends_grows_both_ways():
    effect = find("screw_growth", GANTRY)
    low, high = RANGES_MM[0]
    values = effect.parameters.vector({"low_strain1": 3e-4, "high_strain1": 1e-4} | _SHAPE)
    still = 0.75 * low + 0.25 * high
    way = np.array([[still, 100.0, 100.0], [still + 200.0, 100.0, 100.0], [still - 200.0, 100.0, 100.0]])
    twists = effect.contribute(motion_of(way, np.full(3, 1e6)), values).twists
    moved = GANTRY.solve(way, GANTRY.forward(way), twists).point(GANTRY.tool_mm) - GANTRY.forward(way)
    np.testing.assert_allclose(moved[:, 0], [0.0, 0.08, -0.08], atol=1e-9)


def test_nothing_grows_where_nobody_knows_the_time():
    effect = find("screw_growth", GANTRY)
    way = np.full((4, 3), 150.0)
    values = effect.parameters.vector({"low_strain1": 3e-4} | _SHAPE)
    assert not effect.contribute(motion_of(way, np.full(4, np.nan)), values).twists.any()
    assert effect.needs == ("time_s",)
