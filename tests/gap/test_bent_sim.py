"""Effects that a calibration of all numbers hides for the most part: what is left is small, the way there is not."""

from dataclasses import replace

import numpy as np
import pytest

from rrru.gap.diagnose import MeasuredRobot, diagnose
from rrru.gap.settings import GapSettings
from rrru.studies.withheld.faults import Fault
from rrru.studies.withheld.foreign import FileRobot
from tests.studies.withheld.files import conditions

_PLAY = FileRobot(
    "own_rrru3_file_0000",
    "rrru3_file",
    "own",
    {
        "lines": {
            "start_mm": [-91.82195951310219, -16.24699188508639, 739.3466902701281],
            "end_mm": [132.17804048689783, -16.24699188508639, 739.3466902701281],
            "offsets_y_mm": [0.0, 70.0, -70.0],
            "points": 9,
        },
        "spiral": {
            "centre_mm": [20.178040486897814, -16.24699188508639],
            "radius_mm": [46.284539312235424, 114.6953494467396],
            "z_mm": [672.3312503273202, 747.7470164622932],
            "turns": 2.869265610154013,
            "start_deg": 359.413359544805,
            "points": 32,
        },
    },
    (0.0022902337476360824, 0.0005049088097088519, 0.0011195936702282777),
    (Fault("play", (0.0002215150897626095, 0.0010688216771108496, 0.0005453191365892356), {}),),
)


def test_what_the_linear_sim_lacks_is_not_unexplained():
    """A robot on which it was, 0.026 mm, though the law is the plant's own and the exact sim fits to the noise."""
    known = replace(conditions("rrru3_file"), seed=260711)
    points = _PLAY.measured(known)
    robot = MeasuredRobot(known.seen(points), known.masses, known.noise_mm)
    found = diagnose(points, robot, GapSettings(), details=False)
    assert found.verdict["effects"] == "backlash"
    left = found.attribution.case.residual(found.state)
    assert np.sqrt((left**2).mean()) == pytest.approx(known.noise_mm, rel=0.1)
