"""The first effects: their physical signatures, and their parameters recovered."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from rrru.campaign.plan import make_plan
from rrru.campaign.trajectories import Line
from rrru.effects.backlash import play
from rrru.effects.registry import EFFECTS
from rrru.mechanisms.rrru3 import Rrru3
from rrru.plant.virtual_robot import VirtualRobot

_VALUES = {
    "backlash": {"width1": 0.002, "width2": 0.001, "width3": 0.003},
    "joint_clearance": {"clearance1": 0.3, "clearance2": 0.5, "clearance3": 0.1},
    "transmission_error": {
        "amplitude1": 1e-3,
        "amplitude2": 2e-3,
        "amplitude3": 5e-4,
        "phase1": 0.3,
        "phase2": -1.0,
        "phase3": 2.0,
        "ratio": 50.0,
    },
}


@pytest.fixture(scope="module")
def motion():
    lines = (Line("there", (-500.0, -100.0, 600.0), (400.0, 150.0, 700.0), 60),)
    plan = make_plan(lines, ({"reverse": False, "payload_kg": 0.0}, {"reverse": True, "payload_kg": 0.0}), 80.0, 40.0, 0.0)
    return VirtualRobot().motion(plan, Rrru3().inverse)


def _flat(contribution, n):
    drive = np.broadcast_to(contribution.drive_rad, (n, 3))
    joint = np.broadcast_to(contribution.joint_mm, (n, 3, 3))
    return np.concatenate([drive.ravel(), joint.ravel()])


@pytest.mark.parametrize("name", EFFECTS)
def test_nominal_parameters_change_nothing(name, motion):
    effect = EFFECTS[name]
    assert np.abs(_flat(effect.contribute(motion, effect.parameters.nominal), len(motion))).max() == 0.0


@pytest.mark.parametrize("name", EFFECTS)
def test_parameters_are_recovered_from_what_they_do(name, motion):
    effect = EFFECTS[name]
    truth = effect.parameters.vector(_VALUES[name])
    seen = _flat(effect.contribute(motion, truth), len(motion))
    # the ratio is a design number, not fitted
    free = [k for k, n in enumerate(effect.parameters.names) if n != "ratio"]

    def residual(values):
        full = truth.copy()
        full[free] = values
        return (_flat(effect.contribute(motion, full), len(motion)) - seen) * 1e3

    fit = least_squares(
        residual, truth[free] * 1.2 + 1e-4, x_scale=np.maximum(np.abs(truth[free]), 1e-4), xtol=1e-14, ftol=1e-14, gtol=1e-14
    )
    np.testing.assert_allclose(fit.x, truth[free], rtol=1e-5, atol=1e-9)


def test_play_equals_its_definition_step_by_step():
    path = np.cumsum(np.random.default_rng(0).normal(size=(300, 2)), axis=0)
    half = np.array([0.7, 0.0])
    y = path[0].copy()
    for u, change in zip(path, play(path, half), strict=True):
        y = np.where(y < u - half, u - half, np.where(y > u + half, u + half, y))
        np.testing.assert_allclose(change, y - u, atol=1e-15)


def test_play_remembers_the_path_and_ignores_the_speed():
    """A small turn-back inside the play does not move the arm; the same path at half the sampling gives the same end."""
    path = np.array([0.0, 5.0, 4.5, 4.8])[:, None]
    arm = path + play(path, np.array([1.0]))
    assert arm[1:, 0].tolist() == [4.0, 4.0, 4.0]
    fine = np.interp(np.arange(0, 3.01, 0.1), np.arange(4), path[:, 0])[:, None]
    assert (fine + play(fine, np.array([1.0])))[-1, 0] == pytest.approx(4.0)


def test_backlash_lags_behind_the_direction_of_motion(motion):
    """Where a drive has moved on by more than its play, the arm stands half the play behind it, on whichever way it came."""
    drive = EFFECTS["backlash"].contribute(motion, np.full(3, 0.002)).drive_rad
    moved = np.diff(motion.theta_rad, axis=0)
    # the turn-back between two points is not seen in their difference; points next to one are left out
    steady = (np.abs(moved[1:]) > 0.002) & (np.sign(moved[1:]) == np.sign(moved[:-1]))
    assert steady.sum() > 200
    np.testing.assert_allclose(drive[2:][steady], -0.001 * np.sign(moved[1:])[steady], atol=1e-12)
    there, back = drive[20:50], drive[60:][::-1][20:50]
    assert np.median(np.abs(there - back)) == pytest.approx(0.002)


def test_clearance_flips_with_the_force_and_has_its_size(motion):
    effect = EFFECTS["joint_clearance"]
    shift = effect.contribute(motion, np.array([0.3, 0.5, 0.1])).joint_mm
    np.testing.assert_allclose(np.linalg.norm(shift, axis=-1), np.tile([0.3, 0.5, 0.1], (len(motion), 1)))
    assert (np.einsum("nla,nla->nl", shift, motion.force_direction) * motion.force_n < 0.0).all()


def test_transmission_error_repeats_once_per_tooth_pitch(motion):
    effect = EFFECTS["transmission_error"]
    values = effect.parameters.vector(_VALUES["transmission_error"])
    shifted = motion.__class__(**{**motion.__dict__, "theta_rad": motion.theta_rad + 2.0 * np.pi / 50.0})
    np.testing.assert_allclose(effect.contribute(shifted, values).drive_rad, effect.contribute(motion, values).drive_rad, atol=1e-14)
