"""Effects at the drive angle, seen through the virtual robot's full loop closure."""

import numpy as np
import pytest

from rrru.campaign.plan import make_run
from rrru.campaign.speed_profile import Trapezoid
from rrru.campaign.trajectories import sample
from rrru.effects.backlash import play
from tests.effects.robots import FORWARD, LINE, LOADED, REVERSE, ROBOT, SPIRAL, drive, drive_error, per_leg, plan_of


def _steady(motion, margin_rad):
    """Flags (n, 3): drives that have moved by more than the margin since they last turned, within the last points'
    steps.
    """
    moved = np.diff(motion.drive, axis=0)
    result = np.zeros(motion.drive.shape, dtype=bool)
    result[2:] = (np.abs(moved[1:]) > margin_rad) & (np.sign(moved[1:]) == np.sign(moved[:-1]))
    return result


def test_backlash_parts_forward_and_reverse_by_its_width():
    widths = np.array([0.002, 0.001, 0.003])
    plan = plan_of(FORWARD, REVERSE)
    motion, position, _ = drive({"backlash": per_leg("width", widths)}, plan)
    error = drive_error(motion, position)
    half = len(motion) // 2
    there, back = error[:half], error[half:][::-1]
    steady = _steady(motion, 0.004)
    both = steady[:half] & steady[half:][::-1]
    assert both.sum() > 60
    gap = np.where(both, np.abs(there - back), np.nan)
    np.testing.assert_allclose(gap[both], np.broadcast_to(widths, gap.shape)[both], rtol=1e-6)
    # half the backlash behind the direction of motion
    direction = np.sign(np.diff(motion.drive, axis=0, prepend=np.nan))
    np.testing.assert_allclose(error[steady], (-0.5 * widths * direction)[steady], rtol=1e-6)


def test_backlash_moves_the_platform_through_the_jacobian():
    """Reverse minus forward at one commanded point is J times the widths, with the drives' directions."""
    plan = plan_of(FORWARD, REVERSE)
    motion, position, _ = drive({"backlash": per_leg("width", 5e-4)}, plan)
    half = len(motion) // 2
    theta = motion.drive[:half]
    steady = _steady(motion, 0.002)
    both = (steady[:half] & steady[half:][::-1]).all(axis=1)
    direction = np.sign(np.diff(theta, axis=0, prepend=np.nan))
    expected = np.einsum("nak,nk->na", ROBOT.actuator_jacobian(plan.targets()[:half], theta), 5e-4 * direction)
    seen = position[half:][::-1] - position[:half]
    assert both.sum() > 20
    np.testing.assert_allclose(seen[both], expected[both], rtol=1e-3, atol=1e-4)


def test_backlash_repeats_with_the_path():
    """Two rounds there and back: the second equals the first, except where the backlash was not yet crossed."""
    _, position, _ = drive({"backlash": per_leg("width", 0.002)}, plan_of(FORWARD, REVERSE, FORWARD, REVERSE))
    first, second, third, fourth = np.split(position, 4)
    np.testing.assert_allclose(second, fourth, atol=1e-12)
    np.testing.assert_allclose(first[5:], third[5:], atol=1e-12)


def test_play_passes_over_unknown_angles():
    path = np.array([np.nan, 0.0, 5.0, np.nan, 4.5, 4.8])[:, None]
    arm = (path + play(path, np.array([1.0])))[:, 0]
    assert np.isnan(arm[[0, 3]]).all() and arm[[1, 2, 4, 5]].tolist() == [0.0, 4.0, 4.0, 4.0]


def test_drive_compliance_lets_the_platform_sink_in_proportion_to_the_payload():
    plan = plan_of(FORWARD, LOADED, LOADED | {"payload_kg": 10.0})
    motion, position, _ = drive({"drive_compliance": per_leg("compliance", 1e-8)}, plan)
    empty, five, ten = np.split(position - plan.targets(), 3)
    assert (empty[:, 2] > 0.0).all() and (five[:, 2] > empty[:, 2]).all()
    np.testing.assert_allclose(ten - empty, 2.0 * (five - empty), rtol=0.02, atol=1e-4)
    np.testing.assert_allclose(drive_error(motion, position), 1e-8 * motion.drive_load, rtol=1e-6, atol=1e-12)


