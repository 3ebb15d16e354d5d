"""Tables behind a verdict."""

from types import SimpleNamespace

import numpy as np
import pandas as pd

from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.result_tables import acting_places, followed_interval, places_of, where
from rrru.diagnosis.settings import GapSettings
from rrru.diagnosis.terms import EffectTerm
from rrru.effects.library import find, library
from rrru.effects.motion import Course, make_motion
from rrru.pipeline.read_config import read_config
from rrru.robots.catalogue import make_mechanism
from rrru.robots.drive_words import drive_words
from rrru.robots.hexapod import hexapod
from tests.diagnosis.campaigns import MASSES, NOISE_MM, ROBOT, active, measure


def test_an_end_at_a_bound_of_zero_is_zero():
    """Of a width that follows a coefficient with a factor: rounding made -3.9e-19 of it, which looks like a sign."""
    generator = np.random.default_rng(1)
    for number, slope in zip(generator.uniform(0.0, 1e-3, 200), generator.uniform(-2.0, 2.0, 200), strict=True):
        ends = followed_interval(slope * number, slope, number, np.array([0.0, 2.1 * number]))
        assert 0.0 in ends and np.isclose(np.abs(ends).max(), 2.1 * abs(slope * number))


def test_a_parameter_is_placed_at_the_leg_that_its_name_counts_and_a_shared_one_nowhere():
    robot = make_mechanism("rrru3", read_config()["robots"]["rrru3"])
    for name, effect in library(robot).items():
        for parameter, place in zip(effect.parameters.names, places_of(effect, drive_words(robot)), strict=True):
            if name in ("backlash", "drive_compliance", "servo_lag", "encoder_eccentricity") or place:
                assert place == f"in leg {parameter[-1]}" or name == "drive_error_function", (name, parameter)
    growth = library(robot)["thermal_growth"]
    assert places_of(growth, drive_words(robot)) == ["", ""]


def _number(parameter, place, value, error):
    """A row of `gap_parameters` with an interval of two standard errors."""
    ends = {"low_95": value - 1.96 * error, "high_95": value + 1.96 * error}
    return {"parameter": parameter, "place": place, "value": value, **ends}


def test_a_cause_acts_at_the_places_at_which_one_of_its_numbers_is_not_zero():
    phases = [_number(f"phase{k}", f"at joint {k}", 2.0, 0.6) for k in (1, 2)]
    waves = [_number("amplitude1", "at joint 1", 1e-3, 1e-4), _number("amplitude2", "at joint 2", 1e-4, 1e-4)]
    assert acting_places([*waves, *phases]) == ["at joint 1"]
    # one of many numbers is beyond its interval by chance
    many = [_number(f"sine1_{k}", "at joint 1", 2.5 * (k == 3), 1.0) for k in range(20)]
    few = [_number("sine2_1", "at joint 2", 2.5, 1.0)]
    assert acting_places([*many, *few]) == ["at joint 2"]
    # of a size that cannot be negative the interval ends next to zero
    sizes = [{"parameter": f"compliance{k}", "place": f"at joint {k}", "value": 2e-9, "high_95": 3e-9} for k in (1, 2)]
    assert acting_places([sizes[0] | {"low_95": 1.2e-9}, sizes[1] | {"low_95": 1.8e-24}]) == ["at joint 1"]
    # all where none is beyond
    assert acting_places(many) == ["at joint 1"]


def test_legs_whose_bars_are_driven_are_named_once_and_as_in_sentences():
    angle = np.radians([0.0, 20.0, 120.0, 140.0, 240.0, 260.0])
    ring = 300.0 * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    robot = hexapod(ring, np.roll(ring, 1, axis=0), 400.0, 80.0)
    way, nothing = np.full((1, 6), 5.0), np.full((1, 6), np.nan)
    course = Course(
        robot.forward(way), way, way, np.arange(1), nothing[:, 0], nothing[:, :3], nothing[:, :3], nothing[:, 0]
    )
    names = ("lead_error", "drive_error_function")
    effects = {name: find(name, robot) for name in names}
    problem = SimpleNamespace(mechanism=robot, library=effects, motion=make_motion(robot, MASSES, course))
    terms = [EffectTerm("lead_error", 0, (3, 5, 6)), EffectTerm("drive_error_function", 0, 5)]
    acting = [("lead_error", f"in leg {k}", 1e-3) for k in (3, 5, 6)] + [("drive_error_function", "in leg 5", 1e-3)]
    numbers = pd.DataFrame([{"effect": name} | _number("size", place, size, 1e-5) for name, place, size in acting])
    inference = SimpleNamespace(problem=problem, hypothesis=SimpleNamespace(terms=terms))
    assert where(inference, names, numbers) == "leg 3, leg 5 to leg 6"


def test_the_table_names_the_sites_at_which_an_effect_is_not_zero():
    """Backlash of the legs 1 and 3, and none of leg 2."""
    frame = measure([active("backlash", (8e-4, 0.0, 8e-4))])
    known = MeasuredRobot(ROBOT, MASSES, NOISE_MM)
    found = diagnose(frame, known, GapSettings(("backlash",), draws=10), details=False)
    assert found.verdict["effects"] == "backlash" and found.verdict["leg"] == 0
    assert found.verdict["where"] == "leg 1 drive, leg 3 drive"


def test_where_no_place_is_sure_those_that_were_not_fitted_are_none():
    """Growth of one slide whose interval holds zero, next to a slide without growth: "at X, Z" was said."""
    numbers = [
        {"parameter": "strain1", "place": "at X", "value": 5e-5, "low_95": 0.0, "high_95": 1.4e-4},
        {"parameter": "strain3", "place": "at Z", "value": 0.0, "low_95": np.nan, "high_95": np.nan},
    ]
    assert acting_places(numbers) == ["at X"] and acting_places(numbers[1:]) == ["at Z"]
