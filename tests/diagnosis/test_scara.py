"""The diagnosis of an arm whose drives turn and slide: its periodic errors are those of the drives that turn."""

import numpy as np
import pytest

from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.settings import GapSettings
from rrru.diagnosis.terms import variants
from rrru.effects.library import find
from rrru.kinematics.dynamics import Masses
from rrru.pipeline import setup
from rrru.robots.catalogue import make_mechanism

_SCARA = {
    "dh": [
        {"d_mm": 300, "a_mm": 350, "range_deg": [-130, 130], "home_deg": -40, "mass_kg": 6.0},
        {"a_mm": 300, "alpha_deg": 180, "range_deg": [-140, 140], "home_deg": 80, "mass_kg": 4.0},
        {"sliding": True, "range_mm": [0, 300], "home_mm": 120, "mass_kg": 1.5},
    ]
}
_NOISE_MM = 0.02


def _campaign(effects):
    """A table of a SCARA that is driven along lines there and back."""
    robot = make_mechanism("scara", _SCARA, parameter_set="full")
    x, y, z = robot.legs.home_mm.tolist()
    line = {"start_mm": [x - 150.0, y, z - 60.0], "end_mm": [x + 100.0, y, z + 60.0], "points": 40}
    masses = dict.fromkeys(("platform_mass_kg", "forearm_mass_kg", "arm_mass_kg"), 0.0)
    virtual = {
        "name": "scara",
        "seed": 4,
        "robot": {"errors": {}, "effects": effects, **masses},
        "trajectories": {"lines": line | {"offsets_y_mm": [-120.0, -40.0, 40.0, 120.0]}},
        "passes": [{"reverse": reverse, "payload_kg": 0.0} for reverse in (False, True)],
        "motion": {"speed_mm_s": 100.0, "acceleration_mm_s2": 1000.0, "dwell_s": 0.5},
        "noise_mm": _NOISE_MM,
    }
    nominal = {"name": "scara", "dimensions": _SCARA, "parameter_set": "full"}
    frame, _ = setup.virtual_campaign(nominal, virtual).run()
    return frame, MeasuredRobot(setup.measured_robot(nominal, frame), Masses(0.0, 0.0, 0.0), _NOISE_MM, "scara")


@pytest.mark.parametrize("name", ["encoder_eccentricity", "transmission_error"])
def test_numbers_are_those_of_the_turning_drives(name):
    robot = make_mechanism("scara", _SCARA, parameter_set="full")
    effect = find(name, robot)
    assert [p.leg for p in effect.parameters if p.leg] == [1, 2, 1, 2]
    assert effect.coordinates.legs.tolist() == [1, 1, 2, 2]


def test_a_gear_error_of_a_ratio_that_is_not_stated_is_named_together_with_a_slide():
    true = {"amplitude1": 2.5e-4, "amplitude2": 4e-4, "phase1": 0.4, "phase2": -2.0, "ratio": 31.0}
    frame, known = _campaign({"transmission_error": true})
    effects = ("backlash", "encoder_eccentricity", "transmission_error", "drive_compliance", "thermal_growth")
    found = diagnose(frame, known, GapSettings(effects, draws=10), details=False)
    assert found.verdict["effects"] == "transmission_error" and found.verdict["probability"] > 0.9
    numbers = found.tables["gap_parameters"].set_index("parameter")["value"]
    assert numbers["ratio"] == pytest.approx(31.0, abs=0.5)
    for drive in (1, 2):
        assert numbers[f"amplitude{drive}"] == pytest.approx(true[f"amplitude{drive}"], rel=0.15)
    assert not {"amplitude3", "phase3"} & set(numbers.index)
    # a slide has no such error
    motion = found.inference.problem.motion
    effect, robot = find("transmission_error", known.mechanism), known.mechanism
    change = effect.contribute(motion, effect.parameters.vector(true))
    turned = robot.drive_errors(np.broadcast_to(change.twists, (len(motion), *change.twists.shape[1:])))
    assert not turned[:, 2].any()
    for k in (0, 1):
        wave = true[f"amplitude{k + 1}"] * np.sin(31.0 * motion.drive[:, k] + true[f"phase{k + 1}"])
        np.testing.assert_allclose(turned[:, k], wave, atol=1e-12)


def test_the_travel_of_slides_is_no_number_of_a_turning_drive_s_wind_up():
    true = {"amplitude1": 4e-4, "amplitude2": 0.0, "amplitude3": 0.0, "travel_rad": 0.05, "travel_mm": 5.0}
    frame, known = _campaign({"friction_windup": true})
    found = diagnose(frame, known, GapSettings(("backlash", "friction_windup"), draws=10), details=False)
    assert found.verdict["effects"] == "friction_windup"
    numbers = found.tables["gap_parameters"].query("effect == 'friction_windup'").set_index("parameter")
    assert numbers["low_95"]["travel_rad"] < 0.05 < numbers["high_95"]["travel_rad"]
    assert np.isnan(numbers.loc["travel_mm", ["standard_error", "low_95", "high_95"]].to_numpy(dtype=float)).all()


def test_an_effect_of_the_only_slide_acts_at_that_slide():
    """At "each" of one slide is the same: the answer named no drive where both were equally probable."""
    library = GapSettings().library(make_mechanism("scara", _SCARA, parameter_set="full"))
    assert {term.legs for term in variants(library["lead_error"])} == {3}
    assert {term.legs for term in variants(library["gain_error"])} == {"each", 1, 2}
