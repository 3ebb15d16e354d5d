"""Least squares and least mean distance: known truths recovered, standard errors checked by repetition, optimum checked
by another search.
"""

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.optimize import minimize

from rrru.cache import last_cached
from rrru.calibration.calibrate import calibrate
from rrru.calibration.identifiability import analyse
from rrru.calibration.mean_distance import least_mean_distance
from rrru.errors import FitError
from rrru.estimation.observations.target_positions import TargetPositions
from rrru.robots.rrru3 import Rrru3

_TRUTH = np.array([0.0012, -0.0008, 0.0021, 0.31, 0.24, -0.18, 1.4])


def _campaign(points, theta, noise_mm=0.0, seed=0):
    robot = Rrru3()
    measured = robot.forward(theta, _TRUTH, points)
    return TargetPositions(
        robot, theta, measured + noise_mm * np.random.default_rng(seed).standard_normal(points.shape), points
    )


def test_noise_free_rich_poses_give_the_seven_numbers_back(rich_poses):
    fit = calibrate(_campaign(*rich_poses))
    np.testing.assert_allclose(fit.deviations, _TRUTH, rtol=0.0, atol=1e-6)
    assert fit.identifiability.rank == 7 and not fit.at_bound.any()


def test_standard_errors_cover_the_truth_in_95_of_100(rich_poses):
    """200 seeds: the share within 2 standard errors is 95.4 % for each parameter, give or take its binomial scatter."""
    inside = []
    for seed in range(200):
        fit = calibrate(_campaign(*rich_poses, noise_mm=0.05, seed=seed))
        inside.append(np.abs(fit.deviations - _TRUTH) < 2.0 * fit.standard_errors)
    share = np.array(inside).mean(axis=0)
    # four binomial deviations of 200 draws at 95.4 %
    assert (np.abs(share - 0.954) < 4.0 * np.sqrt(0.954 * 0.046 / 200)).all(), share
    assert np.mean(inside) == pytest.approx(0.954, abs=0.02)


def test_estimated_noise_is_the_true_one(rich_poses):
    fit = calibrate(_campaign(*rich_poses, noise_mm=0.05, seed=1))
    assert fit.noise_mm == pytest.approx(0.05, rel=0.1) and fit.noise_from == "residuals"
    assert calibrate(_campaign(*rich_poses), noise_mm=0.02).noise_from == "given"
    assert calibrate(_campaign(*rich_poses, noise_mm=0.02, seed=1), noise_mm=0.02).noise_from == "given"
    doubted = calibrate(_campaign(*rich_poses, noise_mm=0.3), noise_mm=0.02)
    assert doubted.noise_from == "residuals" and doubted.noise_mm == pytest.approx(0.3, rel=0.1)


def test_bounded_fit_stays_in_the_box_and_says_so(rich_poses):
    points, theta = rich_poses
    narrow = Rrru3(length_limit_mm=0.5)
    residuals = _campaign(points, theta)
    fit = calibrate(TargetPositions(narrow, theta, residuals.measured_mm, points))
    assert (np.abs(fit.deviations[3:6]) <= 0.5).all() and abs(fit.deviations[6]) <= 1.0
    assert fit.at_bound[6] and not fit.at_bound[:3].any()


@pytest.mark.parametrize("loss", ["soft_l1", "huber", "cauchy"])
def test_a_robust_loss_survives_a_broken_beam(rich_poses, loss):
    residuals = _campaign(*rich_poses, noise_mm=0.02)
    measured = residuals.measured_mm.copy()
    measured[::20] += 30.0
    spoilt = TargetPositions(residuals.mechanism, residuals.actuators, measured, residuals.start_mm)
    plain, robust = calibrate(spoilt), calibrate(spoilt, loss=loss, loss_scale_mm=0.05)
    scale = 6.0 * calibrate(residuals, 0.02).standard_errors
    assert (np.abs(robust.deviations - _TRUTH) < scale).all()
    assert (np.abs(plain.deviations - _TRUTH) > scale).any()


