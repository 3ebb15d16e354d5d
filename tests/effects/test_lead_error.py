"""Leads that are off: against positions written down by hand, and which robots have any."""

import numpy as np
import pytest

from rrru.effects.library import find
from rrru.robots.delta import Delta
from rrru.robots.from_dh import from_dh
from rrru.robots.rrru3 import Rrru3
from tests.diagnosis.gantry import GANTRY, RANGES_MM, motion_of


def test_robots_that_slide_have_it_and_others_do_not():
    assert find("lead_error", Rrru3()) is None and find("lead_error", Delta()) is None
    turning = from_dh(
        [{"d_mm": 300, "a_mm": 200, "range_deg": [-90, 90]}, {"sliding": True, "range_mm": [0, 200]}], name="arm"
    )
    assert find("lead_error", turning).parameters.names == ("lead_error2",)
    assert find("lead_error", GANTRY).parameters.names == ("lead_error1", "lead_error2", "lead_error3")


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_slide_goes_a_constant_share_too_far_whatever_the_time_is(axis):
    effect = find("lead_error", GANTRY)
    way = np.random.default_rng(axis).uniform(*RANGES_MM.T, (30, 3))
    values = effect.parameters.vector({f"lead_error{axis + 1}": -3e-4})
    for time in (np.linspace(0.0, 2000.0, 30), np.full(30, np.nan)):
        twists = effect.contribute(motion_of(way, time), values).twists
        moved = GANTRY.solve(way, GANTRY.forward(way), twists).point(GANTRY.tool_mm) - GANTRY.forward(way)
        # x, y, and z that goes down
        direction = np.diag([1.0, 1.0, -1.0])[axis]
        np.testing.assert_allclose(moved, np.outer(-3e-4 * way[:, axis], direction), atol=1e-9)
    assert effect.needs == ()
