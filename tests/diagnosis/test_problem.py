"""The campaign as the diagnosis sees it: its motion, its exact corrected model and its signatures, by independent
routes.
"""

from dataclasses import replace

import numpy as np
import pytest

from rrru.campaign import measurements as rows
from rrru.campaign.driven_path import starts_of_runs
from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.state import LinearizedProblem, ModelState
from rrru.errors import FitError
from tests.diagnosis import campaigns
from tests.diagnosis.campaigns import EFFECTS, MODEL, ROBOT, active, drawn, measure, plan_of, problem_of, robot_of

STATE_ERRORS = np.array([2e-3, -1e-3, 1.5e-3, 0.4, -0.3, 0.5, 0.2])


def _exact(problem, state):
    """Positions (n, 3) of the exact closure with a state's effects, none included."""
    return problem.mechanism.measured(*problem.posed(state))[problem.used]


@pytest.fixture(scope="module")
def problem():
    return problem_of(measure())


def test_points_that_are_known_are_used_and_no_run_begins_with_a_known_approach(problem):
    starts = starts_of_runs(problem.measurements["run"].to_numpy())
    assert problem.used.all() and set(problem.known) == {"backlash", "friction_windup"}
    assert not problem.known["backlash"][starts].any() and 0.7 < problem.known["backlash"].mean() < 1.0
    np.testing.assert_array_equal(problem.known["backlash"], np.isnan(problem.motion.approach).all(axis=1))
    assert len(problem) == problem.used.sum() == len(problem.points) == len(problem.run) == problem.count
    some = problem.at_complete({"backlash", "servo_lag"})
    np.testing.assert_array_equal(some.used, problem.known["backlash"])
    assert problem.at_complete({"servo_lag"}) is problem


def test_points_that_are_lost_or_marked_are_not_used():
    frame = measure()
    frame.loc[[3, 40], "status"] = ["outlier", "unsolved"]
    frame.loc[50, "measured_y_mm"] = np.nan
    used = problem_of(frame).used
    assert not used[[3, 40, 50]].any() and used[[2, 41, 51]].all()
    frame.loc[60:70, "status"] = "near_singularity"
    assert problem_of(frame).used[60:71].all() and problem_of(frame).used.sum() == len(frame) - 3


def test_points_dropped_later_stay_dropped(problem):
    flagged = np.zeros(len(problem), dtype=bool)
    flagged[[0, 5]] = True
    smaller = problem.without(flagged)
    np.testing.assert_array_equal(rows.measured(smaller.points), rows.measured(problem.points)[~flagged])
    assert len(smaller) == len(problem) - 2 and len(smaller.without(np.zeros(len(smaller), dtype=bool))) == len(smaller)


def test_the_motion_read_from_the_columns_is_the_one_that_was_driven(problem):
    """Rates, loads and drive path of the table against those of the plan, which knows them in closed form; away from a
    run's ends.
    """
    driven = robot_of().motion(plan_of(), ROBOT.inverse)
    inner = problem.used & np.append(~starts_of_runs(problem.measurements["run"].to_numpy())[1:], False)
    for name, share in (("drive_rate", 0.04), ("drive_load", 0.01), ("force_n", 0.01), ("held_force_n", 0.01)):
        found, true = getattr(problem.motion, name)[inner], getattr(driven, name)[inner]
        assert np.sqrt(((found - true) ** 2).mean()) < share * np.sqrt((true**2).mean()), name
    np.testing.assert_allclose(problem.motion.path_drive[problem.motion.path_index], problem.motion.drive)
    assert np.isfinite(problem.motion.path_drive).all()
    for leg in range(3):
        low, high = driven.path_drive[:, leg].min(), driven.path_drive[:, leg].max()
        assert problem.motion.path_drive[:, leg].min() == pytest.approx(low, abs=2e-3)
        assert problem.motion.path_drive[:, leg].max() == pytest.approx(high, abs=2e-3)


