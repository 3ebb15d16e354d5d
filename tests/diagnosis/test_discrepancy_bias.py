"""Errors of parameters by an effect that the library lacks: against refits, drawn functions and known truths."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.coverage import coverage, one_draw
from benchmarks.virtual_campaigns import draw_truth, measure, virtual_campaign
from rrru.campaign import measurements as rows
from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.diagnose import with_wide_bounds
from rrru.diagnosis.discrepancy_bias import discrepancy_covariance, growth_with
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.model_fit import fit_model

NOISE_MM = 0.02


def _problem(campaign, frame):
    return make_diagnosis_problem(frame, with_wide_bounds(campaign.mechanism), campaign.masses, NOISE_MM, {})


def _fit(problem):
    return fit_model(problem, [calibrate(problem)])


def _fitted(name):
    """Campaign, readings and fit of a robot."""
    campaign = virtual_campaign(name, "white", 0.5)
    truth = draw_truth(campaign, np.random.default_rng(1), acts=False)
    frame = measure(campaign, replace(truth, deviations=0.2 * truth.deviations), np.random.default_rng(2))
    return campaign, frame, _fit(_problem(campaign, frame))


@pytest.fixture(scope="module")
def fitted():
    """A campaign of the 3-RRRU, its readings with noise alone, and the fit to them."""
    return _fitted("rrru3")


def test_it_is_the_variance_given_what_the_parameters_can_change_of_the_readings(fitted):
    # the obvious way: condition the joint normal distribution of parameters and of these combinations of the readings
    estimate, generator = fitted[-1].estimate, np.random.default_rng(3)
    functions = 0.05 * generator.standard_normal((*estimate.residual.shape, 5))
    columns = -estimate.jacobian.reshape(-1, len(estimate.values)) / fitted[-1].model.problem.noise_mm
    moved = functions.reshape(-1, 5) / fitted[-1].model.problem.noise_mm
    onto = np.linalg.svd(columns, full_matrices=False)[0].T
    prior = np.diag(estimate.parameters.sd**2)
    seen = onto @ columns
    variances = []
    for some in (np.zeros((len(columns), 0)), moved):
        covariance = seen @ prior @ seen.T + onto @ (np.eye(len(columns)) + some @ some.T) @ onto.T
        variances.append(prior - prior @ seen.T @ np.linalg.solve(covariance, seen @ prior))
    np.testing.assert_allclose(variances[0], estimate.covariance, rtol=1e-3, atol=1e-6 * estimate.covariance.max())
    found = growth_with(estimate, functions)
    # the priors are so wide that the mean hardly moves
    np.testing.assert_allclose(np.diag(found), np.diag(variances[1] - variances[0]), rtol=0.02)
    assert (np.diag(found) > 0.0).all()


def test_no_error_is_larger_than_its_prior(fitted):
    estimate = fitted[-1].estimate
    huge = 1e4 * np.random.default_rng(7).standard_normal((*estimate.residual.shape, 200))
    whole = np.diag(estimate.covariance + growth_with(estimate, huge))
    limit = estimate.parameters.sd**2 + (estimate.values - estimate.parameters.mean) ** 2
    assert (whole < 1.001 * limit).all() and (whole > 0.5 * limit).any()


def test_noise_alone_makes_no_bias(fitted):
    _, _, fit = fitted
    added = np.diag(discrepancy_covariance(fit)) / np.diag(fit.estimate.covariance)
    assert added.max() < 0.3


@pytest.mark.parametrize("seed", [4, 5, 6])
def test_errors_of_drives_that_are_functions_of_their_values_are_covered(fitted, seed):
    # functions that no parameter holds, drawn as sums of waves: their parts in the parameters are known from refits
    campaign, frame, fit = fitted
    problem, generator = fit.model.problem, np.random.default_rng(seed)
    drive = problem.motion.drive[problem.at]
    waves = generator.uniform(0.5, 4.0, (3, 4)), generator.uniform(0.0, 2.0 * np.pi, (3, 4))
    error = 1e-3 * np.sin(drive[..., None] * waves[0] + waves[1]).sum(axis=-1)
    moved_mm = np.zeros((len(frame), 3))
    response = problem.of_rows(problem.map_of(fit.state).drive_effect)
    moved_mm[problem.used] = np.einsum("mak,mk->ma", response, error)
    wrong = frame.assign(**rows.vector_columns("measured", rows.measured(frame) + moved_mm))
    found = _fit(_problem(campaign, wrong))
    bias = found.estimate.values - fit.estimate.values
    covariance = discrepancy_covariance(found)
    z = bias / np.sqrt(np.diag(covariance))
    assert np.sqrt((z**2).mean()) < 2.0
    # without it they are off by many of their standard errors
    assert np.sqrt(((bias / found.estimate.standard_errors) ** 2).mean()) > 5.0


@pytest.fixture(scope="module")
def arm():
    """The same of an arm."""
    return _fitted("arm7")


@pytest.mark.parametrize("drives", [(3, 4), (2, 3), (4, 5)])
def test_an_error_of_a_drive_in_proportion_to_another_one_is_covered(arm, drives):
    """As where two drives are coupled: its part in each parameter is known from refits."""
    campaign, frame, fit = arm
    problem, (driving, driven) = fit.model.problem, drives
    drive = problem.motion.drive[problem.at]
    response = problem.of_rows(problem.map_of(fit.state).drive_effect)[..., driven]
    moved_mm = np.zeros((len(frame), 3))
    moved_mm[problem.used] = 1e-3 * response * (drive[:, [driving]] - drive[:, driving].mean())
    wrong = frame.assign(**rows.vector_columns("measured", rows.measured(frame) + moved_mm))
    found = _fit(_problem(campaign, wrong))
    bias = found.estimate.values - fit.estimate.values
    z = bias / np.sqrt(np.diag(discrepancy_covariance(found)))
    # no other error but one of the size that is found acts
    assert np.abs(z).max() < 1.5
    assert np.sqrt(((bias / found.estimate.standard_errors) ** 2).mean()) > 5.0


@pytest.mark.parametrize("robot", ["rrru3", "arm7"])
def test_intervals_beside_something_unexplained_hold(robot):
    directions = [row["z"] for number in range(0, 12, 2) for row in one_draw(robot, "discrepancy", number)[1]]
    rate, _, ratio = coverage(np.array(directions), np.arange(len(directions)))
    assert rate > 0.85 and ratio < 1.5
