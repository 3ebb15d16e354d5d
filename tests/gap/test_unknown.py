"""The smooth functions that compete with the library."""

import numpy as np
import pytest

from rrru.gap.case import make_case
from rrru.gap.unknown import UNKNOWN
from tests.gap.campaigns import MASSES, NOISE_MM, SIM, case_of, diagnosed, measure


@pytest.fixture(scope="module")
def case():
    return case_of(measure())


@pytest.mark.parametrize("name", UNKNOWN)
def test_a_function_is_linear_in_its_coefficients_and_about_as_large_as_they_are(case, name):
    function, generator = UNKNOWN[name], np.random.default_rng(4)
    first, second = (generator.standard_normal(len(function.coordinates)) for _ in range(2))

    def made(values):
        result = function.contribute(case.motion, values)
        return result.drive if function.per_leg else result.joint_mm

    np.testing.assert_allclose(made(2.0 * first - second), 2.0 * made(first) - made(second), atol=1e-12)
    for k in range(len(first)):
        one = np.abs(made(np.eye(len(first))[k]))
        assert 0.5 <= one.max() <= 1.0 + 1e-12


def test_a_shift_of_all_three_joints_moves_the_platform_by_it(case):
    function = UNKNOWN["unknown_affine"]
    values = np.zeros((3, 4))
    values[:, 0] = [0.1, -0.2, 0.3]
    shift = function.contribute(case.motion, values.ravel()).joint_mm
    np.testing.assert_allclose(shift, np.broadcast_to([0.1, -0.2, 0.3], shift.shape))


def test_functions_of_what_does_not_vary_or_is_unknown_are_left_out():
    frame = measure()
    assert set(UNKNOWN) <= set(case_of(frame).library) and not set(UNKNOWN) & set(case_of(frame).effects)
    bare = make_case(frame.assign(time_s=np.nan, payload_kg=2.0), SIM, MASSES, NOISE_MM, {})
    assert set(bare.library) == {"unknown_drive", "unknown_affine", "unknown_place"}


def test_a_tracker_that_drifts_is_unexplained_and_said_to_follow_the_time():
    frame = measure()
    frame["measured_z_mm"] += 2e-4 * frame["time_s"]
    frame["measured_x_mm"] -= 1e-4 * frame["time_s"]
    found = diagnosed(frame, details=True)
    assert found.verdict["effects"] == "unexplained"
    notes = found.tables["gap_attribute"].set_index("effect")["note"]
    assert notes["unexplained"].startswith("follows the time")
