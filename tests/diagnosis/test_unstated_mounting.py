"""An arm on a wall whose first joint yields to the weight of the links and a payload."""

import numpy as np
import pytest

import rrru
from rrru.diagnosis.result_notes import MOUNTING_ASSUMED
from tests.diagnosis import numpy_arm
from tests.formats.mjcf import ARM

_COMPLIANCE = 2e-9  # rad/(N mm)


def _file_of(seed):
    generator = np.random.default_rng(seed)
    drive, off = numpy_arm.drives(generator), numpy_arm.errors(generator)
    payload_kg = np.where(np.arange(numpy_arm.STOPS) < numpy_arm.STOPS // 2, 0.0, 6.0)
    bent = drive.copy()
    bent[:, 0] += _COMPLIANCE * numpy_arm.torque_on_a_wall(drive, off, payload_kg)
    *_, (position, turn) = numpy_arm.links(bent, off)
    places = {name: (position, turn, place) for name, place in numpy_arm.PLACES.items()}
    return numpy_arm.table(drive, places, generator, payload_kg=payload_kg)


@pytest.mark.parametrize("up", [(1.0, 0.0, 0.0), None])
def test_what_no_effect_explains_may_be_one_with_gravity_in_another_direction(up):
    """Stated, the mounting gives the compliance; without it the answer was "unexplained" and did not mention it."""
    robot = rrru.load_robot(str(ARM), tip="tool0", **({"up": up} if up else {}))
    campaign = rrru.read_campaign(_file_of(1), robot, noise_mm=numpy_arm.NOISE_MM, frame="register")
    found = rrru.diagnose(campaign)
    if up:
        (effect,) = found.verdict["effects"]
        assert effect["name"] == "drive_compliance" and effect["legs"] == "1"
        first = next(one for one in effect["parameters"] if one["parameter"] == "compliance1")
        assert first["low_95"] < _COMPLIANCE < first["high_95"]
        assert MOUNTING_ASSUMED not in found.verdict["notes"]
    else:
        assert found.verdict["unexplained"] and MOUNTING_ASSUMED in found.verdict["notes"]
