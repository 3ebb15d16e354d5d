"""Sections of the configuration as commands of `rrru`."""

import pytest

from rrru.pipeline.option_text import as_command, options_in

_SECTION = {"robot": "mine", "ingest": "my file.csv", "frame": "register"}


def test_a_command_has_the_file_of_a_robot_and_its_keys():
    entry = {"urdf": "arm.urdf", "tip": "flange", "tool_mm": [0.0, 0.0, 50.0]}
    expected = "rrru diagnose 'my file.csv' --robot arm.urdf --tip flange --tool 0,0,50 --frame register"
    assert as_command(_SECTION, entry) == expected


@pytest.mark.parametrize(
    "entry", [{"dh": [{"a_mm": 300.0}]}, {"module": "my:make"}, {"urdf": "arm.urdf", "errors": "zero"}]
)
def test_a_robot_that_the_options_do_not_describe_has_no_command(entry):
    assert as_command(_SECTION, entry) == ""


def test_a_frame_that_is_described_is_no_option():
    """--frame columns, which the command refuses, was said of "a right-handed frame: columns: {..}"."""
    exchanged = "{measured_x_mm: measured_y_mm, measured_y_mm: measured_x_mm}"
    message = f"allowed: a right-handed frame: columns: {exchanged}, which leaves 0.877 mm rms"
    assert options_in(message) == [f"--set 'columns={exchanged}'"]
