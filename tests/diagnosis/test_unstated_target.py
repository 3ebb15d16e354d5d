"""A reflector whose place nobody states on a platform that turns by the robot's errors alone."""

import pytest

import rrru
from tests.diagnosis import linear_delta


@pytest.mark.parametrize("seed", [1, 2])
def test_nothing_is_named_for_a_reflector_next_to_the_tool(tmp_path, seed):
    """It was taken to be at the tool; link flexure had 0.94 and 0.63."""
    robot = rrru.load_robot(str(linear_delta.robot_file(tmp_path)), platform="plate")
    campaign = rrru.read_campaign(
        linear_delta.file_of(seed), robot, noise_mm=linear_delta.NOISE_MM, frame="register", motion="stop_and_go"
    )
    assert any("state it in `targets`" in note for note in campaign.notes)
    # of three axes, 26 parameters of 360 numbers fitted
    expected_mm = linear_delta.NOISE_MM * (3.0 * (1.0 - 26.0 / 360.0)) ** 0.5
    assert rrru.calibrate(campaign).rms_mm == pytest.approx(expected_mm, rel=0.08)
    found = rrru.diagnose(campaign)
    assert found.verdict["effects"] == [] and found.verdict["probability"] > 0.5