def _state(name, shape, seed=3, size=1.0):
    return ModelState(STATE_ERRORS, {(name, shape): size * drawn(name, seed)})


@pytest.mark.parametrize("name", EFFECTS)
def test_the_corrected_model_is_the_virtual_robot_with_the_same_numbers(problem, name):
    """On the same motion to the solver's accuracy, on the motion as driven up to what the columns do not determine."""
    shape = len(EFFECTS[name].coordinates.shapes) - 1
    state = _state(name, shape)
    robot = robot_of((active(name, state.effects[name, shape], shape),))
    found = _exact(problem, state)
    same, _ = robot.positions(problem.motion, rows.command(problem.measurements))
    np.testing.assert_allclose(found, same[problem.used], atol=1e-7)
    driven, _ = robot.positions(robot.motion(plan_of(), ROBOT.inverse), plan_of().targets())
    size = np.sqrt(((found - problem.model_positions(STATE_ERRORS)[problem.used]) ** 2).mean())
    assert size > 0.0 and np.median(np.abs(found - driven[problem.used])) < 0.03 * size


def test_without_effects_the_corrected_model_is_the_calibrated_one(problem):
    np.testing.assert_allclose(
        _exact(problem, ModelState(STATE_ERRORS, {})), problem.model_positions(STATE_ERRORS)[problem.used], atol=1e-7
    )


@pytest.mark.parametrize("name", EFFECTS)
def test_signatures_are_secants_of_the_exact_model(problem, name):
    """Every coordinate of every shape, over its typical size, to first order in the closure."""
    effect, plain = EFFECTS[name], ModelState(STATE_ERRORS, {})
    linear, still = problem.linearise(plain), _exact(problem, plain)
    for shape in range(len(effect.coordinates.shapes)):
        for k, typical in enumerate(effect.coordinates.typical):
            step = np.zeros(len(effect.coordinates))
            step[k] = typical
            slope = (_exact(problem, ModelState(STATE_ERRORS, {(name, shape): step})) - still) / typical
            off = np.abs(linear.columns[name, shape][..., k] - slope).max() * typical
            # some axes of a joint do nothing to first order
            least = 1e-4 if name == "joint_axis_error" else 0.0
            assert off < max(0.01 * np.abs(slope).max() * typical, least), (shape, k)


def test_the_calibrations_columns_are_derivatives_of_the_model(problem):
    base = problem.linearise(ModelState(STATE_ERRORS, {})).base
    for k, step in enumerate([1e-5] * 3 + [1e-2] * 4):
        change = np.eye(7)[k] * step
        slope = (problem.model_positions(STATE_ERRORS + change) - problem.model_positions(STATE_ERRORS - change))[
            problem.used
        ] / (2.0 * step)
        np.testing.assert_allclose(base[..., k], slope, atol=1e-5 * max(np.abs(slope).max(), 1.0))


def test_the_derivative_by_the_drives_is_the_mechanisms(problem):
    linear = problem.linearise(ModelState(STATE_ERRORS, {}))
    theta, position = rows.actuators(problem.measurements, MODEL), problem.model_positions(STATE_ERRORS)
    np.testing.assert_allclose(
        linear.drive, MODEL.actuator_jacobian(position, theta, STATE_ERRORS)[problem.used], rtol=1e-8
    )


@pytest.mark.parametrize("name", ["servo_lag", "leg_asymmetry", "joint_clearance", "thermal_growth"])
def test_the_data_about_a_state_are_what_it_leaves_and_what_it_explains(problem, name):
    """So that the state's own coordinates give back the exact model's residual."""
    state = _state(name, 1 if len(EFFECTS[name].coordinates.shapes) > 1 else 0, size=4.0)
    linear = problem.linearise(state)
    (key, coordinates), *_ = state.effects.items()
    np.testing.assert_allclose(linear.data - linear.columns[key] @ coordinates, problem.residual(state), atol=1e-9)
    steps = {step[0] for step in linear.shape_steps[name]}
    assert steps <= set(EFFECTS[name].coordinates.shapes[0])
    assert (
        linear.shape_columns[name].shape[-1] == len(linear.shape_steps[name])
        and np.isfinite(linear.shape_columns[name]).all()
    )


