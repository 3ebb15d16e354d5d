"""Heights and distances as residuals: against an obvious implementation and finite differences."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import fsolve

from rrru.errors import FitError
from rrru.estimation.observations.probed_heights import ProbedHeights
from rrru.robots.linear_delta import linear_delta

AZIMUTH = np.radians([210.0, 330.0, 90.0])
ARMS, ENDSTOPS, RADIUS = (215.0, 216.0, 214.5), (236.0, 237.0, 236.5), 101.0


def residuals(parameter_set="distances", heights=7, distances=5, weight=3.0):
    """Residuals of made-up readings at random places."""
    generator = np.random.default_rng(4)
    robot = linear_delta(RADIUS, AZIMUTH, ARMS, ENDSTOPS, parameter_set)
    sliders = robot.inverse(generator.uniform(-50.0, 50.0, (heights + 2 * distances, 3)))
    ends = sliders[heights:].reshape(distances, 2, 3)
    return ProbedHeights(
        robot,
        sliders[:heights],
        generator.uniform(-1.0, 1.0, heights),
        ends,
        generator.uniform(50.0, 70.0, distances),
        weight,
    )


def slow_place(slider, numbers):
    """The place whose distances from the three carriages are the arms, below them; numbers: radius, angles, endstops,
    arms.
    """
    radius, angles, endstops, arms = numbers
    carriages = [
        np.array([radius * np.cos(angle), radius * np.sin(angle), endstop + np.sqrt(arm**2 - radius**2) + way])
        for angle, endstop, arm, way in zip(angles, endstops, arms, slider, strict=True)
    ]
    below = np.array([0.0, 0.0, min(c[2] for c in carriages) - 150.0])
    return fsolve(
        lambda p: [np.linalg.norm(p - c) - arm for c, arm in zip(carriages, arms, strict=True)], below, xtol=1e-13
    )


def test_residuals_are_measured_less_slowly_computed_readings():
    own = residuals()
    deviations = np.array([0.4, 0.003, -0.002, 0.3, -0.2, 0.1, 0.5, -0.4, 0.3])
    legs = own.mechanism.numbers(deviations)
    root = np.sqrt(legs[:, 1] ** 2 - legs[:, 2] ** 2)
    numbers = RADIUS + 0.4, np.add(AZIMUTH, [0.003, -0.002, 0.0]), legs[:, 0] - root, np.add(ARMS, deviations[6:])
    expected = [
        np.sqrt(3.0) * (z - slow_place(b, numbers)[2]) for b, z in zip(own.height_actuators, own.height_mm, strict=True)
    ]
    for (first, second), length in zip(own.distance_actuators, own.distance_mm, strict=True):
        expected.append(length - np.linalg.norm(slow_place(first, numbers) - slow_place(second, numbers)))
    np.testing.assert_allclose(own.residual(deviations)[:, 0], expected, atol=1e-8)
    assert own.residual(deviations).shape == (12, 1) and len(own) == 12


@pytest.mark.parametrize(("parameter_set", "distances"), [("heights", 0), ("heights", 5), ("distances", 5)])
def test_the_jacobian_is_that_of_finite_differences(parameter_set, distances):
    own = residuals(parameter_set, distances=distances)
    at = np.random.default_rng(1).uniform(-1e-3, 1e-3, len(own.mechanism.parameters))
    step = 1e-4
    slope = [(own.residual(at + step * e) - own.residual(at - step * e)) / (2.0 * step) for e in np.eye(len(at))]
    np.testing.assert_allclose(own.jacobian(at), np.stack(slope, axis=-1), rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("reading", [0, 6, 7, 11])
def test_leaving_a_reading_out_leaves_the_others_as_they_are(reading):
    own = residuals()
    deviations = np.full(9, 1e-3)
    np.testing.assert_array_equal(
        own.without(reading).residual(deviations), np.delete(own.residual(deviations), reading, axis=0)
    )
    np.testing.assert_allclose(
        own.without(reading).jacobian(deviations), np.delete(own.jacobian(deviations), reading, axis=0), atol=1e-12
    )


def test_readings_that_cannot_be_are_refused():
    own = residuals()
    with pytest.raises(FitError, match="not finite"):
        replace(own, height_mm=np.append(own.height_mm[1:], np.nan))
    far = own.distance_actuators.copy()
    far[2, 1] = [0.0, -500.0, 500.0]
    with pytest.raises(FitError, match="1 of 12 readings' places, the first is reading 10"):
        replace(own, distance_actuators=far)
