"""Lengths as a kind of reading: places are the best, derivatives are finite differences, starts are the machine."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import optimize

from rrru.errors import FitError
from rrru.estimation.observations.length_starts import align_to_frame, solve_anchors
from rrru.estimation.observations.multilateration import Multilateration
from rrru.estimation.parameters import Block, Parameters
from rrru.estimation.solver import solve
from tests.estimation.observations.machines import machine, starts, values_of


@pytest.mark.parametrize(("count", "dimensions"), [(3, 2), (4, 2), (7, 3)])
def test_slopes_are_finite_differences(count, dimensions):
    lengths, _, places = machine(1, count, dimensions, common=True)
    full = np.eye(len(lengths.origin))
    routing = np.random.default_rng(2).integers(0, 3, (count, count)).astype(float)
    lengths = replace(lengths, basis=full, routing=routing, places_mm=places)
    values = np.random.default_rng(3).normal(0.0, 300.0, len(full))
    slopes, by_place = lengths.slopes(values)
    np.testing.assert_array_equal(lengths.jacobian(values), slopes)
    step = 1e-4
    for k in range(len(values)):
        up, down = (lengths.residual(values + sign * step * full[k]) for sign in (1.0, -1.0))
        np.testing.assert_allclose(slopes[..., k], (up - down) / (2.0 * step), rtol=1e-5, atol=1e-5)
    for axis in range(dimensions):
        shift = step * np.eye(dimensions)[axis]
        up, down = (replace(lengths, places_mm=places + sign * shift).residual(values) for sign in (1.0, -1.0))
        np.testing.assert_allclose(by_place[..., axis], (up - down) / (2.0 * step), rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize(("count", "dimensions"), [(3, 2), (4, 2), (7, 3)])
def test_derivative_with_eliminated_places_is_a_finite_difference(count, dimensions):
    """At residuals of zero, where the second derivatives that are left out of it do not act."""
    lengths, anchors, places = machine(1, count, dimensions, noise_mm=0.0, missing_mm=30.0, common=True)
    values = values_of(lengths, anchors, 30.0)
    np.testing.assert_allclose(lengths.places(values), places, atol=1e-6)
    for k, direction in enumerate(np.eye(len(values))):
        up, down = (lengths.residual(values + sign * 1e-2 * direction) for sign in (1.0, -1.0))
        np.testing.assert_allclose(lengths.jacobian(values)[..., k], (up - down) / 2e-2, atol=1e-5)


@pytest.mark.parametrize("cauchy_mm", [np.inf, 0.7])
def test_gradient_with_eliminated_places_is_exact(cauchy_mm):
    """Also at residuals that are not small, and under Cauchy's loss."""
    lengths, anchors, _ = machine(2, noise_mm=3.0, common=True)
    lengths = replace(lengths, cauchy_mm=cauchy_mm, used=np.random.default_rng(0).uniform(size=(40, 4)) > 0.05)
    values = values_of(lengths, anchors, 20.0)

    def cost(at):
        square = lengths.whiten(lengths.residual(at)) ** 2
        return 0.5 * (square if np.isinf(cauchy_mm) else cauchy_mm**2 * np.log1p(square / cauchy_mm**2)).sum()

    white = lengths.whiten(lengths.residual(values))
    slope = white if np.isinf(cauchy_mm) else white / (1.0 + (white / cauchy_mm) ** 2)
    gradient = np.einsum("ik,ikp->p", slope, lengths.whiten(lengths.jacobian(values)))
    for k, direction in enumerate(np.eye(len(values))):
        step = 1e-4 * direction
        assert gradient[k] == pytest.approx((cost(values + step) - cost(values - step)) / 2e-4, rel=1e-4, abs=1e-4)


