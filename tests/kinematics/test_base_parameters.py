"""Which parameters of a campaign are chosen as the identifiable ones, where several choices are possible."""

from dataclasses import replace

import numpy as np
import pytest

from rrru.calibration.calibrate import calibrate
from rrru.estimation.observations.target_positions import TargetPositions
from rrru.kinematics.base_parameters import choose
from tests.diagnosis import arms


def test_a_column_that_is_almost_a_combination_of_others_is_left_out_for_one_that_is_not():
    columns = np.array([[40.0, 0.6], [1.0, 0.0], [0.0, 1.0]]).T
    chosen, combined = choose(columns, [True] * 3, 1e-2)
    assert chosen == [0, 2] and [*combined] == [1]
    np.testing.assert_allclose(columns[:, chosen] @ combined[1], columns[:, 1], atol=1e-12)


def test_a_column_that_is_almost_a_combination_is_chosen_where_no_other_has_what_it_adds():
    columns = np.array([[40.0, 0.6], [1.0, 0.0]]).T
    assert choose(columns, [True] * 2, 1e-2)[0] == [0, 1]
    assert choose(columns, [True] * 2, 0.1)[0] == [0]


def test_a_tool_off_along_the_line_to_the_last_axis_is_no_large_zero_offset():
    """The last drive moves the tool along x by its distance along y from the axis, and along y by almost nothing."""
    tool_mm, off_mm = (1.0, 60.0, 90.0), 0.5
    arm = replace(arms.ARM, tool_mm=tool_mm, parameter_set="full")
    drive = arms.drives(80, np.random.default_rng(2))
    built = replace(arm, tool_mm=(tool_mm[0], tool_mm[1] + off_mm, tool_mm[2]))
    robot = arm.with_identifiable_parameters(drive, arm.forward(drive))
    found = calibrate(TargetPositions(robot, drive, built.forward(drive), arm.forward(drive)))
    assert found.rms_mm < 1e-6
    assert robot.parameters.mapping(found.deviations)["dq6"] == pytest.approx(0.0, abs=0.1 * off_mm / tool_mm[1])
