"""Sections of the configuration as commands of `rrru`."""

import pytest

from rrru.pipeline.option_text import as_command

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