@pytest.mark.parametrize(("dimensions", "flat"), [(2, False), (3, False), (3, True)])
@pytest.mark.parametrize("cauchy_mm", [np.inf, 0.5])
def test_places_are_those_of_many_searches(dimensions, flat, cauchy_mm):
    """Of scipy from starts all over the room, with bad and unused readings."""
    generator = np.random.default_rng(3)
    anchors = generator.uniform(-1500.0, 1500.0, (dimensions + 3, dimensions))
    anchors[:, -1] *= 0.01 if flat else 1.0
    places = generator.uniform(-600.0, 600.0, (12, dimensions))
    heights = np.zeros(len(anchors))
    lengths = np.linalg.norm(places[:, None] - anchors, axis=-1) + 0.2 * generator.normal(size=(12, len(anchors)))
    lengths[4, 1] += 80.0
    lengths[9, 2] -= 30.0
    used = np.ones(lengths.shape, dtype=bool)
    used[7, 0] = False
    rows = Multilateration(anchors, heights, lengths, used)
    found = rows.least_squares() if np.isinf(cauchy_mm) else rows.least_cauchy(cauchy_mm)
    for row in range(12):

        def cost(place, row=row):
            square = (lengths[row] - np.linalg.norm(place - anchors, axis=1))[used[row]] ** 2
            return (square if np.isinf(cauchy_mm) else cauchy_mm**2 * np.log1p(square / cauchy_mm**2)).sum()

        slow = min(
            optimize.minimize(cost, begin, method="Nelder-Mead", options={"xatol": 1e-7, "fatol": 1e-12}).fun
            for begin in [places[row], *generator.uniform(-900.0, 900.0, (8, dimensions))]
        )
        assert cost(found[row]) < slow + 1e-6


def test_a_row_without_readings_stays_finite_and_is_not_counted():
    lengths, anchors, _ = machine(4)
    used = np.ones(lengths.counted.shape, dtype=bool)
    used[5] = False
    without = lengths.rows(np.arange(40) != 5)
    lengths, values = replace(lengths, used=used, noise_mm=0.3), values_of(lengths, anchors)
    assert np.isfinite(lengths.residual(values)).all() and np.isfinite(lengths.jacobian(values)).all()
    assert lengths.normalization(values) == pytest.approx(replace(without, noise_mm=0.3).normalization(values))


@pytest.mark.parametrize(("count", "dimensions"), [(3, 2), (4, 2), (5, 2), (6, 3)])
def test_closed_form_start_is_the_machine_where_nothing_is_missing(count, dimensions):
    lengths, anchors, places = machine(4, count, dimensions, noise_mm=0.0)
    found = align_to_frame(solve_anchors(lengths.counted**2 - lengths.heights_mm**2, dimensions))
    # lengths do not distinguish a space from its mirror image
    sign = np.array([1.0, 1.0, np.sign(anchors[3, 2] * found[3, 2]) if dimensions == 3 else 1.0])[:dimensions]
    np.testing.assert_allclose(found * sign, anchors, atol=1e-4)
    np.testing.assert_allclose(lengths.places(values_of(lengths, anchors)), places, atol=1e-6)


def test_one_solve_from_all_starts_finds_the_machine():
    lengths, anchors, _ = machine(5, missing_mm=90.0, common=True)
    names = [str(number) for number in range(lengths.basis.shape[1])]
    flat = Parameters((Block.of("machine", names, ["mm"] * len(names), np.inf),))
    estimate = solve(lengths.problem(flat), starts(lengths))
    assert estimate.end.converged and estimate.rank == len(names)
    np.testing.assert_allclose(estimate.values, values_of(lengths, anchors, 90.0), atol=30.0)
    # the noise is stated as 1 mm and is 0.3
    miss = (estimate.values - values_of(lengths, anchors, 90.0)) / (0.3 * estimate.standard_errors)
    assert np.abs(miss).max() < 4.0


def test_lengths_over_several_anchors_need_measured_places():
    lengths, _, _ = machine(0)
    with pytest.raises(FitError, match="measured places"):
        replace(lengths, routing=np.ones((4, 4)))
