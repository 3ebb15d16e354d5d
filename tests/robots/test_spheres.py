"""The point on three spheres: a property over random spheres, and a solution by linear algebra."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from rrru.robots.tripod import lower_intersection
from tests.reference import tripods_slow

_coordinate = st.floats(-500.0, 500.0)
_triangle = st.tuples(*[st.tuples(_coordinate, _coordinate, st.floats(-100.0, 100.0))] * 3)


def _plane(centres):
    """Unit normal, upwards, of the plane through three centres; rejects slivers and upright planes, where "lower" has
    no meaning.
    """
    first, second, third = np.array(centres)
    normal = np.cross(second - first, third - first)
    sides = np.linalg.norm([second - first, third - first, third - second], axis=1)
    assume(sides.min() > 1.0 and np.linalg.norm(normal) > 0.05 * sides.max() ** 2)
    normal = normal / np.linalg.norm(normal)
    assume(abs(normal[2]) > 0.05)
    return normal * np.sign(normal[2])


@settings(max_examples=200, deadline=None)
@given(centres=_triangle, across=st.tuples(_coordinate, _coordinate), depth=st.floats(1.0, 800.0))
def test_the_point_below_the_centres_comes_back(centres, across, depth):
    """A point below the centres' plane has three distances; the point with these distances that is below is that
    point.
    """
    normal = _plane(centres)
    on_plane = np.array(centres).mean(axis=0) + np.array(
        [*across, -(normal[0] * across[0] + normal[1] * across[1]) / normal[2]]
    )
    point = on_plane - depth * normal
    radii = np.linalg.norm(np.array(centres) - point, axis=1)
    found = lower_intersection(np.array(centres), radii)
    np.testing.assert_allclose(np.linalg.norm(np.array(centres) - found, axis=1), radii, rtol=1e-9)
    np.testing.assert_allclose(found, point, atol=1e-5)
    mirrored = found + 2.0 * ((np.array(centres[0]) - found) @ normal) * normal
    np.testing.assert_allclose(np.linalg.norm(np.array(centres) - mirrored, axis=1), radii, rtol=1e-9)
    assert found[2] < mirrored[2]


@settings(max_examples=200, deadline=None)
@given(centres=_triangle, radii=st.tuples(*[st.floats(50.0, 900.0)] * 3))
def test_any_spheres_equal_linear_algebra_or_nan(centres, radii):
    _plane(centres)
    found = lower_intersection(np.array(centres), radii)
    try:
        slow = tripods_slow.trilaterate(centres, radii)
    except ValueError:
        # where the two points fall together rounding decides whether there is one
        assert np.isnan(found).all() or np.abs(np.linalg.norm(np.array(centres) - found, axis=1) - radii).max() < 1e-4
        return
    if np.isnan(found).any():
        assert np.abs((slow - centres[0]) @ _plane(centres)) < 1e-3
    else:
        np.testing.assert_allclose(found, slow, atol=1e-3)


@pytest.mark.parametrize("order", [(0, 1, 2), (1, 2, 0), (2, 1, 0), (0, 2, 1)])
def test_the_order_of_the_spheres_does_not_matter(order):
    centres, radii = (
        np.array([[200.0, 0.0, 10.0], [-100.0, 170.0, 0.0], [-90.0, -180.0, 5.0]]),
        np.array([350.0, 360.0, 340.0]),
    )
    swapped = lower_intersection(centres[list(order)], radii[list(order)])
    np.testing.assert_allclose(swapped, lower_intersection(centres, radii), rtol=0.0, atol=1e-10)


def test_spheres_apart_share_no_point_and_the_others_are_untouched():
    centres = np.tile(np.array([[200.0, 0.0, 0.0], [-100.0, 170.0, 0.0], [-100.0, -170.0, 0.0]]), (2, 1, 1))
    found = lower_intersection(centres, [[50.0, 50.0, 50.0], [350.0, 350.0, 350.0]])
    assert np.isnan(found[0]).all() and np.isfinite(found[1]).all()
    assert np.isnan(lower_intersection(np.zeros((3, 3)), [1.0, 1.0, 1.0])).all()
