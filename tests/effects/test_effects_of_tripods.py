"""Effect models of robots with sliders and of the Delta: what all have in common, their first order, and each against a
slow reading of its docstring.
"""

from dataclasses import replace

import numpy as np
import pytest

from rrru.campaign.plan import make_plan
from rrru.campaign.trajectories import Spiral
from rrru.effects.library import active_effects, find, library
from rrru.effects.protocol import Contribution, Motion
from rrru.errors import ConfigError
from rrru.kinematics.dynamics import Masses
from rrru.robots.delta import Delta
from rrru.robots.ptt3 import Ptt3
from rrru.robots.rrru3 import Rrru3
from rrru.simulation.virtual_robot import VirtualRobot
from tests.effects.robots import ELSEWHERE, SLIDER_EFFECTS
from tests.reference import tripods_slow

ROBOTS = {
    "level": (Ptt3(), -250.0),
    "sloped": (Ptt3(rail_inclination_rad=0.5), -250.0),
    "upright": (Ptt3(rail_inclination_rad=np.pi / 2), 20.0),
    "delta": (Delta(), 0.0),
}
SLIDERS = ("level", "sloped", "upright")
EFFECTS = [
    (name, effect) for name, (robot, _) in ROBOTS.items() for effect in library(robot) if effect not in ELSEWHERE
]


def _motion(robot, height):
    curve = Spiral("curve", (5.0, -3.0), (60.0, 80.0), (height - 20.0, height + 20.0), 2.0, 60)
    plan = make_plan(
        [curve], [{"payload_kg": 0.0, "reverse": False}, {"payload_kg": 4.0, "reverse": True}], 80.0, 400.0, 10.0
    )
    return VirtualRobot(robot).motion(plan, robot.inverse)


MOTIONS = {name: _motion(*robot) for name, robot in ROBOTS.items()}


def _exact(robot, motion, change):
    """Positions (n, 3) and sizes (n,) of the platform's turn at the exact closure under a contribution."""
    poses = robot.solve(motion.drive, motion.position_mm, change.twists)
    assert poses.closed.all()
    turned = poses.turned_from(np.broadcast_to(np.eye(3), poses.turn.shape))
    return robot.measured(poses, change.twists), np.linalg.norm(turned, axis=1)


def _values(effect, share=1.0, shape=-1):
    """Values of about typical size, others on every leg: equal ones may cancel."""
    coordinates = effect.coordinates
    sizes = np.random.default_rng(4).uniform(0.5, 1.5, len(coordinates)) * coordinates.typical
    return coordinates.to_values(share * sizes, coordinates.shapes[shape])


def test_robots_with_sliders_have_rails_instead_of_axes():
    turning, sliding = Rrru3(), Ptt3()
    rails, axes = set(library(sliding)), set(library(turning))
    assert rails - axes == {"rail_tilt", "bar_mismatch", "screw_growth", "lead_error"}
    of_encoders = {"encoder_eccentricity", "encoder_ovality", "transmission_orders"}
    assert axes - rails == {"axis_tilt", "joint_axis_error"} | of_encoders
    assert find("backlash", sliding).parameters["width1"].unit == "mm"
    assert find("backlash", turning).parameters["width1"].unit == "rad"
    assert find("rail_tilt", turning) is None and find("axis_tilt", sliding) is None
    with pytest.raises(ConfigError, match="'axis_tilt' is none of a ptt3; known: backlash"):
        active_effects({"axis_tilt": {"tilt_x1": 0.001}}, sliding)


def test_a_delta_has_bars_in_pairs_and_three_drives_turn_no_platform():
    assert set(library(Delta())) - set(library(Rrru3())) == {"bar_mismatch"}
    assert not set(library(Rrru3())) - set(library(Delta()))
    assert all(find("tool_offset", robot) is None for robot, _ in ROBOTS.values())


@pytest.mark.parametrize(("robot", "name"), EFFECTS)
def test_an_effect_says_what_it_is_and_is_nothing_at_its_nominal_parameters(name, robot):
    effect, motion = library(ROBOTS[robot][0])[name], MOTIONS[robot]
    assert effect.name == name and set(effect.needs) <= set(Motion.__dataclass_fields__)
    assert (
        all(p.unit and p.source for p in effect.parameters)
        and np.isfinite([effect.parameters.low, effect.parameters.high]).all()
    )
    assert effect.parameters.contains(_values(effect))
    assert not np.any(effect.contribute(motion, effect.parameters.nominal).twists)
    assert np.any(effect.contribute(motion, _values(effect)).twists)


