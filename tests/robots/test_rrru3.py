"""3-RRRU kinematics against reference values, a general solver, finite differences and known truths."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rrru.errors import ConfigError, UnreachableError
from rrru.kinematics import singularity
from rrru.robots.rrru3 import Rrru3
from tests.reference import rrru3_slow

# computed apart from this project: elbow out, y = 0, z = 600 (degrees)
REFERENCE_DEG = {
    -800.0: (79.0746, 14.5015, 14.5015),
    -540.0: (42.1292, -20.7658, -20.7658),
    -300.0: (4.6842, -36.7854, -36.7854),
}


@pytest.mark.parametrize(("x", "expected"), REFERENCE_DEG.items())
def test_inverse_gives_the_sourced_reference_angles(x, expected):
    np.testing.assert_allclose(np.degrees(Rrru3().inverse([[x, 0.0, 600.0]]))[0], expected, atol=5e-5)


@pytest.mark.parametrize("elbow", ["out", "in", ("out", "in", "out")])
def test_every_elbow_branch_closes_the_loops(rich_poses, elbow):
    robot, (points, _) = Rrru3(), rich_poses
    theta = robot.inverse(points, elbow=elbow)
    assert np.abs(robot.closure(points, theta)).max() < 1e-6


def test_elbow_out_is_the_smaller_drive_angle(rich_poses):
    points, theta = rich_poses
    assert (theta < Rrru3().inverse(points, elbow="in")).all()


@settings(max_examples=60, deadline=None)
@given(
    position=st.tuples(st.floats(-500, 500), st.floats(-300, 300), st.floats(500, 900)),
    deviations=st.tuples(*[st.floats(-0.01, 0.01)] * 3, *[st.floats(-2, 2)] * 4),
)
def test_forward_undoes_inverse_under_any_errors(position, deviations):
    robot = Rrru3()
    theta = robot.inverse([position], deviations)
    # at a singularity, as over the base's centre with upright arms, rounding is all that the closures leave of the
    # position
    if np.isfinite(theta).all() and singularity.translational_measure(robot, [position], theta, deviations) > 1e-3:
        np.testing.assert_allclose(robot.forward(theta, deviations, [position])[0], position, atol=1e-9)


def test_forward_without_guess_finds_the_commanded_pose(rich_poses):
    points, theta = rich_poses
    np.testing.assert_allclose(Rrru3().forward(theta), points, atol=1e-8)


def test_forward_equals_a_general_solver_point_by_point(rich_poses):
    points, theta = rich_poses
    robot = Rrru3(parameter_set="published")
    deviations = np.random.default_rng(0).uniform(-1, 1, 14) * np.r_[[0.02] * 3, [2.0] * 11]
    legs = robot.numbers(deviations)
    slow = [rrru3_slow.forward(t, legs, p) for t, p in zip(theta[:40], points[:40], strict=True)]
    np.testing.assert_allclose(robot.forward(theta[:40], deviations, points[:40]), slow, atol=1e-9)


def test_batch_over_errors_equals_one_at_a_time(rich_poses):
    points, theta = rich_poses
    robot = Rrru3(parameter_set="tied")
    deviations = np.random.default_rng(1).uniform(-1, 1, (5, 8)) * np.r_[[0.005] * 3, [1.0] * 5]
    batch = robot.forward_batch(theta, deviations, points)
    assert batch.shape == (5, len(points), 3)
    for one, vector in zip(batch, deviations, strict=True):
        np.testing.assert_array_equal(one, robot.forward(theta, vector, points))


@pytest.mark.parametrize("kind", Rrru3.PARAMETER_NAMES)
def test_parameter_jacobian_equals_finite_differences(rich_poses, kind):
    points, theta = rich_poses
    robot = Rrru3(parameter_set=kind)
    deviations = np.random.default_rng(2).uniform(-1, 1, len(robot.parameters)) * np.where(
        [u == "rad" for u in robot.parameters.units], 0.005, 1.0
    )
    position = robot.forward(theta, deviations, points)
    analytic = robot.parameter_jacobian(position, theta, deviations)
    for k, unit in enumerate(robot.parameters.units):
        step = np.zeros(len(deviations))
        step[k] = 1e-5 if unit == "rad" else 1e-2
        numeric = (
            robot.forward(theta, deviations + step, position) - robot.forward(theta, deviations - step, position)
        ) / (2 * step[k])
        np.testing.assert_allclose(analytic[..., k], numeric, rtol=1e-5, atol=1e-5 * np.abs(numeric).max())


def test_actuator_and_position_jacobians_equal_finite_differences(rich_poses):
    points, theta = rich_poses
    robot = Rrru3()
    by_position, _ = robot.closure_jacobians(points, theta)
    drive = robot.actuator_jacobian(points, theta)
    for k in range(3):
        step = np.eye(3)[k]
        numeric = (robot.closure(points + 1e-3 * step, theta) - robot.closure(points - 1e-3 * step, theta)) / 2e-3
        np.testing.assert_allclose(by_position[..., k], numeric, rtol=1e-6, atol=1e-4)
        numeric = (
            robot.forward(theta + 1e-5 * step, guess_mm=points) - robot.forward(theta - 1e-5 * step, guess_mm=points)
        ) / 2e-5
        np.testing.assert_allclose(drive[..., k], numeric, rtol=1e-5, atol=1e-3)


def test_passive_angles_lead_the_chain_back_to_the_platform(rich_poses):
    points, theta = rich_poses
    robot = Rrru3()
    passive = robot.passive_angles(points, theta)
    lengths, ideal = (400.0, 400.0, 100.0, 800.0, 400.0), np.zeros((8, 6))
    for point, drive, angles in zip(points[:20], theta[:20], passive[:20], strict=True):
        for leg in range(3):
            pose = rrru3_slow.chain(leg, lengths, ideal, [drive[leg], *angles[leg]])
            np.testing.assert_allclose(pose[:3, 3], point, atol=1e-9)
            np.testing.assert_allclose(pose[:3, :3], np.eye(3), atol=1e-12)


def test_theta3_keeps_the_sign_that_eq_6_loses():
    robot = Rrru3()
    points = np.array([[-500.0, 80.0, 600.0], [-500.0, -80.0, 600.0]])
    third = robot.passive_angles(points, robot.inverse(points))[:, 0, 1]
    np.testing.assert_allclose(third, [np.arcsin(0.1), -np.arcsin(0.1)])


def test_R_and_r_enter_only_as_their_difference(rich_poses):
    points, theta = rich_poses
    robot = Rrru3(parameter_set="tied")
    both = robot.parameters.vector({"dR": 1.3, "dr": 1.3})
    np.testing.assert_allclose(robot.forward(theta, both, points), points, atol=1e-9)


def test_published_tied_and_identifiable_errors_say_the_same(rich_poses):
    points, theta = rich_poses
    tied = {"dtheta1": 0.001, "dL1": 0.4, "dL3": -0.2, "dR": -1.2, "dr": 0.9}
    published = {**{k: v for k, v in tied.items() if k[:2] != "dL"}, **{f"dL{leg}1": 0.4 for leg in (1, 2, 3)}}
    published |= {f"dL{leg}3": -0.2 for leg in (1, 2, 3)}
    positions = []
    for kind, values in (("tied", tied), ("published", published), ("identifiable", Rrru3().identifiable(tied))):
        robot = Rrru3(parameter_set=kind)
        positions.append(robot.forward(theta, robot.parameters.vector(values), points))
    np.testing.assert_allclose(positions[0], positions[1], atol=1e-9)
    np.testing.assert_allclose(positions[0], positions[2], atol=1e-9)
    assert Rrru3().identifiable(published) == Rrru3().identifiable(tied)
    assert np.linalg.norm(positions[0] - points, axis=1).min() > 0.1


def test_legs_that_differ_have_no_tied_error():
    assert np.isnan(Rrru3().identifiable({"dL11": 0.1, "dL21": 0.2})["dL1"])
    assert np.isnan(Rrru3().identifiable({"dL11": 0.3})["dL1"]) and Rrru3().identifiable({"dL11": 0.3})["dL2"] == 0.0
    assert Rrru3().identifiable({"dL1": 0.3, "dL21": 0.3})["dL1"] == 0.3


def test_out_of_reach_is_nan_in_batches_and_an_error_at_the_boundary():
    robot = Rrru3()
    points = np.array([[-400.0, 0.0, 600.0], [-400.0, 0.0, 2000.0], [0.0, 900.0, 600.0]])
    assert np.isnan(robot.inverse(points)).any(axis=1).tolist() == [False, True, True]
    with pytest.raises(UnreachableError, match=r"point 2 at \(-400.000, 0.000, 2000.000\) mm .* leg 1, 2, 3; 2 of 3"):
        robot.require_reachable(points)


def test_wrong_shapes_and_dimensions_are_refused():
    with pytest.raises(ValueError, match=r"expected shape \(n, 3\), got \(3,\)"):
        Rrru3().inverse([0.0, 0.0, 600.0])
    with pytest.raises(ConfigError, match="L1_mm is -1"):
        Rrru3(L1_mm=-1.0)
    with pytest.raises(ConfigError, match="parameter_set is 'all'"):
        Rrru3(parameter_set="all")
