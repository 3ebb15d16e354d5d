"""Platforms on more bars than they have degrees of freedom, against springs of one section at their least energy."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from rrru.robots.cable import cable

_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
# anchors of a hall that is long, so that cables differ in length by far
_ANCHORS = _CORNERS * [2000.0, 900.0, 700.0] + [0.0, 0.0, 700.0]
_POINTS = (_CORNERS * [1.0, 1.0, -1.0]) @ Rotation.from_euler("z", 0.5).as_matrix().T * [150.0, 120.0, 80.0]
_HOME = np.array([300.0, 100.0, 500.0])
_ROBOT = cable(_ANCHORS, _POINTS, _HOME, stroke_mm=1500.0)


def _springs(lengths_mm, anchors_mm):
    """Place (3,) of a platform on springs of these unloaded lengths (8,), whose stiffness is EA over the length."""

    def energy(pose):
        points = pose[:3] + Rotation.from_rotvec(pose[3:] / 500.0).apply(_POINTS)
        stretch = np.linalg.norm(points - anchors_mm, axis=1) - lengths_mm
        return (stretch**2 / lengths_mm).sum()

    start = np.r_[_ROBOT.legs.home_mm, np.zeros(3)]
    for _ in range(3):
        start = minimize(energy, start, method="BFGS", options={"gtol": 1e-10}).x
    return start[:3]


@pytest.mark.parametrize("seed", range(4))
def test_cables_that_contradict_each_other_are_elastic_ones_at_their_least_energy(seed):
    generator = np.random.default_rng(seed)
    place = _HOME + generator.uniform(-1.0, 1.0, 3) * [900.0, 300.0, 250.0]
    driven = _ROBOT.inverse(place[None])
    off = 2.0 * generator.standard_normal((8, 3))
    twists = np.zeros((1, len(_ROBOT.legs.sites), 6))
    for number, leg in enumerate(_ROBOT.legs.legs):
        twists[0, _ROBOT.legs.site_numbers[leg.joints[0].name], :3] = off[number]
    lengths = np.linalg.norm(place + _POINTS - _ANCHORS, axis=1)
    expected = _springs(lengths, _ANCHORS + off)
    found = _ROBOT.solve(driven, _ROBOT.forward(driven), twists).position_mm[0]
    assert np.linalg.norm(expected - place) > 0.3
    np.testing.assert_allclose(found, expected, atol=0.004)


def test_small_errors_move_the_platform_as_their_derivatives_say():
    """By lengths of cables, from differences of exact poses."""
    place = _HOME + np.array([[500.0, -200.0, 100.0], [-700.0, 150.0, -150.0]])
    driven = _ROBOT.inverse(place)
    jacobian = _ROBOT.actuator_jacobian(place, driven)
    step = 1e-3
    for number, change in enumerate(step * np.eye(8)):
        moved = [_ROBOT.forward(driven + sign * change) for sign in (1.0, -1.0)]
        np.testing.assert_allclose(jacobian[:, :, number], (moved[0] - moved[1]) / (2.0 * step), atol=1e-6)
    np.testing.assert_allclose(_ROBOT.forward(driven), place, atol=1e-7)
