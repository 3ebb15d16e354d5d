"""A reflector whose mount slips on the robot while a campaign lasts."""

import numpy as np
import pytest

import rrru
from tests.diagnosis import numpy_arm
from tests.formats.mjcf import ARM

_SLIP_MM = [0.12, -0.08, 0.06]


def _file_of(names, seed):
    """What a tracker reads of some reflectors; that of the first is off from the middle of the campaign on."""
    generator = np.random.default_rng(seed)
    drive = numpy_arm.drives(generator)
    *_, (position, turn) = numpy_arm.links(drive, numpy_arm.errors(generator))
    places = {name: (position, turn, numpy_arm.PLACES[name]) for name in names}
    slipped = np.outer(np.arange(numpy_arm.STOPS) >= numpy_arm.STOPS // 2, _SLIP_MM)
    places[names[0]] = position, turn, numpy_arm.PLACES[names[0]] + slipped
    return numpy_arm.table(drive, places, generator)


@pytest.mark.parametrize("names", [("a", "b"), ("a",)])
def test_a_mount_that_slips_is_no_effect_of_the_robot(names):
    """Of two reflectors at each stop one moved on the flange: zero drift and link growth had 0.99 and 0.96."""
    robot = rrru.load_robot(str(ARM), tip="tool0")
    campaign = rrru.read_campaign(_file_of(names, 1), robot, noise_mm=numpy_arm.NOISE_MM, frame="register")
    found = rrru.diagnose(campaign)
    assert found.verdict["unexplained"] and found.verdict["effects"] == []
    best = found.verdict["unexplained_follows"][0]
    moment = 20 * (numpy_arm.STOPS // 2) - 10
    assert best["follows"] == f"a jump at {moment} s, as a shift of reflector a" and best["explained"] > 0.9
