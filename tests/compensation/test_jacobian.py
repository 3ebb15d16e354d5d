"""Two ways from a position error to slider values, against each other and against the robot."""

import numpy as np
import pytest

from rrru.compensation.jacobian import through_inverse, through_jacobian
from rrru.robots.ptt3 import Ptt3

ROBOT = Ptt3(parameter_set="rails")


@pytest.fixture
def positions():
    generator = np.random.default_rng(2)
    return generator.uniform((-90.0, -90.0, -280.0), (90.0, 90.0, -220.0), (200, 3))


def test_the_exact_inverse_puts_the_real_robot_on_the_target_to_second_order(positions):
    """A robot with errors e stands at p + dp(p); commanded to p - dp(p) it is off by dp'(p) dp, some micrometres."""
    deviations = 0.3 * ROBOT.parameters.vector({"db1": 1.0, "db2": -0.7, "dL2": 0.8, "rise3": 1e-3})
    stands = ROBOT.forward(ROBOT.inverse(positions), deviations)
    again = ROBOT.forward(through_inverse(ROBOT, positions, stands - positions), deviations)
    before, after = (np.linalg.norm(where - positions, axis=1) for where in (stands, again))
    assert (after < 0.01 * before.max()).all() and before.max() > 0.2


def test_the_jacobian_s_sliders_differ_from_the_exact_ones_by_the_second_order(positions):
    """Half the error, a quarter of the difference; for 0.3 mm it is below the encoder's micrometre."""
    direction = np.random.default_rng(3).standard_normal(positions.shape)
    direction *= 0.3 / np.linalg.norm(direction, axis=1, keepdims=True)
    sizes = []
    for share in (1.0, 0.5, 0.25):
        difference = through_inverse(ROBOT, positions, share * direction) - through_jacobian(
            ROBOT, positions, share * direction
        )
        sizes.append(np.linalg.norm(difference))
    np.testing.assert_allclose(np.array(sizes[:2]) / sizes[1:], 4.0, rtol=0.01)
    first = through_inverse(ROBOT, positions, direction) - through_jacobian(ROBOT, positions, direction)
    assert np.abs(first).max() < 1e-3


def test_without_an_error_both_are_the_inverse_kinematics(positions):
    nothing = np.zeros_like(positions)
    np.testing.assert_array_equal(through_inverse(ROBOT, positions, nothing), ROBOT.inverse(positions))
    np.testing.assert_array_equal(through_jacobian(ROBOT, positions, nothing), ROBOT.inverse(positions))