def test_drive_compliance_acts_on_the_leg_that_has_it():
    motion, position, _ = drive({"drive_compliance": {"compliance2": 2e-8}}, plan_of(LOADED))
    error = drive_error(motion, position)
    assert np.abs(error[:, [0, 2]]).max() < 1e-10 and np.abs(error[:, 1]).min() > 1e-5


@pytest.mark.parametrize(
    ("name", "periods", "shape"), [("encoder_eccentricity", 1.0, {}), ("transmission_error", 50.0, {"ratio": 50.0})]
)
def test_periodic_errors_follow_the_drive_angle_alone(name, periods, shape):
    """A sine in the drive angle, the same whatever trajectory, direction and payload."""
    amplitude, phase = np.array([1e-3, 5e-4, 2e-4]), np.array([0.3, -1.0, 2.0])
    plan = plan_of(FORWARD, REVERSE, LOADED, trajectories=(LINE, SPIRAL))
    motion, position, _ = drive({name: per_leg("amplitude", amplitude) | per_leg("phase", phase) | shape}, plan)
    error = drive_error(motion, position)
    np.testing.assert_allclose(error, amplitude * np.sin(periods * motion.drive + phase), atol=1e-10)
    for leg in range(3):
        waves = np.stack([np.sin(periods * motion.drive[:, leg]), np.cos(periods * motion.drive[:, leg])], axis=1)
        part = np.linalg.lstsq(waves, error[:, leg], rcond=None)[0]
        assert np.hypot(*part) == pytest.approx(amplitude[leg], rel=1e-6)
        assert np.arctan2(part[1], part[0]) == pytest.approx(phase[leg], abs=1e-6)


def test_servo_lag_shows_where_the_command_was_a_moment_ago():
    delays = np.array([0.003, 0.006, 0.001])
    motion, position, _ = drive({"servo_lag": per_leg("lag", delays)}, plan_of(FORWARD))
    length = np.linalg.norm(np.subtract(LINE.end_mm, LINE.start_mm))
    profile = Trapezoid(length, 80.0, 40.0)
    direction = np.subtract(LINE.end_mm, LINE.start_mm) / length

    def passed(time):
        """Distance at a time: the profile's, found by bisection on its own inverse."""
        low, high = np.zeros_like(time), np.full_like(time, length)
        for _ in range(60):
            middle = 0.5 * (low + high)
            before = profile.time(middle) < time
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        return 0.5 * (low + high)

    for leg, delay in enumerate(delays):
        late = np.add(LINE.start_mm, passed(np.maximum(motion.time_s - delay, 0.0))[:, None] * direction)
        expected = ROBOT.inverse(late)[:, leg] - motion.drive[:, leg]
        np.testing.assert_allclose(drive_error(motion, position)[1:, leg], expected[1:], atol=5e-8)


def test_servo_lag_is_nothing_at_rest_grows_with_speed_and_turns_with_the_direction():
    plan = plan_of(FORWARD, REVERSE, FORWARD | {"speed_mm_s": 40.0})
    motion, position, _ = drive({"servo_lag": per_leg("lag", 0.003)}, plan)
    there, back, slow = np.split(drive_error(motion, position), 3)
    size = np.abs(there).max()
    assert size > 3e-4
    # at both ends the robot stands
    assert np.abs(there[[0, -1]]).max() < 0.01 * size
    cruise = slice(12, -12)
    np.testing.assert_allclose(back[::-1][cruise], -there[cruise], rtol=0.01, atol=0.01 * size)
    np.testing.assert_allclose(slow[cruise], 0.5 * there[cruise], rtol=0.01, atol=0.01 * size)


def test_runs_start_where_their_trajectory_does():
    """The reversed run's points, which the tests above turn round, are the forward run's."""
    np.testing.assert_array_equal(make_run(LINE, 80.0, 40.0, reverse=True).points_mm[::-1], sample(LINE))
