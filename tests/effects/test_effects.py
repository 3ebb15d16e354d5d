"""Common properties of all effects of the library, and the models of the first three by themselves."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from rrru.effects.backlash import play
from rrru.effects.library import NAMES, active_effects
from rrru.effects.protocol import ActiveEffect, Contribution, Motion
from rrru.robots.rrru3 import Rrru3
from rrru.simulation.virtual_robot import VirtualRobot
from tests.effects.robots import (
    EFFECTS,
    FORWARD,
    LINE,
    LOADED,
    REVERSE,
    ROBOT,
    SLIDER_EFFECTS,
    SPIRAL,
    at_legs,
    plan_of,
)

_NAMES = (
    "backlash",
    "drive_compliance",
    "link_flexure",
    "joint_clearance",
    "leg_asymmetry",
    "axis_tilt",
    "base_placement",
    "frame_misregistration",
    "encoder_eccentricity",
    "transmission_error",
    "thermal_growth",
    "servo_lag",
    "joint_axis_error",
    "base_drift",
    "encoder_ovality",
    "friction_windup",
    "link_growth",
    "pedestal_compliance",
    "tracker_scale",
)
_PERIODS = {"encoder_eccentricity": 1.0, "encoder_ovality": 2.0, "transmission_error": 50.0}
_MOTION = VirtualRobot().motion(plan_of(FORWARD, REVERSE, LOADED, trajectories=(LINE, SPIRAL)), Rrru3().inverse)
_SITES = len(ROBOT.legs.sites)
_DRIVES = ("drive",)
# the places of every leg at which an effect acts, or the site that is no leg's
_ACTS_AT = {
    **dict.fromkeys(("backlash", "drive_compliance", "encoder_eccentricity"), _DRIVES),
    **dict.fromkeys(("transmission_error", "servo_lag", "friction_windup", "encoder_ovality"), _DRIVES),
    **dict.fromkeys(("link_flexure", "joint_clearance"), ("wrist",)),
    **dict.fromkeys(("axis_tilt", "base_placement"), ("foot",)),
    **dict.fromkeys(("leg_asymmetry", "link_growth"), ("elbow", "knee", "wrist")),
    "thermal_growth": ("foot", "elbow", "knee", "wrist", "platform"),
    **dict.fromkeys(("frame_misregistration", "tracker_scale", "base_drift", "pedestal_compliance"), "world"),
    "joint_axis_error": ("drive", "elbow", "knee", "wrist", "cross"),
}


def _flat(contribution):
    """All that an effect changes, in one row."""
    return np.broadcast_to(contribution.twists, (len(_MOTION), _SITES, 6)).ravel()


def _touched(contribution):
    """Names of the sites at which a contribution is not zero."""
    return {ROBOT.legs.sites[k] for k in np.flatnonzero(np.any(contribution.twists, axis=(0, 2)))}


def _under(effect, coordinates, shape=None):
    shape = effect.coordinates.shapes[0] if shape is None else shape
    return _flat(effect.contribute(_MOTION, effect.coordinates.to_values(coordinates, shape)))


def test_the_library_holds_the_robots_effects_in_their_order():
    assert tuple(EFFECTS) == _NAMES
    assert tuple(name for name in NAMES if name in EFFECTS) == _NAMES
    others = {"drive_error_function", "transmission_orders", "read_before_rest", "thermal_expansion", "zero_drift"}
    others |= {"gain_error"}
    assert set(NAMES) - set(EFFECTS) - set(SLIDER_EFFECTS) == {"tool_offset", "cross_compliance"} | others


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_says_what_it_is(name):
    effect = EFFECTS[name]
    assert effect.name == name
    assert (
        all(p.unit and p.source for p in effect.parameters)
        and np.isfinite([effect.parameters.low, effect.parameters.high]).all()
    )
    assert set(effect.needs) <= set(Motion.__dataclass_fields__)
    c = effect.coordinates
    assert len(c) == len(c.typical) == len(c.legs) == len(c.positive)
    assert (c.typical > 0.0).all() and np.isin(c.legs, (0, 1, 2, 3)).all() and len(c.shapes) >= 1


@pytest.mark.parametrize("name", EFFECTS)
def test_nominal_parameters_change_nothing(name):
    effect = EFFECTS[name]
    assert np.abs(_flat(effect.contribute(_MOTION, effect.parameters.nominal))).max() == 0.0


@pytest.mark.parametrize("name", EFFECTS)
def test_a_contribution_acts_at_its_sites_in_the_full_shape(name):
    effect = EFFECTS[name]
    result = effect.contribute(
        _MOTION, effect.coordinates.to_values(effect.coordinates.typical, effect.coordinates.shapes[0])
    )
    places = _ACTS_AT[name]
    legs = {f"leg {leg} {place}" for leg in (1, 2, 3) for place in places}
    assert _touched(result) == ({places} if isinstance(places, str) else legs)
    assert result.twists.shape in ((len(_MOTION), _SITES, 6), (1, _SITES, 6)) and np.isfinite(result.twists).all()


@pytest.mark.parametrize("name", EFFECTS)
def test_three_typical_sizes_lie_within_the_bounds(name):
    effect = EFFECTS[name]
    for shape in effect.coordinates.shapes:
        for sign in (1.0, -1.0):
            coordinates = np.where(effect.coordinates.positive, 1.0, sign) * 3.0 * effect.coordinates.typical
            assert effect.parameters.contains(effect.coordinates.to_values(coordinates, shape))


@pytest.mark.parametrize("name", EFFECTS)
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), factor=st.floats(0.1, 2.0))
def test_contributions_are_linear_in_the_coordinates(name, seed, factor):
    """Exactly for most; the second orders of foot and lag, and of the backlash at turn-backs, are small."""
    effect = EFFECTS[name]
    generator = np.random.default_rng(seed)
    typical = effect.coordinates.typical
    one, other = generator.uniform(0.0, 1.0, (2, len(typical))) * typical
    for shape in effect.coordinates.shapes:
        together = _under(effect, one + factor * other, shape)
        parts = _under(effect, one, shape) + factor * _under(effect, other, shape)
        size = np.abs(parts).max()
        if name == "backlash":
            assert np.mean(np.abs(together - parts) > 1e-9 * size) < 0.05
        else:
            loose = {"base_placement": 2e-2, "servo_lag": 1e-2}.get(name, 1e-12)
            assert np.abs(together - parts).max() <= loose * size


@pytest.mark.parametrize("name", EFFECTS)
def test_each_coordinate_does_something_of_its_own(name):
    effect = EFFECTS[name]
    columns = np.array([_under(effect, unit * effect.coordinates.typical) for unit in np.eye(len(effect.coordinates))])
    columns = columns / np.linalg.norm(columns, axis=1, keepdims=True)
    assert np.linalg.svd(columns, compute_uv=False)[-1] > 1e-3


@pytest.mark.parametrize("name", EFFECTS)
def test_a_legs_coordinate_leaves_the_other_legs_alone(name):
    effect = EFFECTS[name]
    for k, leg in enumerate(effect.coordinates.legs):
        values = effect.coordinates.to_values(
            np.eye(len(effect.coordinates))[k] * effect.coordinates.typical, effect.coordinates.shapes[0]
        )
        result = effect.contribute(_MOTION, values)
        touched = _touched(result)
        assert touched and all(not leg or site.startswith(f"leg {leg} ") for site in touched)


@settings(max_examples=50)
@given(st.lists(st.floats(-0.007, 0.007), min_size=6, max_size=6))
def test_sine_and_cosine_parts_give_back_amplitude_and_phase(parts):
    for name, periods in _PERIODS.items():
        effect = EFFECTS[name]
        values = effect.coordinates.to_values(np.array(parts), effect.coordinates.shapes[0])
        assert effect.parameters.contains(values)
        sine, cosine = np.reshape(parts, (3, 2)).T
        angle = periods * _MOTION.drive
        expected = sine * np.sin(angle) + cosine * np.cos(angle)
        changes = ROBOT.drive_errors(effect.contribute(_MOTION, values).twists)
        np.testing.assert_allclose(changes, expected, atol=1e-15)


@pytest.mark.parametrize(
    "name",
    [
        *("backlash", "joint_clearance", "transmission_error", "thermal_growth", "servo_lag", "base_placement"),
        *("friction_windup", "encoder_ovality", "tracker_scale"),
    ],
)
def test_parameters_are_recovered_from_what_they_do(name):
    effect = EFFECTS[name]
    generator = np.random.default_rng(8)
    shape = effect.coordinates.shapes[0]
    truth = effect.coordinates.to_values(
        generator.uniform(0.5, 2.0, len(effect.coordinates)) * effect.coordinates.typical, shape
    )
    seen = _flat(effect.contribute(_MOTION, truth))
    # a design number and, of a hard contact, how soft it is, are not fitted
    free = [k for k, n in enumerate(effect.parameters.names) if n not in ("ratio", "transition", "held")]

    def residual(values):
        full = truth.copy()
        full[free] = values
        return (_flat(effect.contribute(_MOTION, full)) - seen) / np.abs(seen).max()

    options = {"x_scale": np.abs(truth[free]), "xtol": 1e-14, "ftol": 1e-14, "gtol": 1e-14}
    fit = least_squares(residual, truth[free] * 1.2, **options)
    np.testing.assert_allclose(fit.x, truth[free], rtol=1e-5, atol=1e-9)


def test_contributions_add_up_place_by_place():
    parts = [
        ActiveEffect(e, e.parameters.mapping(e.coordinates.to_values(e.coordinates.typical, {})))
        for e in EFFECTS.values()
    ]
    total = sum((part.contribute(_MOTION) for part in parts), Contribution())
    np.testing.assert_allclose(_flat(total), sum(_flat(part.contribute(_MOTION)) for part in parts), atol=1e-15)


def test_active_effects_keep_their_order_and_nominal_values():
    first, second = active_effects({"servo_lag": {"lag2": 0.01}, "backlash": {}}, ROBOT)
    assert (first.effect.name, second.effect.name) == ("servo_lag", "backlash")
    assert _touched(first.contribute(_MOTION)) == {"leg 2 drive"}
    assert not np.any(second.contribute(_MOTION).twists)


def test_play_equals_its_definition_step_by_step():
    path = np.cumsum(np.random.default_rng(0).normal(size=(300, 2)), axis=0)
    half = np.array([0.7, 0.0])
    y = path[0].copy()
    for u, change in zip(path, play(path, half), strict=True):
        y = np.where(y < u - half, u - half, np.where(y > u + half, u + half, y))
        np.testing.assert_allclose(change, y - u, atol=1e-15)


@settings(max_examples=50)
@given(st.lists(st.floats(-10.0, 10.0), min_size=2, max_size=30), st.floats(0.0, 5.0))
def test_play_stays_within_its_width_and_forgets_the_sampling(path, half):
    """However slowly the path is driven, the arm ends at the same place, at most half the backlash off."""
    path = np.array(path)[:, None]
    change = play(path, np.array([half]))
    assert np.abs(change).max() <= half + 1e-12
    fine = np.interp(np.arange(0.0, len(path) - 0.999, 0.25), np.arange(len(path)), path[:, 0])[:, None]
    assert play(fine, np.array([half]))[-1, 0] == pytest.approx(change[-1, 0], abs=1e-9)


def test_play_remembers_the_path_and_ignores_the_speed():
    """A small turn-back inside the backlash does not move the arm; the same path at half the sampling gives the same
    end.
    """
    path = np.array([0.0, 5.0, 4.5, 4.8])[:, None]
    arm = path + play(path, np.array([1.0]))
    assert arm[1:, 0].tolist() == [4.0, 4.0, 4.0]
    fine = np.interp(np.arange(0, 3.01, 0.1), np.arange(4), path[:, 0])[:, None]
    assert (fine + play(fine, np.array([1.0])))[-1, 0] == pytest.approx(4.0)


def test_clearance_flips_with_the_force_and_has_its_size():
    """Along the forearm, against the force with which it pushes."""
    shift = _clearance(0.0)
    np.testing.assert_allclose(np.abs(shift), np.tile([0.3, 0.5, 0.1], (len(_MOTION), 1)))
    assert (shift * _MOTION.force_n < 0.0).all() and (_MOTION.force_n > 0.0).any() and (_MOTION.force_n < 0.0).any()


def _clearance(transition):
    """Shifts (n, 3) of the wrists along the forearms under a contact of some softness."""
    change = EFFECTS["joint_clearance"].contribute(_MOTION, np.array([0.3, 0.5, 0.1, transition, 0.0]))
    assert not any(at_legs(change, "wrist", component).any() for component in range(1, 6))
    return at_legs(change, "wrist", 0)


def test_a_soft_clearance_changes_sides_within_its_transition():
    """Half a transition from zero force tanh(1/2) of the clearance is left, far from it all."""
    np.testing.assert_allclose(_clearance(4.0) / _clearance(0.0), np.tanh(np.abs(_MOTION.force_n) / 4.0))


def test_flexure_follows_the_force_of_a_held_joint_to_the_share_asked_for():
    held, half = (
        at_legs(EFFECTS["link_flexure"].contribute(_MOTION, np.array([1.0, 1.0, 1.0, share])), "wrist", 0)
        for share in (1.0, 0.5)
    )
    np.testing.assert_allclose(held, -_MOTION.held_force_n)
    np.testing.assert_allclose(half, -0.5 * (_MOTION.held_force_n + _MOTION.force_n))


@pytest.mark.parametrize(("name", "periods"), _PERIODS.items())
def test_periodic_errors_repeat_after_their_period(name, periods):
    effect = EFFECTS[name]
    values = effect.coordinates.to_values(np.linspace(-3e-4, 3e-4, 6), effect.coordinates.shapes[0])
    later = Motion(**{**_MOTION.__dict__, "drive": _MOTION.drive + 2.0 * np.pi / periods})
    before, after = (ROBOT.drive_errors(effect.contribute(motion, values).twists) for motion in (_MOTION, later))
    np.testing.assert_allclose(after, before, atol=1e-15)
    assert np.abs(before).max() > 1e-4
