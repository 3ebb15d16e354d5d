"""The laws of robots with sliders: what they have in common, their first order, and each against a slow reading of its
docstring.
"""

import numpy as np
import pytest

from rrru.campaign.plan import make_plan
from rrru.campaign.trajectories import Spiral
from rrru.effects.library import LIBRARY, SLIDER_EFFECTS, active_effects, find
from rrru.effects.protocol import Motion
from rrru.errors import ConfigError
from rrru.plant.closure import corrected_sim
from rrru.plant.virtual_tripod import VirtualTripod
from rrru.robots.dynamics import Masses
from rrru.robots.first_order import first_order
from rrru.robots.ptt3 import Ptt3

ROBOTS = {
    "level": (Ptt3(), -250.0),
    "sloped": (Ptt3(rail_inclination_rad=0.5), -250.0),
    "upright": (Ptt3(rail_inclination_rad=np.pi / 2), 20.0),
}


def _motion(robot, height):
    curve = Spiral("curve", (5.0, -3.0), (60.0, 80.0), (height - 20.0, height + 20.0), 2.0, 60)
    plan = make_plan(
        [curve], [{"payload_kg": 0.0, "reverse": False}, {"payload_kg": 4.0, "reverse": True}], 80.0, 400.0, 10.0
    )
    return VirtualTripod(robot).motion(plan, robot.inverse)


MOTIONS = {name: _motion(*robot) for name, robot in ROBOTS.items()}


def _values(effect, share=1.0, shape=-1):
    coordinates = effect.coordinates
    return coordinates.to_values(share * coordinates.typical, coordinates.shapes[shape])


def test_robots_with_sliders_have_rails_instead_of_axes():
    assert set(SLIDER_EFFECTS) - set(LIBRARY["rad"]) == {"rail_tilt"}
    assert set(LIBRARY["rad"]) - set(SLIDER_EFFECTS) == {"axis_tilt", "encoder_eccentricity"}
    assert (
        find("backlash", "mm").parameters["width1"].unit == "mm" and find("backlash").parameters["width1"].unit == "rad"
    )
    assert find("rail_tilt") is None and find("axis_tilt", "mm") is None
    with pytest.raises(ConfigError, match="'axis_tilt' is none of a robot with drives in mm; known: backlash"):
        active_effects({"axis_tilt": {"tilt_x1": 0.001}}, "mm")


@pytest.mark.parametrize("name", SLIDER_EFFECTS)
def test_an_effect_says_what_it_is_and_is_nothing_at_its_nominal_parameters(name):
    effect, motion = SLIDER_EFFECTS[name], MOTIONS["level"]
    assert effect.name == name and set(effect.needs) <= set(Motion.__dataclass_fields__)
    assert (
        all(p.unit and p.source for p in effect.parameters)
        and np.isfinite([effect.parameters.low, effect.parameters.high]).all()
    )
    assert effect.parameters.hold(_values(effect))
    nothing = effect.contribute(motion, effect.parameters.nominal)
    assert not any(np.any(part) for part in vars(nothing).values())


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("name", SLIDER_EFFECTS)
def test_the_first_order_is_the_exact_closures(name, robot):
    """The remainder shrinks with the square of the effect."""
    effect, motion, mechanism = SLIDER_EFFECTS[name], MOTIONS[robot], ROBOTS[robot][0]
    at = first_order(mechanism, motion.position_mm, motion.drive)

    def remainder(share):
        change = effect.contribute(motion, _values(effect, share))
        exact = (
            corrected_sim(mechanism, np.zeros(len(mechanism.parameters)), motion.drive, motion.position_mm, change)
            - motion.position_mm
        )
        return np.abs(exact - at.move(change)).max(), np.abs(exact).max()

    # a sideways turn of an upright rail has no lever that the sliders could show
    whole, size = remainder(1.0)
    assert whole < 0.02 * size + 1e-9
    if whole > 1e-9:
        assert remainder(0.1)[0] < 0.03 * whole + 1e-9


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_loads_on_the_carriages_are_the_slopes_of_the_potential_energy(robot):
    """At rest: the force along rail i is minus the derivative of the weight's potential by b_i, all masses at their
    places.
    """
    mechanism, motion = ROBOTS[robot][0], MOTIONS[robot]
    still = VirtualTripod(mechanism, masses=Masses(2.0, 0.8, 1.5))
    curve = Spiral(
        "curve", (5.0, -3.0), (60.0, 80.0), (motion.position_mm[0, 2], motion.position_mm[0, 2] + 30.0), 1.0, 30
    )
    slow = still.motion(make_plan([curve], [{"payload_kg": 3.0, "reverse": False}], 1e-3, 1e-3, 0.0), mechanism.inverse)

    def energy(slider):
        position, legs = mechanism.forward(slider), mechanism.legs()
        carriage = mechanism.ends(slider, legs)[..., 2].sum(axis=-1)
        return 9.80665 * ((2.0 + 3.0 + 1.5 * 0.8) * position[:, 2] + (1.5 + 0.4) * carriage)

    h = 1e-4
    for leg in range(3):
        step = h * np.eye(3)[leg]
        slope = (energy(slow.drive + step) - energy(slow.drive - step)) / (2.0 * h)
        np.testing.assert_allclose(slow.drive_load[:, leg], -slope, rtol=1e-5, atol=1e-6)


def test_a_leaning_rail_carries_its_slider_off_in_proportion_to_its_way():
    mechanism, motion = ROBOTS["level"][0], MOTIONS["level"]
    rise, swing = 2e-3, -1e-3
    change = SLIDER_EFFECTS["rail_tilt"].contribute(motion, np.array([0.0, rise, swing, *np.zeros(6)]))
    moved = corrected_sim(mechanism, np.zeros(4), motion.drive, motion.position_mm, change)
    rich = Ptt3(parameter_set="rails")
    expected = rich.forward(motion.drive, rich.parameters.vector({"rise1": rise, "swing1": swing}))
    np.testing.assert_allclose(moved, expected, atol=2e-4)
    assert np.abs(expected - motion.position_mm).max() > 0.02


def test_a_screw_leads_and_lags_once_per_turn():
    motion = MOTIONS["level"]
    values = SLIDER_EFFECTS["transmission_error"].parameters.vector({"amplitude2": 0.05, "phase2": 0.3, "lead": 7.0})
    change = SLIDER_EFFECTS["transmission_error"].contribute(motion, values).drive
    turns = motion.drive[:, 1] / 7.0
    np.testing.assert_allclose(change[:, 1], 0.05 * np.sin(2.0 * np.pi * (turns - np.floor(turns)) + 0.3), atol=1e-12)
    assert not change[:, [0, 2]].any()


def test_an_upright_rail_leans_to_the_side_where_a_level_one_swings():
    mechanism, motion = ROBOTS["upright"][0], MOTIONS["upright"]
    change = SLIDER_EFFECTS["rail_tilt"].contribute(motion, np.array([1e-3, *np.zeros(8)]))
    moved = corrected_sim(mechanism, np.zeros(4), motion.drive, motion.position_mm, change)
    rich = Ptt3(rail_inclination_rad=np.pi / 2, parameter_set="rails")
    # lean turns about the outward axis: z goes to minus the tangent
    expected = rich.forward(motion.drive, rich.parameters.vector({"swing1": -1e-3}))
    np.testing.assert_allclose(moved, expected, atol=2e-4)
    assert np.abs(expected - motion.position_mm).max() > 0.02
