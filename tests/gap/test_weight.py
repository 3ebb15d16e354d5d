"""A load that nobody told of and a base that leans: what gives way is named, its numbers hold, and the user is told."""

import numpy as np
import pytest

from rrru.errors import ConfigError
from rrru.gap.diagnose import MeasuredRobot, diagnose
from rrru.gap.settings import GapSettings
from rrru.seeds import stream
from rrru.studies.withheld.box import draw_trajectories
from rrru.studies.withheld.faults import Fault
from rrru.studies.withheld.foreign import FileRobot
from tests.studies.withheld.files import conditions

_FILE, _SOFT = "hexapod_file", (0.03, 0.012, 0.045, 0.02, 0.035, 0.025)
_OFF = {"extra_kg": 1.2, "lean_x": 0.025, "lean_y": -0.02}


def _found(more, settings=None):
    """Verdict and `gap_parameters` by effect and parameter of a hexapod with soft legs."""
    known = conditions(_FILE)
    fault = Fault("soft_servo_under_a_load", _SOFT, more)
    paths = draw_trajectories(stream(5, "paths"), known)
    robot = FileRobot("a hexapod", _FILE, "own", paths, (0.2, -0.1, 0.3, 0.1, -0.4, 0.2), (fault,))
    measurements = robot.measured(known)
    told = MeasuredRobot(known.seen(measurements), known.masses, known.noise_mm)
    result = diagnose(measurements, told, settings or GapSettings(), details=False)
    return result.verdict, result.tables["gap_parameters"].set_index(["effect", "parameter"])


@pytest.fixture(scope="module")
def misled():
    """Under a weight that is not as told."""
    return _found({"load_kg": _OFF["extra_kg"], "tilt_x_rad": _OFF["lean_x"], "tilt_y_rad": _OFF["lean_y"]})


def test_the_springs_are_named_and_within_their_errors(misled):
    verdict, numbers = misled
    assert verdict["effects"] == "drive_compliance"
    own = numbers.loc["drive_compliance"]
    off = (own["value"] - np.array(_SOFT)) / own["standard_error"]
    # six numbers of chi-square 22.5 in a thousand draws once
    assert (off**2).sum() < 22.5
    assert (own["standard_error"] < 0.1 * np.array(_SOFT)).sum() >= 4


def test_what_the_weight_is_off_by_is_found_and_told(misled):
    verdict, numbers = misled
    weight = numbers.loc["weight"]
    off = (weight["value"] - list(_OFF.values())) / weight["standard_error"]
    assert list(weight.index) == list(_OFF) and (off**2).sum() < 16.3
    sure = weight[weight["value"].abs() > 3.0 * weight["standard_error"]]
    assert len(sure) and verdict["notes"].count("weight not as told") == len(sure)


def test_a_weight_that_is_as_told_stays_so():
    verdict, numbers = _found({})
    weight = numbers.loc["weight"]
    assert verdict["effects"] == "drive_compliance" and "weight not" not in verdict["notes"]
    assert (weight["value"].abs() < 3.0 * weight["standard_error"]).all()


def test_a_weight_that_is_known_is_not_fitted():
    known = dict.fromkeys(_OFF, 0.0)
    verdict, numbers = _found({}, GapSettings(known={"weight": known}))
    assert verdict["effects"] == "drive_compliance" and "weight" not in numbers.index.get_level_values("effect")
    _, free = _found({})
    sizes = [one.loc["drive_compliance", "standard_error"] for one in (numbers, free)]
    assert (sizes[0] < sizes[1]).all()


@pytest.mark.parametrize("wrong", [{"lean_z": 0.0}, {"extra_kg": 1.0}], ids=["no such number", "not as told"])
def test_of_the_weight_only_that_it_is_as_told_can_be_known(wrong):
    with pytest.raises(ConfigError, match=r"gap\.known: weight"):
        GapSettings(known={"weight": wrong}).library(conditions(_FILE).mechanism)
