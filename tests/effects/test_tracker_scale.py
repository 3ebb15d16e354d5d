"""A wrong millimetre of the instrument: what it does, and which robots can show it."""

import numpy as np
import pytest

from rrru.effects.library import find
from rrru.gap.identify import identify
from rrru.gap.make_case import make_case
from rrru.gap.state import State
from rrru.robots.legs import WORLD
from rrru.robots.ptt3 import Ptt3
from tests.effects.robots import ROBOT, SPIRAL
from tests.gap.campaigns import MASSES, NOISE_MM, SIM, measure


def test_all_distances_grow_by_one_factor():
    motion = _case(SIM, measure()).motion
    effect = find("tracker_scale", ROBOT)
    moved = effect.contribute(motion, [2e-4]).twists[:, ROBOT.legs.site_numbers[WORLD]]
    assert not moved[:, 3:].any()
    reported = motion.position_mm + moved[:, :3]
    between = [np.linalg.norm(points[1:] - points[0], axis=1) for points in (motion.position_mm, reported)]
    np.testing.assert_allclose(between[1], 1.0002 * between[0], rtol=1e-12)
