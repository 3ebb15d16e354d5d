"""Searches along valleys that readings leave open, and estimates at values that were found elsewhere."""

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.optimize import least_squares

from rrru.errors import FitError
from rrru.estimation.parameters import Block, Parameters
from rrru.estimation.problem import Problem, WhiteNoise
from rrru.estimation.solver import estimate_at, solve


class Curved:
    """Readings (n, 1) of y = sin(A x) + (B x)^2."""

    def __init__(self, first, second, read):
        self._first, self._second, self._read = first, second, read

    def residual(self, values, /):
        """Read minus predicted (n, 1)."""
        return (self._read - np.sin(self._first @ values) - (self._second @ values) ** 2)[:, None]

    def jacobian(self, values, /):
        """Derivative (n, 1, p) of the residual."""
        sine = np.cos(self._first @ values)[:, None] * self._first
        return -(sine + 2.0 * (self._second @ values)[:, None] * self._second)[:, None]


class Circle:
    """One reading of the distance of (x, y) from (0, -r): the valley of least squares is an arc."""

    def __init__(self, radius, read):
        self._radius, self._read = radius, read

    def residual(self, values, /):
        """Read minus predicted (1, 1)."""
        return np.array([[self._read - np.hypot(values[0], values[1] + self._radius)]])

    def jacobian(self, values, /):
        """Derivative (1, 1, 2) of the residual."""
        step = values + np.array([0.0, self._radius])
        return -(step / np.linalg.norm(step))[None, None]


class Springs:
    """Deflections (n, 1) c_k (f_i + m) of springs under forces f (n,) and one more that is not known."""

    def __init__(self, spring, force, read):
        self._of, self._force, self._read, self.derivatives = np.eye(spring.max() + 1)[spring], force, read, 0

    def residual(self, values, /):
        """Read minus predicted (n, 1)."""
        return (self._read - self._of @ values[:-1] * (self._force + values[-1]))[:, None]

    def jacobian(self, values, /):
        """Derivative (n, 1, p) of the residual."""
        self.derivatives += 1
        own = self._of * (self._force + values[-1])[:, None]
        return -np.column_stack([own, self._of @ values[:-1]])[:, None]


def _problem(seed):
    """A Problem of four parameters and 30 readings with noise."""
    generator = np.random.default_rng(seed)
    first, second = generator.normal(size=(30, 4)), 0.2 * generator.normal(size=(30, 4))
    read = np.sin(first @ [0.3, -0.2, 0.1, 0.4]) + (second @ [0.3, -0.2, 0.1, 0.4]) ** 2
    own = Curved(first, second, read + 0.05 * generator.normal(size=30))
    sd, mean = np.array([0.5, 2.0, 0.1, 1.0]), np.array([0.0, 0.1, 0.0, -0.1])
    parameters = Parameters((Block.of("x", "abcd", ("mm",) * 4, sd, mean),))
    return Problem(own, parameters, WhiteNoise(0.05))


@pytest.mark.parametrize("noise", [1e-2, 1e-4, 1e-6])
def test_what_readings_do_not_determine_does_not_slow_the_search(noise):
    """The readings hold the arc and the prior the place on it, however narrow the valley of the readings is."""
    parameters = Parameters((Block.of("x", ("x", "y"), ("mm", "mm"), [3.0, 0.3]),))
    problem = Problem(Circle(400.0, 401.5), parameters, WhiteNoise(noise))
    found = solve(problem)
    assert found.end.converged and found.end.evaluations < 20
    assert np.abs(found.residual).max() < noise
    along = null_space(problem.observations.jacobian(found.values)[0])[:, 0]
    # along the arc the gradient of the prior is zero
    assert abs(along @ (found.values / parameters.sd**2)) < 1e-3 * np.linalg.norm(along / parameters.sd)
    assert found.rank == 1 and len(found.null_space) == 1


def test_a_parameter_that_no_reading_touches_stays_at_its_prior():
    problem = _problem(2)
    own = problem.observations
    blind = Curved(*(np.pad(one, ((0, 0), (0, 1))) for one in (own._first, own._second)), own._read)
    blocks = (*problem.parameters.blocks, Block.of("unseen", ("e",), ("rad",), 0.7, 0.2))
    found = solve(Problem(blind, Parameters(blocks), problem.whiten))
    assert found.value("e") == pytest.approx(0.2, abs=1e-12) and found.standard_error("e") == pytest.approx(0.7)
    np.testing.assert_allclose(found.values[:4], solve(problem).values, atol=1e-8)


