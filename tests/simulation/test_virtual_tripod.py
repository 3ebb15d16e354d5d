"""The virtual 3-PTT and Delta against their closures with errors."""

import numpy as np
import pytest

from rrru.campaign.plan import make_plan
from rrru.campaign.trajectories import Spiral
from rrru.effects.library import active_effects
from rrru.errors import ConfigError
from rrru.robots.delta import Delta
from rrru.robots.ptt3 import Ptt3
from rrru.simulation import virtual_robot
from rrru.simulation.virtual_robot import VirtualRobot

ERRORS = {
    "ptt3": (Ptt3(), -250.0, {"db1": 0.3, "dL2": -0.4, "rise3": 1e-3, "swing1": -2e-3}),
    "delta": (Delta(), 0.0, {"dtheta1": 2e-3, "dl1_2": 0.2, "dl2_3": -0.3, "da_1": 0.4}),
}

_SECTION = {"errors": {}, "effects": {}, "platform_mass_kg": 3.0, "forearm_mass_kg": 1.2, "arm_mass_kg": 2.0}


def _plan(height, passes=({"payload_kg": 0.0, "reverse": False},)):
    return make_plan(
        [Spiral("curve", (0.0, 0.0), (80.0, 80.0), (height - 20.0, height + 20.0), 1.0, 45)], passes, 80.0, 400.0, 5.0
    )


@pytest.mark.parametrize("name", ERRORS)
def test_a_robot_with_errors_stands_where_the_three_links_are_as_long_as_they_are(name):
    mechanism, height, deviations = ERRORS[name]
    measurements, truth = VirtualRobot(mechanism, deviations).run(_plan(height), 0.0, np.random.default_rng(0))
    columns = [f"slider{k}_mm" if name == "ptt3" else f"theta{k}_rad" for k in (1, 2, 3)]
    actuators = measurements[columns].to_numpy()
    position = truth[[f"true_{axis}_mm" for axis in "xyz"]].to_numpy()
    np.testing.assert_allclose(
        actuators, mechanism.inverse(measurements[[f"command_{axis}_mm" for axis in "xyz"]].to_numpy())
    )
    legs = mechanism.nominal_legs + mechanism.leg_changes(deviations)
    lengths = np.linalg.norm(position[:, None] - mechanism.ends(actuators, legs), axis=-1)
    np.testing.assert_allclose(lengths, np.broadcast_to(legs[:, mechanism.LINK], lengths.shape), atol=1e-9)
    assert truth["platform_rotation_rad"].max() < 1e-11
    assert 0.1 < np.abs(position - measurements[[f"command_{axis}_mm" for axis in "xyz"]].to_numpy()).max() < 3.0


def test_an_unknown_error_is_refused():
    with pytest.raises(ConfigError, match="unknown error 'dL9'; known: db1"):
        virtual_robot.from_config(Ptt3(), _SECTION | {"errors": {"dL9": 1.0}})


@pytest.mark.parametrize("name", ERRORS)
def test_crooked_axes_turn_the_platform(name):
    """Drawn at every joint that moves, and at no other site; the platform turns by about as much."""
    mechanism, height, deviations = ERRORS[name]
    crooked = virtual_robot.from_config(
        mechanism,
        _SECTION | {"errors": deviations, "axis_errors": {"position_mm": 0.1, "angle_rad": 1e-3, "seed": 3}},
    )
    sites = {mechanism.legs.sites[k] for k in np.flatnonzero(crooked.axis_deviations.any(axis=1))}
    assert sites == {joint.name for joint in mechanism.legs.joints if joint.kind != "fixed"} == set(mechanism.seats)
    measurements, truth = crooked.run(_plan(height), 0.0, np.random.default_rng(0))
    assert (measurements["status"] == "ok").all()
    assert 1e-4 < truth["platform_rotation_rad"].median() < 1e-2
    straight = VirtualRobot(mechanism, deviations).run(_plan(height), 0.0, np.random.default_rng(0))[1]
    columns = [f"true_{axis}_mm" for axis in "xyz"]
    assert 0.05 < np.abs(truth[columns].to_numpy() - straight[columns].to_numpy()).max() < 5.0


def test_play_holds_a_slider_back_by_half_of_it_in_the_sense_of_its_motion():
    robot = VirtualRobot(Ptt3(), effects=active_effects({"backlash": {"width2": 0.08}}, Ptt3()))
    measurements, truth = robot.run(
        _plan(-250.0, ({"payload_kg": 0.0, "reverse": False},) * 2), 0.0, np.random.default_rng(0)
    )
    true = truth[[f"true_{axis}_mm" for axis in "xyz"]].to_numpy()
    slider = measurements[[f"slider{k}_mm" for k in (1, 2, 3)]].to_numpy()
    lag = Ptt3().inverse(true) - slider
    np.testing.assert_allclose(lag[:, [0, 2]], 0.0, atol=1e-9)
    second = measurements["run"].to_numpy() == 2
    sense = np.sign(np.gradient(slider[second, 1]))
    # how the slider came to a run's first point is the transfer's business
    inside = (np.abs(np.gradient(slider[second, 1])) > 0.5) & (np.arange(second.sum()) > 0)
    np.testing.assert_allclose(lag[second, 1][inside], -0.04 * sense[inside], atol=1e-9)


def test_a_controller_sees_the_whole_path_in_order():
    """One that adds a jump at every reversal changes the slider values that are sent, and nothing else."""
    mechanism, seen = Ptt3(), []

    def controller(path):
        seen.append(path)
        return mechanism.inverse(path) + 0.01

    measurements, _ = VirtualRobot(mechanism).run(_plan(-250.0), 0.0, np.random.default_rng(0), controller)
    assert len(seen) == 1 and len(seen[0]) == 44 * 16 + 1
    command = measurements[[f"command_{axis}_mm" for axis in "xyz"]].to_numpy()
    np.testing.assert_allclose(measurements["slider1_mm"], mechanism.inverse(command)[:, 0] + 0.01)
