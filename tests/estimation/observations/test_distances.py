"""Zero errors from distances, shapes and heights: exact where nothing disturbs, and as uncertain as they say."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rrru.calibration.calibrate import calibrate, estimate_deviations
from rrru.errors import FitError
from rrru.estimation.observations.distances import Distances, Shape
from rrru.estimation.observations.target_positions import TargetHeights, TargetPositions
from rrru.robots.delta import Delta

ROBOT = Delta()
COMMAND = np.array([[x, y, 100.0] for x in (-200.0, -70.0, 70.0, 200.0) for y in (-135.0, 0.0, 135.0)])
THETA = ROBOT.inverse(COMMAND)
TRUE = np.array([0.012, -0.008, 0.015])
KINDS = [Distances, lambda *a: Distances(*a, alike=True), Shape]


def moved(places, seed=1):
    """Places in a frame of which nothing is known."""
    return places @ Rotation.random(rng=np.random.default_rng(seed)).as_matrix().T + [300.0, -80.0, 550.0]


@pytest.mark.parametrize("kind", KINDS)
def test_exact_places_in_any_frame_give_the_true_errors(kind):
    places = ROBOT.forward(THETA, TRUE)
    points = kind(ROBOT, THETA, moved(places))
    fit = calibrate(points)
    np.testing.assert_allclose(fit.deviations, TRUE, atol=1e-11)
    assert fit.identifiability.rank == 3
    other = kind(ROBOT, THETA, moved(places, seed=2))
    # the frame does not count: sums of squares are the same for any errors
    assert (points.residual(TRUE / 2.0) ** 2).sum() == pytest.approx((other.residual(TRUE / 2.0) ** 2).sum(), rel=1e-9)


def test_heights_and_positions_need_the_base_frame_and_give_the_true_errors():
    places = ROBOT.forward(THETA, TRUE)
    for kind in (TargetHeights, TargetPositions):
        np.testing.assert_allclose(calibrate(kind(ROBOT, THETA, places, COMMAND)).deviations, TRUE, atol=1e-11)


@pytest.mark.parametrize("kind", [*KINDS, lambda *a: TargetHeights(*a, COMMAND)])
def test_jacobians_are_those_of_finite_differences(kind):
    points = kind(ROBOT, THETA, ROBOT.forward(THETA, TRUE))
    step = 1e-6
    slope = np.stack(
        [(points.residual(TRUE + step * e) - points.residual(TRUE - step * e)) / (2.0 * step) for e in np.eye(3)],
        axis=-1,
    )
    np.testing.assert_allclose(points.jacobian(TRUE), slope, atol=1e-5)
    assert len(slope) == points.residual(TRUE).size


@pytest.mark.parametrize("kind", [Distances, Shape])
def test_standard_errors_are_the_scatter_under_noise(kind):
    generator, noise, draws = np.random.default_rng(8), 0.01, 250
    places = moved(ROBOT.forward(THETA, TRUE))
    drawn = [kind(ROBOT, THETA, places + noise * generator.standard_normal(places.shape)) for _ in range(draws)]
    scatter = np.std([estimate_deviations(points).values for points in drawn], axis=0)
    # four standard deviations of an estimated standard deviation
    expected = calibrate(drawn[0], noise).standard_errors
    np.testing.assert_allclose(scatter, expected, rtol=4.0 / np.sqrt(2.0 * draws))


@pytest.mark.parametrize("kind", [Distances, Shape])
def test_a_place_that_is_not_finite_is_named(kind):
    places = ROBOT.forward(THETA)
    places[4, 2] = np.nan
    with pytest.raises(FitError, match="measured_mm is not finite at 1 of 12 places, the first is place 5"):
        kind(ROBOT, THETA, places)