def _simplex_search(residuals, centre, scale):
    """Least mean distance by a derivative-free search in units of the standard errors, within the bounds."""
    parameters = residuals.mechanism.parameters

    def objective(q):
        deviations = centre + scale * q
        return residuals.mean_distance(deviations[None])[0] if parameters.contains(deviations) else 1e6

    options = {"maxiter": 40_000, "maxfev": 40_000, "xatol": 1e-6, "fatol": 1e-12, "adaptive": True}
    return min(
        minimize(objective, start, method="Nelder-Mead", options=options).fun
        for start in (np.full(7, 0.3), np.full(7, -0.2))
    )


@pytest.mark.parametrize("count", [200, 12, 4])
def test_least_mean_distance_equals_a_derivative_free_search(rich_poses, count):
    """With few points the optimum meets some of them exactly, where the objective has a kink."""
    points, theta = rich_poses
    residuals = _campaign(points[:count], theta[:count], noise_mm=0.3)
    start = calibrate(residuals)
    fit = least_mean_distance(residuals, start.deviations)
    assert fit.mean_mm == pytest.approx(residuals.mean_distance(fit.deviations[None])[0], rel=1e-10)
    assert fit.mean_mm < start.mean_mm and fit.evaluations > 0
    scale = np.where(np.isfinite(start.standard_errors), start.standard_errors, 1e-3)
    assert fit.mean_mm <= _simplex_search(residuals, parameters_inside(residuals, fit), scale) * (1.0 + 1e-5)


def parameters_inside(residuals, fit):
    """Fitted errors, off the bounds by a hair."""
    return residuals.mechanism.parameters.clipped_inside(fit.deviations)


def test_least_mean_distance_does_not_depend_on_the_start(rich_poses):
    residuals = _campaign(*rich_poses, noise_mm=0.3)
    first, second = (least_mean_distance(residuals, start) for start in (np.zeros(7), 2.0 * _TRUTH))
    np.testing.assert_allclose(first.deviations, second.deviations, atol=1e-5)


def test_least_mean_distance_stays_in_the_bounds(rich_poses):
    points, theta = rich_poses
    free = _campaign(points, theta, noise_mm=0.3)
    residuals = TargetPositions(Rrru3(length_limit_mm=0.5), theta, free.measured_mm, points)
    fit = least_mean_distance(residuals, calibrate(residuals).deviations)
    parameters = residuals.mechanism.parameters
    assert parameters.contains(fit.deviations) and fit.at_bound[6] and np.isnan(fit.standard_errors[6])
    scale = np.where(np.isfinite(fit.standard_errors), fit.standard_errors, 1e-3)
    assert fit.mean_mm <= _simplex_search(residuals, parameters_inside(residuals, fit), scale) * (1.0 + 1e-5)
    assert fit.mean_mm > least_mean_distance(free, np.zeros(7)).mean_mm


@pytest.mark.parametrize("loss", ["linear", "soft_l1", "huber", "cauchy"])
def test_standard_errors_are_the_scatter_of_repeated_fits(rich_poses, loss):
    """With a broken beam in every twentieth point the robust losses' errors still say how much the answer scatters."""
    points, theta = (array[:60] for array in rich_poses)
    found, stated = [], []
    for seed in range(60):
        residuals = _campaign(points, theta, noise_mm=0.02, seed=seed)
        measured = residuals.measured_mm.copy()
        if loss != "linear":
            measured[::20] += np.random.default_rng(seed + 1000).normal(0.0, 1.0, (3, 3))
        fit = calibrate(TargetPositions(residuals.mechanism, theta, measured, points), loss=loss, loss_scale_mm=0.05)
        found.append(fit.deviations)
        stated.append(fit.standard_errors)
    ratio = np.std(found, axis=0, ddof=1) / np.mean(stated, axis=0)
    assert ((ratio > 0.65) & (ratio < 1.45)).all(), ratio