def test_stepping_a_shape_parameter_is_what_the_last_column_says(problem):
    state = _state("thermal_growth", 2, size=4.0)
    linear = problem.linearise(state)
    (name, value, stepped), *_ = linear.shape_steps["thermal_growth"]
    assert name == "time_constant" and stepped != value
    other = replace(state, shape_values={"thermal_growth": {name: stepped}})
    change = _exact(problem, other) - _exact(problem, state)
    np.testing.assert_allclose(
        linear.shape_columns["thermal_growth"][..., -1], change, atol=0.02 * np.abs(change).max()
    )


def test_what_the_columns_do_not_determine_is_not_tested():
    frame = measure()
    for column, lost in (
        ("time_s", {"thermal_growth", "servo_lag", "base_drift"}),
        ("payload_kg", set()),
        ("speed_mm_s", set()),
    ):
        problem = problem_of(frame.assign(**{column: np.nan}))
        assert (
            set(problem.untestable) & set(EFFECTS) == lost
            and set(problem.library) & set(EFFECTS) == set(EFFECTS) - lost
        )
        assert all(note.startswith("needs ") for note in problem.untestable.values())


def test_times_that_are_all_alike_determine_nothing():
    problem = problem_of(measure().assign(time_s=5.0))
    assert {"thermal_growth", "servo_lag", "base_drift"} == set(problem.untestable) & set(EFFECTS)
    assert problem.untestable["thermal_growth"] == "needs time_s of more than one value"


def test_a_calibration_without_noise_finds_the_robots_errors():
    found = calibrate(problem_of(measure(noise_mm=0.0)))
    np.testing.assert_allclose(found.deviations, STATE_ERRORS, atol=1e-6)
    assert found.effects == {}


def test_a_model_without_a_pose_is_an_error_that_says_so(problem):
    lost = ModelState(STATE_ERRORS, {("leg_asymmetry", 0): np.tile([0.0, 0.0, -700.0], 3)})
    with pytest.raises(FitError, match=r"has no pose at \d+ readings, first in run \d+ at point \d+; allowed: poses"):
        problem.linearise(lost)


def test_campaigns_are_as_strong_as_they_say():
    for name in ("backlash", "frame_misregistration"):
        assert campaigns.gap_mm((campaigns.strong(name, 4.0),)) == pytest.approx(4.0 * campaigns.NOISE_RMS_MM, rel=0.02)


def test_a_state_has_a_shape_that_was_searched_without_a_library_that_lists_it():
    state = ModelState(np.zeros(1), {("transmission_error", 7): np.zeros(6)}, {"transmission_error": {"ratio": 4.2}})
    assert state.shape(EFFECTS, ("transmission_error", 7)) == {"ratio": 4.2}
    assert state.shape(EFFECTS, ("transmission_error", 0)) == {"ratio": 50.0}


def test_the_basis_of_a_calibration_has_only_what_readings_determine():
    """Of 9 columns of very unlike sizes 4 are independent: the projection is that of these."""
    generator = np.random.default_rng(1)
    few = generator.standard_normal((60, 4))
    base = few @ generator.standard_normal((4, 9)) * 10.0 ** generator.uniform(-6.0, 3.0, 9)
    nothing = np.zeros((20, 3))
    basis = LinearizedProblem(nothing, base.reshape(20, 3, 9), {}, {}, {}, nothing).calibration_basis
    expected = few @ np.linalg.solve(few.T @ few, few.T)
    assert basis.shape == (60, 4)
    np.testing.assert_allclose(basis @ basis.T, expected, atol=1e-9)
