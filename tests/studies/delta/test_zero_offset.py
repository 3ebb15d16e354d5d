"""The paper's step to the zero errors: its equation, its uncertainty, and what it takes for zero errors."""

import numpy as np
import pytest

from rrru.calibration.calibrate import calibrate
from rrru.errors import FitError
from rrru.estimation.observations.distances import Distances, Shape
from rrru.estimation.observations.target_positions import TargetHeights
from rrru.robots.delta import Delta
from rrru.studies.delta.variants import one_step, step_fit, taken_for_errors
from tests.estimation.observations.test_distances import COMMAND, ROBOT, THETA, TRUE, moved

LEGS = Delta(parameter_set="legs")


def test_one_step_is_the_paper_s_equation_15():
    measured = moved(ROBOT.forward(THETA, TRUE))
    h, b = [], []
    nominal = ROBOT.forward(THETA)
    for j in range(1, len(THETA)):
        length = np.linalg.norm(nominal[j] - nominal[0])
        slopes = [ROBOT.parameter_jacobian(nominal[k : k + 1], THETA[k : k + 1])[0] for k in (0, j)]
        h.append((nominal[j] - nominal[0]) @ (slopes[1] - slopes[0]) / length)
        b.append(np.linalg.norm(measured[j] - measured[0]) - length)
    h, b = np.array(h), np.array(b)
    expected = np.linalg.inv(h.T @ h) @ h.T @ b
    np.testing.assert_allclose(one_step(Distances(ROBOT, THETA, measured, alike=True)), expected, rtol=1e-8)
    assert not np.allclose(expected, TRUE, atol=1e-5)


def test_the_papers_step_is_as_uncertain_as_it_says():
    """The first place's noise is in every distance: estimated noise and standard errors are right all the same."""
    generator, noise, draws = np.random.default_rng(9), 0.01, 400
    small = TRUE / 100.0
    places = moved(ROBOT.forward(THETA, small))
    noisy = [
        Distances(ROBOT, THETA, places + noise * generator.standard_normal(places.shape), alike=True)
        for _ in range(draws)
    ]
    fits = [step_fit(points) for points in noisy]
    tolerance = 4.0 / np.sqrt(2.0 * draws)
    scale = np.sqrt(np.mean([fit.noise_mm**2 for fit, _ in fits]))
    # residuals that share a noise tell less of it than as many independent ones: variance of a quadratic form
    jacobian = noisy[0].jacobian(np.zeros(3))[:, 0]
    left = (np.eye(len(noisy[0])) - jacobian @ np.linalg.pinv(jacobian)) @ noisy[0].covariance
    assert scale == pytest.approx(noise, rel=4.0 * 0.5 * np.sqrt(2.0 * np.trace(left @ left) / draws) / np.trace(left))
    scatter = np.std([fit.deviations for fit, _ in fits], axis=0)
    expected = np.sqrt(np.mean([fit.standard_errors**2 for fit, _ in fits], axis=0))
    np.testing.assert_allclose(scatter, expected, rtol=tolerance)
    fit, covariance = fits[0]
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), fit.standard_errors)
    # the condition is that of what the distances hold, not of the paper's weights
    other = calibrate(Distances(ROBOT, THETA, noisy[0].measured_mm))
    assert fit.identifiability.condition == pytest.approx(other.identifiability.condition, rel=1e-2)


def test_what_is_taken_for_zero_errors_is_what_a_fit_finds():
    for kind in (Distances, Shape, lambda *a: TargetHeights(*a, COMMAND)):
        length = 1e-3
        deviations = np.zeros(12)
        deviations[5] = length
        found = calibrate(kind(ROBOT, THETA, LEGS.forward(THETA, deviations))).deviations
        exact = ROBOT.forward(THETA)
        changes = -kind(LEGS, THETA, exact).jacobian(np.zeros(12))[..., [5]]
        np.testing.assert_allclose(
            length * taken_for_errors(kind(ROBOT, THETA, exact), changes)[:, 0], found, rtol=2e-3
        )


def test_too_few_places_are_refused_and_a_second_height_conditions_better():
    with pytest.raises(FitError, match="2 equations; allowed: at least 3"):
        calibrate(Distances(ROBOT, THETA[:3], ROBOT.forward(THETA[:3], TRUE)))
    split = COMMAND - np.outer(np.arange(len(COMMAND)) % 2, [0.0, 0.0, 100.0])
    condition = [
        calibrate(Distances(ROBOT, ROBOT.inverse(p), ROBOT.forward(ROBOT.inverse(p), TRUE))).identifiability.condition
        for p in (COMMAND, split)
    ]
    assert condition[1] < condition[0]