def test_a_bounded_parameter_has_no_standard_error_and_the_others_are_those_without_it(rich_poses):
    points, theta = rich_poses
    residuals = _campaign(points, theta, noise_mm=0.05)
    narrow = TargetPositions(Rrru3(length_limit_mm=0.5), theta, residuals.measured_mm, points)
    fit = calibrate(narrow, noise_mm=10.0)
    free = ~fit.at_bound
    assert 0 < free.sum() < 7 and np.isnan(fit.standard_errors[~free]).all()
    jacobian = narrow.jacobian(fit.deviations)[..., free].reshape(-1, free.sum())
    np.testing.assert_allclose(
        fit.standard_errors[free], 10.0 * np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian))), rtol=1e-6
    )


def test_where_all_parameters_are_at_bounds_none_has_a_standard_error(rich_poses):
    points, theta = rich_poses
    tight = Rrru3(angle_limit_rad=1e-4, length_limit_mm=0.02)
    fit = calibrate(TargetPositions(tight, theta, _campaign(points, theta).measured_mm, points))
    assert fit.at_bound.all() and np.isnan(fit.standard_errors).all() and fit.rms_mm > 0.1


def test_two_points_leave_a_direction_unseen():
    robot = Rrru3()
    points = np.array([[-400.0, 50.0, 600.0], [-300.0, 20.0, 700.0]])
    theta = robot.inverse(points)
    ident = analyse(robot, robot.parameter_jacobian(points, theta))
    assert ident.rank == 6 and ident.condition > 1e6
    assert np.isinf(ident.standard_errors(0.02)).any() and ident.indices()["O1"] == 0.0
    measured = robot.forward(theta, _TRUTH, points)
    with pytest.raises(FitError, match="2 points give 6 equations; allowed: at least 7"):
        calibrate(TargetPositions(robot, theta, measured, points))


def test_a_repeated_pose_fits_and_the_prior_decides_what_it_does_not_determine():
    """Of all deviations that meet the point the most probable ones are found: the gradient of the prior has no part
    along directions that the point does not see.
    """
    robot = Rrru3()
    points = np.tile([[-400.0, 0.0, 600.0]], (5, 1))
    theta = robot.inverse(points)
    fit = calibrate(TargetPositions(robot, theta, robot.forward(theta, _TRUTH, points), points))
    assert fit.identifiability.rank == 3 and fit.rms_mm < 1e-6
    parameters = robot.parameters
    prior_sd = (parameters.high - parameters.low) / np.sqrt(12.0)
    jacobian = robot.parameter_jacobian(robot.forward(theta, fit.deviations, points), theta, fit.deviations)
    unseen = null_space(jacobian[0] * prior_sd)
    assert unseen.shape[1] == 4
    np.testing.assert_allclose(unseen.T @ (fit.deviations / prior_sd), 0.0, atol=1e-3)
    assert np.isinf(fit.standard_errors[fit.identifiability.unseen]).all()


def test_covariance_equals_the_inverse_normal_matrix(rich_poses):
    residuals = _campaign(*rich_poses)
    jacobian = residuals.jacobian(_TRUTH)
    ident = analyse(residuals.mechanism, jacobian)
    flat = jacobian.reshape(-1, 7)
    plain = 0.02**2 * np.linalg.inv(flat.T @ flat)
    np.testing.assert_allclose(ident.covariance(0.02), plain, rtol=1e-6, atol=1e-12 * np.abs(plain).max())
    np.testing.assert_allclose(np.diag(ident.correlations()), 1.0)
    scaled = flat * ident.scale
    assert ident.indices()["O1"] == pytest.approx(
        np.sqrt(np.linalg.det(scaled.T @ scaled)) ** (1 / 7) / np.sqrt(len(jacobian))
    )


def test_the_last_answer_is_kept_for_the_same_deviations_only():
    class Asked:
        count = 0

        @last_cached
        def square(self, deviations):
            self.count += 1
            return deviations**2

    one, other = Asked(), Asked()
    for value in (np.array([1.0, 2.0]), np.array([1.0, 2.0]), np.array([1.0, 3.0])):
        np.testing.assert_array_equal(one.square(value), value**2)
    np.testing.assert_array_equal(other.square(np.array([2.0])), [4.0])
    assert one.count == 2 and other.count == 1