@pytest.mark.parametrize(("robot", "name"), EFFECTS)
def test_the_first_order_is_the_exact_closures(name, robot):
    """The remainder shrinks with the square of the effect."""
    motion, mechanism = MOTIONS[robot], ROBOTS[robot][0]
    effect, at = library(mechanism)[name], mechanism.map_at(motion.drive, motion.position_mm)

    def remainder(share):
        change = effect.contribute(motion, _values(effect, share))
        exact = _exact(mechanism, motion, change)[0] - motion.position_mm
        return np.abs(exact - at.move(change.twists)).max(), np.abs(exact).max()

    # a sideways turn of an upright rail has no lever that the sliders could show
    whole, size = remainder(1.0)
    assert whole < 0.02 * size + 1e-9
    if whole > 1e-9:
        assert remainder(0.1)[0] < 0.03 * whole + 1e-9


@pytest.mark.parametrize("robot", SLIDERS)
def test_the_loads_on_the_carriages_are_the_slopes_of_the_potential_energy(robot):
    """At rest: the force along rail i is minus the derivative of the weight's potential by b_i, all masses at their
    places.
    """
    mechanism, motion = ROBOTS[robot][0], MOTIONS[robot]
    still = VirtualRobot(mechanism, masses=Masses(2.0, 0.8, 1.5))
    curve = Spiral(
        "curve", (5.0, -3.0), (60.0, 80.0), (motion.position_mm[0, 2], motion.position_mm[0, 2] + 30.0), 1.0, 30
    )
    slow = still.motion(make_plan([curve], [{"payload_kg": 3.0, "reverse": False}], 1e-3, 1e-3, 0.0), mechanism.inverse)

    def energy(slider):
        position, legs = mechanism.forward(slider), mechanism.numbers()
        carriage = mechanism.ends(slider, legs)[..., 2].sum(axis=-1)
        return 9.80665 * ((2.0 + 3.0 + 1.5 * 0.8) * position[:, 2] + (1.5 + 0.4) * carriage)

    h = 1e-4
    for leg in range(3):
        step = h * np.eye(3)[leg]
        slope = (energy(slow.drive + step) - energy(slow.drive - step)) / (2.0 * h)
        np.testing.assert_allclose(slow.drive_load[:, leg], -slope, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("robot", SLIDERS)
def test_a_tilted_rail_takes_its_joints_along_and_turns_the_platform(robot):
    """Against matrices and a general solver; the platform turns by about as much as the rails."""
    mechanism, motion = ROBOTS[robot][0], MOTIONS[robot]
    tilts = np.random.default_rng(3).normal(0.0, 2e-3, (3, 3))
    change = SLIDER_EFFECTS["rail_tilt"].contribute(motion, tilts.ravel())
    position, turned = _exact(mechanism, motion, change)
    feet = np.concatenate([np.zeros((3, 3)), tilts * [1.0, -1.0, 1.0]], axis=1)
    lengths, inclination = np.full((3, 2), mechanism.L_mm), mechanism.rail_inclination_rad
    for k in range(0, len(motion), 15):
        there = tripods_slow.ptt3_bars(motion.drive[k], feet, inclination, lengths, motion.position_mm[k])
        np.testing.assert_allclose(position[k], there[0], atol=1e-7)
        assert turned[k] == pytest.approx(np.linalg.norm(there[1]), abs=1e-9)
    assert 1e-3 < np.median(turned) < 1e-2


def _upright(mechanism, turns):
    """Twists (1, sites, 6) that set the ball joints on leg 1's carriage level again on a rail turned by (3,) in rad."""
    result = np.zeros((1, len(mechanism.legs.sites), 6))
    result[0, mechanism.legs.site_numbers["leg 1 upright"], 3:] = -np.asarray(turns)
    return result


def test_a_leaning_rail_carries_its_slider_off_in_proportion_to_its_way():
    """With the carriage's ball joints set level again, rise and swing are those of the calibration's rails."""
    mechanism, motion = ROBOTS["level"][0], MOTIONS["level"]
    rise, swing = 2e-3, -1e-3
    change = SLIDER_EFFECTS["rail_tilt"].contribute(motion, np.array([0.0, rise, swing, *np.zeros(6)]))
    moved, turned = _exact(mechanism, motion, change + Contribution(_upright(mechanism, [0.0, -rise, swing])))
    rich = Ptt3(parameter_set="rails")
    expected = rich.forward(motion.drive, rich.parameters.vector({"rise1": rise, "swing1": swing}))
    np.testing.assert_allclose(moved, expected, atol=2e-4)
    assert np.abs(expected - motion.position_mm).max() > 0.02
    assert turned.max() < 1e-5
    # to first order the way b along the rail's direction d is off by w x b d
    at = mechanism.map_at(motion.drive, motion.position_mm)
    along = motion.drive[:, :1] * np.cross([0.0, -rise, swing], [1.0, 0.0, 0.0])
    shifted = np.einsum("naj,nj->na", at.response("leg 1 foot")[:, :, :3], along)
    np.testing.assert_allclose(moved - motion.position_mm, shifted, atol=2e-4)
    # left as they stand, the joints turn the platform with the rail
    assert _exact(mechanism, motion, change)[1].min() > 5e-4


def test_a_screw_leads_and_lags_once_per_turn():
    motion = MOTIONS["level"]
    values = SLIDER_EFFECTS["transmission_error"].parameters.vector({"amplitude2": 0.05, "phase2": 0.3, "lead": 7.0})
    change = SLIDER_EFFECTS["transmission_error"].contribute(motion, values).twists
    change = ROBOTS["level"][0].drive_errors(change)
    turns = motion.drive[:, 1] / 7.0
    np.testing.assert_allclose(change[:, 1], 0.05 * np.sin(2.0 * np.pi * (turns - np.floor(turns)) + 0.3), atol=1e-12)
    assert not change[:, [0, 2]].any()


def test_an_upright_rail_leans_to_the_side_where_a_level_one_swings():
    mechanism, motion = ROBOTS["upright"][0], MOTIONS["upright"]
    change = SLIDER_EFFECTS["rail_tilt"].contribute(motion, np.array([1e-3, *np.zeros(8)]))
    moved, turned = _exact(mechanism, motion, change + Contribution(_upright(mechanism, [1e-3, 0.0, 0.0])))
    rich = Ptt3(rail_inclination_rad=np.pi / 2, parameter_set="rails")
    # lean turns about the outward axis: z goes to minus the tangent
    expected = rich.forward(motion.drive, rich.parameters.vector({"swing1": -1e-3}))
    np.testing.assert_allclose(moved, expected, atol=1e-8)
    assert np.abs(expected - motion.position_mm).max() > 0.02 and turned.max() < 1e-12
    # left as they stand, the joints turn the platform with the rail
    assert _exact(mechanism, motion, change)[1].min() > 2e-4


@pytest.mark.parametrize("robot", SLIDERS)
def test_unequal_bars_tilt_a_3_ptt_as_six_bars_do(robot):
    mechanism, motion = ROBOTS[robot][0], MOTIONS[robot]
    mismatch = np.array([0.3, -0.2, 0.1])
    change = library(mechanism)["bar_mismatch"].contribute(motion, mismatch)
    position, turned = _exact(mechanism, motion, change)
    lengths = mechanism.L_mm + np.stack([0.5 * mismatch, -0.5 * mismatch], axis=1)
    still, inclination = np.zeros((3, 6)), mechanism.rail_inclination_rad
    for k in range(0, len(motion), 15):
        there = tripods_slow.ptt3_bars(motion.drive[k], still, inclination, lengths, motion.position_mm[k])
        np.testing.assert_allclose(position[k], there[0], atol=1e-8)
        assert turned[k] == pytest.approx(np.linalg.norm(there[1]), abs=1e-9)
    # the largest difference over the bars' distance, about
    assert 0.5 < np.median(turned) * mechanism.spacing_mm / 0.3 < 2.0
    # what the bars share turns nothing and is the link's own length
    shared, level = _exact(mechanism, motion, motion.along(mechanism.parts.members, mismatch[None]))
    rich = replace(mechanism, parameter_set="legs")
    expected = rich.forward(motion.drive, rich.parameters.vector({"dL1": 0.3, "dL2": -0.2, "dL3": 0.1}))
    np.testing.assert_allclose(shared, expected, atol=1e-9)
    assert level.max() < 1e-12


def test_unequal_bars_are_the_delta_of_six_bars():
    mechanism, motion = ROBOTS["delta"][0], MOTIONS["delta"]
    mismatch = np.array([0.3, -0.2, 0.1])
    change = library(mechanism)["bar_mismatch"].contribute(motion, mismatch)
    position, turned = _exact(mechanism, motion, change)
    lengths = 900.0 + np.stack([0.5 * mismatch, -0.5 * mismatch], axis=1)
    beta, depth = np.array([-np.pi / 6.0, np.pi / 2.0, 7.0 * np.pi / 6.0]), mechanism.origin_depth_mm
    for k in range(0, len(motion), 15):
        there = tripods_slow.delta_bars(motion.drive[k], beta, lengths, motion.position_mm[k], depth=depth)
        np.testing.assert_allclose(position[k], there[0], atol=1e-8)
        assert turned[k] == pytest.approx(np.linalg.norm(there[1]), abs=1e-10)
    # the largest difference over the bars' distance, about
    assert 0.5 < np.median(turned) * 120.0 / 0.3 < 2.0
    # what the bars share turns nothing and is the link's own length
    shared, level = _exact(mechanism, motion, motion.along(mechanism.parts.members, np.array([[0.3, -0.2, 0.1]])))
    rich = Delta(parameter_set="legs")
    expected = rich.forward(motion.drive, rich.parameters.vector({"dl2_1": 0.3, "dl2_2": -0.2, "dl2_3": 0.1}))
    np.testing.assert_allclose(shared, expected, atol=1e-9)
    assert level.max() < 1e-12
