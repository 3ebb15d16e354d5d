"""Random robots with unknown frame and targets: every search ends where least squares from the truth does."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rrru.campaign import measurements as rows
from rrru.diagnosis.calibrate import calibrate
from rrru.errors import FitError
from rrru.estimation.estimate import SearchEnd
from rrru.estimation.explain import explain_end
from rrru.estimation.parameters import Block, Parameters
from rrru.estimation.problem import Problem
from rrru.estimation.solver import SolverOptions, solve
from rrru.estimation.starts import register_measurements
from rrru.pipeline import setup
from tests.estimation.from_truth import outcome_of, problem_of, squares, unregistered_table
from tests.estimation.random_robots import KINDS, NOISE_MM, draw_campaign

_SEEDS = range(3)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", _SEEDS)
def test_every_search_ends_at_the_minimum_from_the_truth(kind, seed):
    found = outcome_of(kind, seed)
    assert not found.messages
    assert all(found.reached(name) for name in found.found_mm2), (found.found_mm2, found.least_mm2)


def test_a_table_in_the_robots_frame_stays_as_it_is():
    campaign = draw_campaign("column", 1)
    robot = setup.as_measured(campaign.robot, unregistered_table(campaign), registered=True)
    moved = register_measurements(unregistered_table(campaign), robot)
    assert moved is not None and register_measurements(moved, robot) is moved
    # nor does one whose frame is not open
    fixed = setup.as_measured(campaign.robot, unregistered_table(campaign))
    table = unregistered_table(campaign)
    assert register_measurements(table, fixed) is table


def test_registration_is_a_rigid_motion_of_positions_and_orientations():
    campaign = next(one for one in (draw_campaign("arm", seed) for seed in range(20)) if one.turn is not None)
    table = unregistered_table(campaign)
    robot = setup.as_measured(campaign.robot, table, registered=True)
    moved = register_measurements(table, robot)
    before, after = rows.measured(table), rows.measured(moved)
    turn, _ = Rotation.align_vectors(after - after.mean(axis=0), before - before.mean(axis=0))
    np.testing.assert_allclose(turn.apply(before - before.mean(axis=0)), after - after.mean(axis=0), atol=1e-6)
    # orientations have the same turn on the left, and one of the tool on the right
    tool = np.einsum("nji,njk->nik", turn.as_matrix() @ rows.turns(table, "measured"), rows.turns(moved, "measured"))
    np.testing.assert_allclose(tool, np.broadcast_to(tool[0], tool.shape), atol=1e-9)


def test_outliers_leave_the_registration_where_it_is():
    campaign = draw_campaign("arm", 4)
    clean = problem_of(campaign)
    campaign.measured_mm[::12] += np.random.default_rng(0).uniform(-500.0, 500.0, campaign.measured_mm[::12].shape)
    moved = rows.measured(problem_of(campaign).measurements)
    good = np.arange(len(moved)) % 12 > 0
    assert np.abs(moved - rows.measured(clean.measurements))[good].max() < 5.0


def test_what_a_gantry_does_not_determine_stays_at_nominal():
    """A gantry that never turns: a target's place and the frame's shift are confounded."""
    campaign = next(one for one in (draw_campaign("gantry", k) for k in range(20)) if one.actuators.shape[1] == 3)
    problem = problem_of(campaign)
    state = calibrate(problem)
    assert np.abs(state.deviations).max() < 50.0
    assert squares(problem, state) < 3.0 * len(problem) * (1.2 * NOISE_MM) ** 2


def test_a_left_handed_frame_is_refused():
    campaign = draw_campaign("arm", 4)
    campaign.measured_mm[:, 1] *= -1.0
    with pytest.raises(FitError, match=r"left-handed one .* allowed: a right-handed frame: change the sign of one"):
        problem_of(campaign)


class _Line:
    """Readings of the sum of two parameters."""

    def residual(self, values):
        """Readings minus prediction (n, 1)."""
        return np.full((5, 1), values.sum() - 3.0)

    def jacobian(self, _values):
        """Its derivative (n, 1, 2)."""
        return np.ones((5, 1, 2))


def test_a_message_names_what_is_not_determined_and_what_to_do():
    block = Block.of("frames", ["reflector_ball_x", "world_x"], ["mm", "mm"], [10.0, 1e4])
    estimate = solve(Problem(_Line(), Parameters((block,))), options=SolverOptions(max_iterations=0))
    assert estimate.end == SearchEnd(False, True, estimate.end.message, estimate.end.cost, 1)
    text = explain_end(estimate, "the fit of frame and targets")
    assert text.startswith("the fit of frame and targets does not converge (1 evaluations, ")
    assert "reflector_ball_x is not determined" in text and "state the target's place (`targets`)" in text
    assert "mm^2" not in text


def test_two_readings_register_nothing():
    campaign = draw_campaign("arm", 2)
    table = unregistered_table(campaign)
    robot = setup.as_measured(campaign.robot, table, registered=True)
    few = table.iloc[:2]
    assert register_measurements(few, robot) is few
    with pytest.raises(FitError):
        calibrate(problem_of(campaign).without(np.arange(len(problem_of(campaign))) > 2))
