"""3-PTT: paper B's Jacobian and singularities, the linear delta, and a general solver point by point."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from rrru.errors import ConfigError
from rrru.kinematics import singularity
from rrru.robots.ptt3 import Ptt3
from tests.reference import tripods_slow

# five positions, as paper B's Table 2 has; its own are lost
FIVE_MM = np.array(
    [[0.0, 0.0, -250.0], [40.0, 25.0, -230.0], [-60.0, 10.0, -260.0], [15.0, -70.0, -210.0], [-35.0, -45.0, -280.0]]
)


def _inside(count=200, seed=0):
    """Positions (count, 3) in mm that every inclination reaches."""
    return np.random.default_rng(seed).uniform([-70.0, -70.0, -300.0], [70.0, 70.0, -120.0], (count, 3))


def test_five_positions_go_through_inverse_and_forward():
    robot = Ptt3()
    np.testing.assert_allclose(robot.forward(robot.inverse(FIVE_MM)), FIVE_MM, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("degrees", [0.0, 30.0, 90.0])
def test_forward_equals_a_general_solver_point_by_point(degrees):
    robot = Ptt3(rail_inclination_rad=np.radians(degrees))
    points = _inside(40)
    sliders = robot.inverse(points)
    slow = [
        tripods_slow.ptt3_forward(
            b, robot.L_mm, robot.R_mm - robot.r_mm, robot.rail_inclination_rad, p + np.array([3.0, -2.0, -4.0])
        )
        for b, p in zip(sliders, points, strict=True)
    ]
    np.testing.assert_allclose(robot.forward(sliders), slow, rtol=0.0, atol=1e-8)


def test_upright_rails_are_a_linear_delta():
    """Carriage heights by Pythagoras, platform by linear algebra on three spheres, each tower with its own errors."""
    robot = Ptt3(rail_inclination_rad=np.pi / 2.0, parameter_set="distances")
    points = _inside(40)
    heights = robot.inverse(points)
    np.testing.assert_allclose(
        heights, [tripods_slow.upright_carriages(p, 350.0, 240.0) for p in points], rtol=0.0, atol=1e-9
    )
    values = {
        "da": 0.7,
        "dphi1": 0.004,
        "dphi2": -0.006,
        "db1": 0.3,
        "db2": -0.4,
        "db3": 0.9,
        "dL1": 0.5,
        "dL2": -0.8,
        "dL3": 0.2,
    }
    azimuth = np.array([0.004, 2.0 * np.pi / 3.0 - 0.006, 4.0 * np.pi / 3.0])
    slow = []
    for height in heights:
        centres = np.stack(
            [240.7 * np.cos(azimuth), 240.7 * np.sin(azimuth), height + np.array([0.3, -0.4, 0.9])], axis=1
        )
        slow.append(tripods_slow.trilaterate(centres, [350.5, 349.2, 350.2]))
    np.testing.assert_allclose(robot.forward(heights, robot.parameters.vector(values)), slow, rtol=0.0, atol=1e-8)


def test_a_rail_that_leans_moves_its_carriage_along_the_leaning_line():
    """Rise lifts the rail, swing and dphi turn it about the vertical: about its zero mark and about the base's
    centre.
    """
    robot = Ptt3(parameter_set="rails")
    slider = np.array([[50.0, 50.0, 50.0]])

    def end(**values):
        return robot.ends(slider, robot.numbers(robot.parameters.vector(values)))[0, 0]

    np.testing.assert_allclose(end(rise1=0.01), [240.0 + 50.0 * np.cos(0.01), 0.0, 50.0 * np.sin(0.01)], atol=1e-12)
    np.testing.assert_allclose(end(swing1=0.01), [240.0 + 50.0 * np.cos(0.01), 50.0 * np.sin(0.01), 0.0], atol=1e-12)
    np.testing.assert_allclose(end(dphi1=0.01), [290.0 * np.cos(0.01), 290.0 * np.sin(0.01), 0.0], atol=1e-12)


@pytest.mark.parametrize("degrees", [0.0, 30.0, 90.0])
def test_jacobian_of_eq_10_equals_finite_differences_of_the_inverse(degrees):
    robot, points = Ptt3(rail_inclination_rad=np.radians(degrees)), _inside()
    numeric = np.stack(
        [(robot.inverse(points + 1e-2 * e) - robot.inverse(points - 1e-2 * e)) / 2e-2 for e in np.eye(3)], axis=-1
    )
    np.testing.assert_allclose(robot.jacobian(points, robot.inverse(points)), numeric, rtol=1e-5, atol=1e-6)


def test_jacobian_of_eq_10_undoes_the_actuator_jacobian():
    robot, points = Ptt3(parameter_set="legs"), _inside()
    deviations = np.array([0.4, -0.3, 0.8, 0.5, -0.6, 0.7])
    sliders = robot.inverse(points, deviations)
    product = robot.jacobian(points, sliders, deviations) @ robot.actuator_jacobian(points, sliders, deviations)
    np.testing.assert_allclose(product, np.tile(np.eye(3), (len(points), 1, 1)), atol=1e-12)


@settings(max_examples=100, deadline=None)
@given(position=st.tuples(st.floats(-150, 150), st.floats(-150, 150), st.floats(-300, -20)))
def test_determinant_is_the_product_of_its_factors(position):
    robot = Ptt3()
    sliders = robot.inverse([position])
    if not np.isfinite(sliders).all():
        return
    z, kappa, d = robot.determinant_factors([position])
    direct = np.linalg.det(robot.jacobian([position], sliders))
    assert direct[0] == pytest.approx(-z[0] * kappa[0] / d[0].prod(), rel=1e-8)


def test_factors_are_those_of_level_rails_only():
    with pytest.raises(ConfigError, match=r"hold for horizontal rails, not for 0\.5 rad"):
        Ptt3(rail_inclination_rad=0.5).determinant_factors(FIVE_MM)


def test_platform_in_the_plane_of_the_rails_is_singular_in_both_ways():
    robot = Ptt3()
    flat = _inside() * [1.0, 1.0, 0.0]
    sliders = robot.inverse(flat)
    assert np.abs(np.linalg.det(robot.jacobian(flat, sliders))).max() < 1e-12
    assert singularity.translational_measure(robot, flat, sliders).max() < 1e-9
    assert singularity.constraint_measure(robot, flat, sliders).max() < 1e-9
    below, above = (flat + np.array([0.0, 0.0, z]) for z in (-5.0, 5.0))
    signs = [np.sign(np.linalg.det(robot.jacobian(p, robot.inverse(p)))) for p in (below, above)]
    assert (signs[0] == -signs[1]).all() and (signs[0] != 0).all()
    # free to turn about two axes at once: the determinant touches zero
    signs = [np.sign(singularity.constraint_determinant(robot, p, robot.inverse(p))) for p in (below, above)]
    assert (signs[0] == signs[1]).all() and (signs[0] != 0).all()


def test_a_zero_of_kappa_is_a_singularity_that_the_platform_crosses():
    """Along a ray from the centre the forces become coplanar; seen from above the links' ends then stand in line with
    the platform.
    """
    robot = Ptt3()

    def on_ray(share):
        return np.array([[share * -124.4, share * 207.6, -263.6]])

    root = brentq(lambda share: robot.determinant_factors(on_ray(share))[1][0], 0.1, 1.0, xtol=1e-14)
    point = on_ray(root)
    z, _, d = robot.determinant_factors(point)
    assert 0.1 < root < 1.0 and z[0] < -200.0 and d.min() > 1.0
    assert singularity.translational_measure(robot, point, robot.inverse(point))[0] < 1e-9
    assert singularity.constraint_measure(robot, point, robot.inverse(point))[0] > 0.01
    ends = robot.ends(robot.inverse(point), robot.numbers())[0]
    assert abs(np.cross(ends[1] - ends[0], ends[2] - ends[0])[2]) < 1e-6
    sides = [
        np.linalg.det(robot.jacobian(on_ray(root + step), robot.inverse(on_ray(root + step))))[0]
        for step in (-1e-3, 1e-3)
    ]
    assert sides[0] * sides[1] < 0.0


@pytest.mark.parametrize("radius_mm", [60.0, 300.0])
def test_constraint_singularity_where_the_links_stand_upright(radius_mm):
    """On the axis the couples' singular values are sqrt(3) D / L and twice sqrt(3/2) |Z| / L, whatever R - r is: R = r
    only puts b = 0 there.
    """
    robot = Ptt3(R_mm=radius_mm, r_mm=60.0)
    d = np.array([200.0, 100.0, 10.0, 1.0, 0.01, 1e-3])
    points = np.stack([np.zeros(6), np.zeros(6), -np.sqrt(350.0**2 - d**2)], axis=1)
    sliders = robot.inverse(points)
    np.testing.assert_allclose(sliders, np.tile(d[:, None] - (radius_mm - 60.0), (1, 3)), atol=1e-6)
    expected = np.minimum(np.sqrt(3.0) * d, np.sqrt(1.5) * np.abs(points[:, 2])) / 350.0
    np.testing.assert_allclose(singularity.constraint_measure(robot, points, sliders), expected, atol=1e-9)
    np.testing.assert_allclose(sliders[-1], 60.0 - radius_mm, atol=0.01)


def test_radii_do_not_enter_the_jacobian_at_a_position():
    narrow, wide = Ptt3(R_mm=60.0, r_mm=60.0), Ptt3()
    points = _inside()
    np.testing.assert_allclose(narrow.inverse(points), wide.inverse(points) + 240.0, atol=1e-10)
    pair = [robot.jacobian(points, robot.inverse(points)) for robot in (narrow, wide)]
    np.testing.assert_allclose(*pair, rtol=1e-9, atol=1e-12)


def test_couples_stand_across_the_bars_and_the_line_beside_them():
    robot, points = Ptt3(rail_inclination_rad=0.4), _inside()
    sliders = robot.inverse(points)
    constraint_moments, links = robot.constraint_moments(points, sliders), robot.link_directions(points, sliders)
    for axis in (robot.tangent, links):
        assert np.abs((constraint_moments * axis).sum(axis=-1)).max() < 1e-12
    np.testing.assert_allclose(np.linalg.norm(constraint_moments, axis=-1), 1.0)


def test_turning_the_robot_by_a_third_passes_the_sliders_on():
    robot, points = Ptt3(rail_inclination_rad=0.4), _inside()
    c, s = -0.5, np.sqrt(0.75)
    turned = np.stack([c * points[:, 0] - s * points[:, 1], s * points[:, 0] + c * points[:, 1], points[:, 2]], axis=1)
    np.testing.assert_allclose(robot.inverse(turned), np.roll(robot.inverse(points), 1, axis=1), atol=1e-9)
