"""Positions of targets: slopes against finite differences, heights alone, and readings that are refused."""

import numpy as np
import pytest

from rrru.errors import FitError
from rrru.estimation.observations.target_positions import TargetHeights, TargetPositions
from rrru.robots.rrru3 import Rrru3

_TRUTH = np.array([0.0012, -0.0008, 0.0021, 0.31, 0.24, -0.18, 1.4])


def _campaign(points, theta, noise_mm=0.0, seed=0, kind=TargetPositions):
    robot = Rrru3()
    measured = robot.forward(theta, _TRUTH, points)
    return kind(robot, theta, measured + noise_mm * np.random.default_rng(seed).standard_normal(points.shape), points)


def test_residual_jacobian_equals_finite_differences(rich_poses):
    residuals = _campaign(*rich_poses, noise_mm=0.1)
    analytic = residuals.jacobian(_TRUTH)
    for k, step in enumerate([1e-6] * 3 + [1e-3] * 4):
        shift = step * np.eye(7)[k]
        numeric = (residuals.residual(_TRUTH + shift) - residuals.residual(_TRUTH - shift)) / (2.0 * step)
        np.testing.assert_allclose(analytic[..., k], numeric, rtol=1e-5, atol=1e-5 * np.abs(numeric).max())


def test_heights_are_the_third_of_each_position(rich_poses):
    whole, heights = (_campaign(*rich_poses, noise_mm=0.1, kind=kind) for kind in (TargetPositions, TargetHeights))
    np.testing.assert_array_equal(heights.residual(_TRUTH), whole.residual(_TRUTH)[:, 2:])
    np.testing.assert_array_equal(heights.jacobian(_TRUTH), whole.jacobian(_TRUTH)[:, 2:])


def test_points_that_cannot_be_fitted_are_named(rich_poses):
    points, theta = rich_poses
    measured = points.copy()
    measured[3, 1] = np.nan
    with pytest.raises(FitError, match="measured_mm is not finite at 1 of 200 points, the first is point 4"):
        TargetPositions(Rrru3(), theta, measured, points)
    with pytest.raises(FitError, match="the nominal robot cannot take 200 of 200 poses"):
        TargetPositions(Rrru3(L3_mm=100.0), theta, points, points)