def test_an_estimate_at_values_is_linearised_there():
    problem = _problem(3)
    found = solve(problem)
    again = estimate_at(problem, found.values, "found before", 7)
    np.testing.assert_allclose(again.covariance, found.covariance, rtol=1e-6)
    assert again.end.message == "found before" and again.end.evaluations == 7
    assert again.end.cost == pytest.approx(found.end.cost)
    with pytest.raises(FitError, match="the model predicts no reading at the values of a search; its end: lost"):
        estimate_at(problem, np.full(4, np.nan), "lost")


@pytest.mark.parametrize("start", [0.0, 2.0, 15.0])
@pytest.mark.parametrize("further", [4.0, 12.0])
def test_a_product_of_two_unknowns_is_followed_in_few_steps(further, start):
    """Where all forces are alike, only products of compliances and force are known well; scipy gives the minimum."""
    generator = np.random.default_rng(int(further))
    spring, force = np.arange(60) % 6, generator.uniform(4.0, 5.0, 60)
    compliance, noise = generator.uniform(0.5, 1.5, 6), 1e-3
    read = compliance[spring] * (force + further) + noise * generator.standard_normal(60)
    springs = Springs(spring, force, read)
    blocks = Block.of("c", [f"c{k}" for k in range(6)], ["mm"] * 6, 3.0), Block.of("m", ["m"], ["kg"], 0.5)
    problem = Problem(springs, Parameters(blocks), WhiteNoise(noise))
    found = solve(problem, [np.concatenate([np.zeros(6), [start]])])
    assert found.end.converged and springs.derivatives <= 16
    sd = np.concatenate([np.full(6, 3.0), [0.5]])

    def stack(values):
        return np.concatenate([springs.residual(values).ravel() / noise, values / sd])

    least = least_squares(
        stack, np.concatenate([compliance, [further]]), x_scale=sd, xtol=1e-15, ftol=1e-15, gtol=1e-15
    )
    assert found.end.cost <= least.cost * (1.0 + 1e-9)


def _springs_of_a_mixture(noise):
    """Problem of springs under forces that are alike, and one more force that is small or large; the compliances."""
    generator = np.random.default_rng(5)
    spring, force = np.arange(60) % 6, generator.uniform(4.0, 5.0, 60)
    compliance = generator.uniform(0.5, 1.5, 6)
    read = compliance[spring] * (force + 1.2) + noise * generator.standard_normal(60)
    blocks = (
        Block.of("c", [f"c{k}" for k in range(6)], ["mm"] * 6, 3.0),
        Block.of("m", ["m"], ["kg"], 0.1, wide_sd=2.0),
    )
    return Problem(Springs(spring, force, read), Parameters(blocks), WhiteNoise(noise)), compliance


@pytest.mark.parametrize("start", [0.0, 1.2, 15.0])
def test_a_second_start_that_ends_where_the_first_did_is_not_followed_to_its_end(start):
    """Its result is that of the first one, which it would have reached."""
    problem, compliance = _springs_of_a_mixture(1e-2)
    first = solve(problem, [np.append(compliance, 1.2)])
    own = solve(problem, [np.append(np.zeros(6), start)])
    assert solve(problem, [np.append(np.zeros(6), start)], known=[first]) is first
    np.testing.assert_allclose(own.values, first.values, rtol=0.0, atol=1e-4 * first.standard_errors.min())
    assert own.end.cost == pytest.approx(first.end.cost, abs=1e-8)


def test_a_second_start_that_ends_elsewhere_has_its_own_result():
    """Of y = x^2 both signs are as good."""
    curved = Curved(np.zeros((20, 2)), np.tile([1.0, 0.0], (20, 1)), 4.0 + 0.1 * np.arange(20) / 20.0)
    blocks = Block.of("x", ["x"], ["mm"], 5.0), Block.of("m", ["m"], ["kg"], 0.1, wide_sd=2.0)
    problem = Problem(curved, Parameters(blocks), WhiteNoise(0.1))
    first = solve(problem, [np.array([1.0, 0.0])])
    second = solve(problem, [np.array([-1.0, 0.0])], known=[first])
    assert first.value("x") == pytest.approx(-second.value("x")) and first.value("x") > 1.9
