"""Rigid registration recovers a motion, says how well, and refuses points that cannot fix it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rrru.campaign.ingest.registration import register
from rrru.errors import FitError

POINTS = np.array(
    [[-700.0, 0.0, 600.0], [-200.0, 100.0, 610.0], [100.0, -250.0, 700.0], [250.0, 200.0, 560.0], [0.0, 0.0, 780.0]]
)
ANGLE = st.floats(-np.pi, np.pi)
SHIFT = st.floats(-5000.0, 5000.0)


@settings(max_examples=100, deadline=None)
@given(turn=st.tuples(ANGLE, ANGLE, ANGLE), shift=st.tuples(SHIFT, SHIFT, SHIFT), count=st.integers(3, 5))
def test_a_random_rigid_motion_is_recovered(turn, shift, count):
    rotation = Rotation.from_euler("xyz", turn).as_matrix()
    seen = (POINTS[:count] - shift) @ rotation
    result = register(seen, POINTS[:count])
    assert np.allclose(result.rotation, rotation, atol=1e-10)
    assert np.allclose(result.translation, shift, atol=1e-7)
    assert result.max_mm < 1e-8
    assert np.allclose(result.apply(seen), POINTS[:count], atol=1e-8)
    assert result.points == count
    assert np.linalg.det(result.rotation) == pytest.approx(1.0)


def test_residuals_are_those_left_after_the_best_motion():
    rng = np.random.default_rng(1)
    points = rng.uniform(-500.0, 500.0, size=(4000, 3))
    result = register(points + rng.normal(scale=0.02, size=points.shape) + [10.0, 0.0, 0.0], points)
    off = np.linalg.norm(result.apply(points), axis=1)
    assert off.shape == (4000,)
    assert result.rms_mm == pytest.approx(0.02 * np.sqrt(3.0), rel=0.05)
    assert result.rms_mm < result.max_mm < 0.15
    assert np.allclose(result.translation, [-10.0, 0.0, 0.0], atol=0.005)


def test_a_robot_error_that_looks_like_a_motion_leaks_into_the_registration():
    turn = Rotation.from_rotvec([0.0, 0.0, 0.002]).as_matrix()
    result = register(POINTS @ turn.T, POINTS)
    assert result.rms_mm < 1e-8
    assert np.allclose(result.rotation, turn.T)


def test_a_mirrored_frame_is_no_rigid_motion():
    assert register(POINTS * [1.0, 1.0, -1.0], POINTS).rms_mm > 20.0


@pytest.mark.parametrize(
    ("measured", "command", "said"),
    [
        (POINTS[:2], POINTS[:2], "2 different commanded positions; allowed: at least 3"),
        (POINTS[[0, 0, 1]] + np.eye(3), POINTS[[0, 0, 1]], "2 different commanded positions"),
        (
            np.linspace(POINTS[0], POINTS[1], 9),
            np.linspace(POINTS[0], POINTS[1], 9),
            r"9 commanded positions on one line: 0\.000 mm \(rms\) off",
        ),
        (np.zeros((5, 3)), POINTS, "1 different measured positions"),
        (np.linspace(POINTS[0], POINTS[1], 5), POINTS, "5 measured positions on one line"),
    ],
)
def test_points_that_cannot_fix_six_numbers_are_refused_with_numbers(measured, command, said):
    with pytest.raises(FitError, match=said):
        register(measured, command)


def test_wrong_shapes_are_refused():
    with pytest.raises(ValueError, match=r"got \(5, 3\) and \(4, 3\)"):
        register(POINTS, POINTS[:4])


def test_numbers_of_a_motion_are_off_as_far_as_their_covariance_says():
    """Over draws of noise the squared errors under the covariance are those of six normal numbers."""
    rng, turn, shift = np.random.default_rng(3), np.array([0.4, -0.9, 1.3]), np.array([900.0, -400.0, 250.0])
    points = rng.uniform(-500.0, 500.0, size=(60, 3))
    seen = (points - shift) @ Rotation.from_rotvec(turn).as_matrix()
    squares = []
    for _ in range(300):
        found = register(seen + rng.normal(scale=0.05, size=seen.shape), points)
        off = found.numbers - np.concatenate([shift, turn])
        squares.append(off @ np.linalg.solve(found.covariance, off))
    # mean of 300 chi-squares of six degrees of freedom, a little more since the variance is estimated
    assert np.mean(squares) == pytest.approx(6.0, abs=0.8)
