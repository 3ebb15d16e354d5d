"""Effects that a calibration of all numbers hides for the most part: what is left is small, the way there is not."""

from dataclasses import replace

import numpy as np
import pytest

from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.settings import GapSettings
from rrru.studies.blind_validation.causes import Fault
from rrru.studies.blind_validation.robots import FileRobot
from tests.studies.blind_validation.files import conditions

_WITH_BACKLASH = FileRobot(
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

_SLACK = (0.07442887924859855, 0.23848702682012704, 0.12866482125360412)
_SLACK += (0.1431414975413584, 0.34533297135048097, 0.06102877068891614)
_CLEARANCE = FileRobot(
    "own_delta_file_0009",
    "delta_file",
    "own",
    {
        "lines": {
            "start_mm": [-146.60799860918928, 25.902684602304554, -43.632445962420014],
            "end_mm": [173.39200139081072, 25.902684602304554, -43.632445962420014],
            "offsets_y_mm": [0.0, 100.0, -100.0],
            "points": 9,
        },
        "spiral": {
            "centre_mm": [13.392001390810732, 25.902684602304554],
            "radius_mm": [78.97534235460977, 154.36103155931195],
            "z_mm": [-72.99556670384243, 104.97274489379015],
            "turns": 3.1383073039592295,
            "start_deg": 336.95170196816105,
            "points": 32,
        },
    },
    (-0.00011166623728129379, -0.0009999400718385374, -6.630916916036813e-05),
    (Fault("clearance", _SLACK, {}),),
)


def _diagnosed(robot, seed):
    """Conditions of a FileRobot and the Diagnosis of its campaign."""
    known = replace(conditions(robot.file), seed=seed)
    points = robot.measured(known)
    measured = MeasuredRobot(known.seen(points), known.masses, known.noise_mm)
    return known, diagnose(points, measured, GapSettings(), details=False)


def test_what_the_linear_model_lacks_is_not_unexplained():
    """A robot on which it was, 0.026 mm, though the effect is the plant's own and the exact model fits to the noise."""
    known, found = _diagnosed(_WITH_BACKLASH, 260711)
    assert found.verdict["effects"] == "backlash"
    left = found.inference.problem.residual(found.state)
    assert np.sqrt((left**2).mean()) == pytest.approx(known.noise_mm, rel=0.1)


def test_a_fit_gets_away_from_where_the_calibration_went_to_hide_the_effect():
    """A robot whose calibration moves seats by up to 13 mm; its steps shrink, with 0.6 of the clearance found."""
    known, found = _diagnosed(_CLEARANCE, 51177)
    rows = found.tables["gap_parameters"].query("effect == 'joint_clearance'").set_index("parameter")
    names = [f"clearance{member}" for member in range(1, 7)]
    off = (rows.loc[names, "value"] - np.array(_SLACK)) / rows.loc[names, "standard_error"]
    assert np.abs(off).max() < 3.0
    left = found.inference.problem.residual(found.state)
    assert np.sqrt((left**2).mean()) == pytest.approx(known.noise_mm, rel=0.1)
