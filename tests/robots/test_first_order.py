"""The first-order map from leg errors to the platform against differences of the full spatial closure."""

import numpy as np
import pytest

from rrru.effects.protocol import PLACES, Contribution
from rrru.plant.spatial import SpatialGeometry
from rrru.robots.first_order import FirstOrder
from rrru.robots.rrru3 import Rrru3

ROBOT = Rrru3()
ERRORS = np.array([5e-3, -3e-3, 2e-3, 1.5, -0.8, 1.2, -1.0])
COUNT = 12
LENGTH, ANGLE = 1e-2, 1e-5


@pytest.fixture(scope="module", params=[None, ERRORS], ids=["nominal", "with errors"])
def setting(request, rich_poses):
    """Positions, drive angles, errors and the map at some poses that fit one another."""
    position, deviations = rich_poses[0][:COUNT], request.param
    theta = ROBOT.inverse(position, deviations)
    return position, theta, deviations, FirstOrder(ROBOT, position, theta, deviations)


def _closed(setting, contribution):
    """Positions (n, 3) of the spatial closure under a contribution; r - R is changed by R."""
    position, theta, deviations, _ = setting
    legs = ROBOT.legs(deviations)
    lengths = np.stack([ROBOT.r_mm - legs[:, 4], *legs.T[1:4], np.full(3, ROBOT.r_mm)], axis=-1)
    geometry = SpatialGeometry(
        np.array(ROBOT.azimuth_rad), lengths + contribution.length_mm, np.zeros((3, 6, 6)) + contribution.displacement
    )
    guess = ROBOT.passive_angles(position, theta, deviations)
    solution = geometry.solve(theta + legs[:, 0] + contribution.drive, guess, contribution.joint_mm)
    assert solution.converged.all()
    return solution.position_mm


def _difference(setting, part, shape, at, step):
    """Central difference (n, 3) of the closure along one entry of a contribution's part."""
    one = np.zeros(shape)
    one[at] = step
    return (_closed(setting, Contribution(**{part: one})) - _closed(setting, Contribution(**{part: -one}))) / (
        2.0 * step
    )


def _moved(setting, part, shape, at):
    """The first-order map's move (n, 3) per unit of one entry."""
    one = np.zeros(shape)
    one[at] = 1.0
    return setting[3].move(Contribution(**{part: one}))


def _agree(setting, part, shape, at, step):
    expected = _difference(setting, part, shape, at, step)
    np.testing.assert_allclose(_moved(setting, part, shape, at), expected, atol=2e-6 * max(np.abs(expected).max(), 1.0))


@pytest.mark.parametrize("leg", range(3))
def test_drive_errors_move_the_platform_as_the_closure_says(setting, leg):
    _agree(setting, "drive", (COUNT, 3), (slice(None), leg), ANGLE)


@pytest.mark.parametrize("leg", range(3))
@pytest.mark.parametrize("link", range(5))
def test_length_errors_move_the_platform_as_the_closure_says(setting, leg, link):
    _agree(setting, "length_mm", (COUNT, 3, 5), (slice(None), leg, link), LENGTH)


@pytest.mark.parametrize("leg", range(3))
@pytest.mark.parametrize("axis", range(3))
def test_joint_shifts_move_the_platform_as_the_closure_says(setting, leg, axis):
    _agree(setting, "joint_mm", (COUNT, 3, 3), (slice(None), leg, axis), LENGTH)


@pytest.mark.parametrize("leg", range(3))
@pytest.mark.parametrize("place", range(len(PLACES)), ids=PLACES)
def test_displacements_at_every_place_move_the_platform_as_the_closure_says(setting, leg, place):
    for axis in range(6):
        _agree(setting, "displacement", (3, len(PLACES), 6), (leg, place, axis), LENGTH if axis < 3 else ANGLE)


@pytest.mark.parametrize("axis", range(6))
def test_a_frame_moves_the_reading_as_a_rigid_motion(setting, axis):
    frame = np.zeros(6)
    frame[axis] = 1.0
    position = setting[0]
    cross = np.cross(frame[3:], position)
    np.testing.assert_allclose(
        _moved(setting, "frame", 6, axis), np.broadcast_to(frame[:3], position.shape) + cross, atol=1e-9
    )


def test_random_contributions_add_up_to_first_order(setting):
    """All parts at once: what the closure does beyond the map falls with the square of the size."""
    generator = np.random.default_rng(3)
    size = np.repeat([1.0, 1e-3], 3)
    draws = {
        "drive": 1e-3 * generator.normal(size=(COUNT, 3)),
        "length_mm": generator.normal(size=(COUNT, 3, 5)),
        "joint_mm": generator.normal(size=(COUNT, 3, 3)),
        "displacement": size * generator.normal(size=(3, len(PLACES), 6)),
    }
    still = _closed(setting, Contribution())
    left = []
    for factor in (0.1, 0.01):
        contribution = Contribution(**{part: factor * value for part, value in draws.items()})
        left.append(np.abs(_closed(setting, contribution) - still - setting[3].move(contribution)).max())
    assert left[1] < 0.02 * left[0] and left[0] < 0.2


def test_the_response_without_turning_is_the_actuator_jacobian(setting):
    position, theta, deviations, first_order = setting
    by_drive = first_order.response[..., 0] * first_order.drive[:, None, :]
    np.testing.assert_allclose(by_drive, ROBOT.actuator_jacobian(position, theta, deviations), rtol=1e-9, atol=1e-9)


def test_the_errors_of_the_calibration_are_contributions_too(setting):
    """dL1 to dL3 on all legs and da as a change of r: columns of the error Jacobian."""
    position, theta, deviations, first_order = setting
    expected = ROBOT.parameter_jacobian(position, theta, deviations)
    for column, link in ((3, 1), (4, 2), (5, 3), (6, 4)):
        length = np.zeros((COUNT, 3, 5))
        length[..., link] = 1.0
        np.testing.assert_allclose(
            first_order.move(Contribution(length_mm=length)), expected[..., column], rtol=1e-9, atol=1e-9
        )


def test_a_displacement_that_only_shifts_a_platform_joint_along_the_leg_equals_its_length(setting):
    """Shift of the wrist along the forearm is L3; shift of the platform's place along the radius is minus r."""
    first_order = setting[3]
    for place, link, sign in (
        ("base", 0, 1.0),
        ("elbow", 1, 1.0),
        ("knee", 2, 1.0),
        ("wrist", 3, 1.0),
        ("platform", 4, -1.0),
    ):
        displacement, length = np.zeros((3, 6, 6)), np.zeros((COUNT, 3, 5))
        displacement[1, PLACES.index(place), 0] = 1.0
        length[:, 1, link] = sign
        moved = first_order.move(Contribution(displacement=displacement))
        np.testing.assert_allclose(moved, first_order.move(Contribution(length_mm=length)), atol=1e-9)


def test_a_leg_turned_about_its_drive_axis_is_a_drive_error(setting):
    displacement = np.zeros((3, 6, 6))
    displacement[2, 0, 4] = -1.0
    drive = np.zeros((COUNT, 3))
    drive[:, 2] = 1.0
    moved = setting[3].move(Contribution(displacement=displacement))
    np.testing.assert_allclose(moved, setting[3].move(Contribution(drive=drive)), rtol=1e-9, atol=1e-9)
