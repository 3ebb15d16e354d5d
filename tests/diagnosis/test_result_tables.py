"""Tables behind a verdict."""

from rrru.diagnosis.result_tables import places_of
from rrru.effects.library import library
from rrru.pipeline.read_config import read_config
from rrru.robots.catalogue import make_mechanism
from rrru.robots.drive_words import drive_words


def test_a_parameter_is_placed_at_the_leg_that_its_name_counts_and_a_shared_one_nowhere():
    robot = make_mechanism("rrru3", read_config()["robots"]["rrru3"])
    for name, effect in library(robot).items():
        for parameter, place in zip(effect.parameters.names, places_of(effect, drive_words(robot)), strict=True):
            if name in ("backlash", "drive_compliance", "servo_lag", "encoder_eccentricity") or place:
                assert place == f"in leg {parameter[-1]}" or name == "drive_error_function", (name, parameter)
    growth = library(robot)["thermal_growth"]
    assert places_of(growth, drive_words(robot)) == ["", ""]
