"""The smooth functions and the jumps that compete with the library."""

from dataclasses import dataclass

import numpy as np
import pytest

from rrru.diagnosis.discrepancy_basis import JUMPS, UNKNOWN, jump_at, unknown_functions
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.payload_nuisance import WEIGHT
from rrru.diagnosis.problem import GEOMETRY
from rrru.effects.library import RESERVED
from rrru.effects.protocol import Contribution
from rrru.robots.delta import Delta
from rrru.robots.ptt3 import Ptt3
from tests.diagnosis.campaigns import MASSES, MODEL, NOISE_MM, diagnosed, measure, problem_of, robot_of


def test_no_effect_of_a_user_s_can_have_the_name_of_a_part_of_the_results():
    of_results = {
        *UNKNOWN,
        WEIGHT,
        GEOMETRY,
        "none",
        "unexplained",
        "shape",
        "calibration",
        "scatter",
        "runs",
        "sampling",
    }
    assert of_results <= {*RESERVED}


@pytest.fixture(scope="module")
def problem():
    return problem_of(measure())


@pytest.mark.parametrize("name", [name for name in UNKNOWN if name != "unknown_target_jump"])
def test_a_function_is_linear_in_its_coefficients_and_about_as_large_as_they_are(problem, name):
    function, generator = UNKNOWN[name], np.random.default_rng(4)
    if name in JUMPS:
        function = jump_at(name, MODEL, float(np.median(problem.motion.time_s)), 0.0)
    first, second = (generator.standard_normal(len(function.coordinates)) for _ in range(2))

    def made(values):
        twists = function.contribute(problem.motion, values).twists
        acting = {MODEL.legs.sites[k] for k in np.flatnonzero(twists.any(axis=(0, 2)))}
        assert acting <= ({f"leg {leg} drive" for leg in (1, 2, 3)} if function.per_leg else {"world"})
        return twists

    np.testing.assert_allclose(made(2.0 * first - second), 2.0 * made(first) - made(second), atol=1e-12)
    for k in range(len(first)):
        one = np.abs(made(np.eye(len(first))[k]))
        assert 0.5 <= one.max() <= 1.0 + 1e-12


def test_a_constant_shift_moves_the_reading_by_it(problem):
    function = UNKNOWN["unknown_affine"]
    values = np.zeros((3, 4))
    values[:, 0] = [0.1, -0.2, 0.3]
    twists = function.contribute(problem.motion, values.ravel()).twists
    np.testing.assert_allclose(twists[:, 0], np.tile([0.1, -0.2, 0.3, 0.0, 0.0, 0.0], (len(twists), 1)))
    still = robot_of().positions(problem.motion)[0]
    moved = robot_of((_Constant(Contribution(twists)),)).positions(problem.motion)[0]
    np.testing.assert_allclose(moved - still, np.tile([0.1, -0.2, 0.3], (len(still), 1)), atol=1e-9)


@dataclass(frozen=True)
class _Constant:
    """A contribution that is known."""

    contribution: Contribution

    def contribute(self, motion):
        return self.contribution


def test_functions_of_a_drive_are_as_large_as_its_unit_allows():
    for robot, typical in ((MODEL, 1e-4), (Delta(), 1e-4), (Ptt3(), 0.01)):
        functions = unknown_functions(robot)
        # a target that moves on a platform that never turns is a base that moves
        assert list(functions) == [name for name in UNKNOWN if name != "unknown_targets" and name not in JUMPS]
        of_drives = [function for function in functions.values() if function.per_leg]
        assert of_drives and all((f.coordinates.typical == typical).all() for f in of_drives)
        assert all(len(f.coordinates) == 3 * f.count for f in of_drives)
        assert all(f is UNKNOWN[name] for name, f in functions.items() if not f.per_leg)


def test_functions_of_what_does_not_vary_or_is_unknown_are_left_out():
    frame = measure()
    assert set(unknown_functions(MODEL)) <= set(problem_of(frame).library) and not set(UNKNOWN) & set(
        problem_of(frame).effects
    )
    bare = make_diagnosis_problem(frame.assign(time_s=np.nan, payload_kg=2.0), MODEL, MASSES, NOISE_MM, {})
    assert set(bare.library) == {"unknown_drive", "unknown_affine", "unknown_place"}


def test_a_tracker_that_drifts_to_and_fro_is_unexplained_and_said_to_follow_the_time():
    frame = measure()
    # from -1 to 1
    passed = 2.0 * frame["time_s"] / frame["time_s"].max() - 1.0
    frame["measured_z_mm"] += 0.15 * passed**2
    frame["measured_x_mm"] -= 0.08 * (4.0 * passed**3 - 3.0 * passed)
    found = diagnosed(frame)
    assert found.verdict["effects"] == "unexplained"
    best = found.tables["gap_remainder"].iloc[0]
    assert best["follows"] == "the time" and best["explained"] > 0.9


@dataclass(frozen=True)
class _Drag:
    """A servo that falls back with the square of its drive's speed."""

    def contribute(self, motion):
        rate = np.nan_to_num(motion.drive_rate) * [0.0, 1.0, 0.0]
        return motion.at_drives(-0.05 * rate * np.abs(rate))


def test_a_drive_that_falls_back_with_the_square_of_its_speed_is_unexplained_and_said_to_follow_that_speed():
    found = diagnosed(measure((_Drag(),)))
    assert found.verdict["effects"] == "unexplained"
    best = found.tables["gap_remainder"].iloc[0]
    assert best["follows"] == "the speed of leg 2" and best["explained"] > 0.9
