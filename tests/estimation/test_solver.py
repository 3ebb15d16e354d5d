"""The solver against scipy on the same objective, and what it says where a problem has no or many answers."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy import optimize
from scipy.stats import multivariate_normal

from rrru.errors import FitError
from rrru.estimation.estimate import numerical_rank, triangle_of
from rrru.estimation.noise_model import NoiseModel
from rrru.estimation.parameters import Block, Parameters
from rrru.estimation.problem import Problem
from rrru.estimation.solver import LOSSES, SolverOptions, _between, solve

NOISE = 0.1


@dataclass(frozen=True)
class Bent:
    """Readings (n, 1) of a linear model that bends: y = A x + bend sin(0.3 A x)."""

    matrix: np.ndarray
    data: np.ndarray
    bend: float = 0.0

    def predict(self, values):
        """Readings without noise."""
        line = self.matrix @ values
        return line + self.bend * np.sin(0.3 * line)

    def residual(self, values):
        """Readings minus prediction."""
        return (self.data - self.predict(values))[:, None]

    def jacobian(self, values):
        """Derivative of the residual."""
        slope = 1.0 + 0.3 * self.bend * np.cos(0.3 * self.matrix @ values)
        return -(slope[:, None] * self.matrix)[:, None]


def _block(count, sd=np.inf, **rest):
    return Parameters((Block.of("x", [f"x{k}" for k in range(count)], ["mm"] * count, sd, **rest),))


def _problem(seed, count=6, rows=80, bend=0.4, sd=np.inf, loss="linear", outliers=0, **rest):
    generator = np.random.default_rng(seed)
    matrix = generator.normal(size=(rows, count)) * 10.0 ** generator.uniform(-3.0, 3.0, count)
    truth = generator.normal(size=count) / np.abs(matrix).max(axis=0)
    made = Bent(matrix, np.zeros(rows), bend)
    data = made.predict(truth) + NOISE * generator.standard_normal(rows)
    data[:outliers] += 40.0 * NOISE
    parameters = _block(count, sd, **rest)
    return Problem(Bent(matrix, data, bend), parameters, lambda v: v / NOISE, loss, 2.0), truth


def _stacked(problem):
    """Residual and derivative of the whitened stack of readings and priors, as plain least squares takes them."""
    prior = np.isfinite(problem.parameters.sd)
    weight = 1.0 / problem.parameters.sd[prior]

    def residual(values):
        off = (values - problem.parameters.mean)[prior] * weight
        return np.concatenate([problem.whiten(problem.observations.residual(values)).ravel(), off])

    def jacobian(values):
        rows = problem.whiten(problem.observations.jacobian(values)).reshape(-1, len(values))
        return np.concatenate([rows, np.diag(1.0 / problem.parameters.sd)[prior]])

    return residual, jacobian


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("sd", [np.inf, 0.05])
def test_it_ends_at_the_minimum_of_least_squares_on_the_whitened_stack(seed, sd):
    problem, _ = _problem(seed, sd=sd)
    found = solve(problem, [np.zeros(6)])
    residual, jacobian = _stacked(problem)
    tight = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15, "x_scale": "jac"}
    plain = optimize.least_squares(residual, np.zeros(6), jac=jacobian, **tight)
    assert found.end.converged
    assert found.end.cost == pytest.approx(plain.cost, rel=1e-9)
    errors = np.sqrt(np.diag(np.linalg.inv(jacobian(plain.x).T @ jacobian(plain.x))))
    np.testing.assert_allclose(found.standard_errors, errors, rtol=1e-5)
    assert (np.abs(found.values - plain.x) < 1e-5 * errors).all()


@pytest.mark.parametrize("seed", range(4))
def test_bounds_hold_and_the_rest_is_fitted_as_if_the_bounded_were_fixed(seed):
    problem, truth = _problem(seed)
    low = np.where(np.arange(6) == 2, truth + 5.0 * np.abs(truth) + 1.0, -np.inf)
    bounded, _ = _problem(seed, bounds=(low, np.inf))
    found = solve(bounded, [np.zeros(6)])
    assert found.at_bound.tolist() == [k == 2 for k in range(6)] and np.isnan(found.standard_errors[2])
    residual, jacobian = _stacked(problem)
    others = np.arange(6) != 2

    def full(rest):
        return np.insert(rest, 2, low[2])

    plain = optimize.least_squares(
        lambda rest: residual(full(rest)),
        found.values[others] * 1.001,
        jac=lambda rest: jacobian(full(rest))[:, others],
        x_scale="jac",
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
    )
    assert found.end.cost == pytest.approx(plain.cost, rel=1e-9)


@pytest.mark.parametrize("seed", range(40))
def test_ill_conditioned_readings_between_bounds_end_where_the_bounded_least_squares_problem_does(seed):
    """A parameter that leaves its bounds in a step may belong inside of them, once others are held at theirs."""
    generator = np.random.default_rng(seed)
    left, right = (np.linalg.qr(generator.standard_normal((count, 7))).Q for count in (78, 7))
    matrix = left * np.logspace(0.0, -4.0, 7) @ right.T
    data = matrix @ generator.uniform(-2.0, 2.0, 7) + 0.01 * generator.standard_normal(78)
    parameters = _block(7, bounds=(-np.ones(7), np.ones(7)))
    found = solve(Problem(Bent(matrix, data), parameters, lambda v: v / NOISE), [np.zeros(7)])
    best = optimize.lsq_linear(matrix / NOISE, data / NOISE, (-1.0, 1.0), method="bvls", tol=1e-14, max_iter=200)
    assert found.end.converged and found.end.cost == pytest.approx(best.cost, rel=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_least_squares_between_bounds_that_few_of_many_parameters_reach(seed):
    """Against the same problem with bounds for all; a third of the parameters has none."""
    generator = np.random.default_rng(seed)
    rows = generator.standard_normal((90, 30)) + 2.0 * generator.standard_normal((90, 1))
    triangle = triangle_of(np.column_stack([rows, 3.0 * generator.standard_normal(90)]))
    high = np.where(np.arange(30) % 3, 0.1, np.inf)
    found, side = _between(triangle, -high, high)
    best = optimize.lsq_linear(triangle[:-1, :-1], -triangle[:-1, -1], (-high, high), method="bvls", tol=1e-14)
    np.testing.assert_allclose(found, best.x, rtol=0.0, atol=1e-9)
    assert side.tolist() == best.active_mask.tolist() and 0 < np.count_nonzero(side) < 20


@pytest.mark.parametrize("loss", [one for one in LOSSES if one != "linear"])
def test_robust_losses_end_where_scipy_ends(loss):
    problem, _ = _problem(1, loss=loss, outliers=8)
    found = solve(problem, [np.zeros(6)])
    residual, jacobian = _stacked(problem)
    plain = optimize.least_squares(
        residual, np.zeros(6), jac=jacobian, loss=loss, f_scale=2.0, x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14
    )
    assert found.end.cost == pytest.approx(plain.cost, rel=1e-8)


def test_a_direction_that_no_reading_sees_stays_at_its_prior_mean_and_is_named():
    problem, _ = _problem(2, sd=3e3, mean=0.5)
    blind = problem.observations.matrix.copy()
    blind[:, 4] = 0.0
    found = solve(Problem(Bent(blind, problem.observations.data, 0.4), problem.parameters, problem.whiten))
    assert found.rank == 5 and found.value("x4") == 0.5 and found.standard_error("x4") == pytest.approx(3e3)
    (direction,) = found.null_space
    np.testing.assert_allclose(np.abs(direction) / np.abs(direction).max(), np.eye(6)[4], atol=1e-9)


def test_priors_leave_the_variance_of_what_the_readings_see_in_a_sum_only():
    """Columns 1 and 4 are the same: the priors divide their sum, the readings determine the others."""
    problem, _ = _problem(3, bend=0.0, sd=0.5)
    problem.observations.matrix[:, 4] = problem.observations.matrix[:, 1]
    shares = solve(problem, [np.zeros(6)]).prior_shares()
    # by drawing the priors' means: how far the estimate follows them, over its variance
    stacked = np.concatenate([problem.observations.matrix / NOISE, np.eye(6) / 0.5])
    means = 0.5 * np.random.default_rng(0).standard_normal((6, 4000))
    followed = np.linalg.lstsq(stacked, np.concatenate([np.zeros((80, 4000)), means / 0.5]), rcond=None)[0]
    variance = np.diag(np.linalg.inv(stacked.T @ stacked))
    np.testing.assert_allclose(shares, followed.var(axis=1) / variance, rtol=0.1)
    assert shares[1] > 0.95 and shares[4] > 0.95 and (shares < 1e-3).sum() == 3


def test_without_a_prior_it_has_no_finite_error():
    problem, _ = _problem(2)
    blind = problem.observations.matrix.copy()
    blind[:, 4] = blind[:, 1]
    found = solve(Problem(Bent(blind, problem.observations.data, 0.4), problem.parameters, problem.whiten))
    assert found.end.converged and found.rank == 5
    assert np.isinf(found.standard_errors).tolist() == [False, True, False, False, True, False]


def test_a_model_without_a_prediction_at_the_start_is_refused_and_on_the_way_it_is_avoided():
    problem, _ = _problem(3, bend=0.0)

    @dataclass(frozen=True)
    class Fenced(Bent):
        def residual(self, values):
            """NaN out of reach."""
            reach = np.abs(values).max() < 1e4
            return super().residual(values) * (1.0 if reach else np.nan)

    fenced = Fenced(problem.observations.matrix, problem.observations.data)
    found = solve(Problem(fenced, problem.parameters, problem.whiten), [np.zeros(6)])
    assert found.end.cost == pytest.approx(solve(problem).end.cost, rel=1e-9)
    with pytest.raises(FitError, match="start nearer"):
        solve(Problem(fenced, problem.parameters, problem.whiten), [np.full(6, 2e4)])


def test_a_search_that_is_cut_short_says_so():
    problem, _ = _problem(4, bend=3.0)
    found = solve(problem, [np.full(6, 0.3)], SolverOptions(max_iterations=1))
    assert not found.end.converged and "iterations" in found.end.message


def test_the_best_of_several_starts_is_taken():
    generator = np.random.default_rng(5)
    matrix = np.ones((40, 1))
    made = Bent(matrix, matrix[:, 0] * 2.0 + 25.0 * np.sin(0.6) + 0.1 * generator.standard_normal(40), 25.0)
    problem = Problem(made, _block(1), lambda v: v / NOISE)
    starts = [[start] for start in np.linspace(-40.0, 40.0, 17)]
    costs = [solve(problem, [start]).end.cost for start in starts]
    assert max(costs) > 10.0 * min(costs)
    assert solve(problem, starts).end.cost == pytest.approx(min(costs))


def test_intervals_under_unequal_and_correlated_noise_hold_the_truth():
    """95 % intervals hold 93 to 97 %, where ordinary least squares states errors up to three times too small."""
    generator, runs, points = np.random.default_rng(6), 8, 25
    series, axes, phi = np.repeat(np.arange(runs), points), np.array([0.02, 0.02, 0.1]), 0.7
    noise = NoiseModel(axes, phi)
    time = np.tile(np.linspace(-1.0, 1.0, points), runs)
    columns = np.polynomial.chebyshev.chebvander(time, 4)[:, None] * generator.normal(size=(runs, 3, 5))[series]
    truth = generator.normal(size=5)
    hits, draws = np.zeros(5), 400
    for _ in range(draws):
        shocks = generator.standard_normal((runs, points, 3))
        e = shocks.copy()
        for k in range(1, points):
            e[:, k] = phi * e[:, k - 1] + np.sqrt(1.0 - phi**2) * shocks[:, k]
        data = columns @ truth + axes * e.reshape(-1, 3)
        made = LinearizedProblem(columns, data)
        found = solve(Problem(made, _block(5, 10.0), noise.whitening(series)))
        hits += np.abs(found.values - truth) < 1.96 * found.standard_errors
    share = hits / draws
    assert (np.abs(share - 0.95) < 4.0 * np.sqrt(0.95 * 0.05 / draws)).all()
    assert abs(share.mean() - 0.95) < 0.02


@dataclass(frozen=True)
class LinearizedProblem:
    """Readings (n, a) of a linear model with columns (n, a, p)."""

    columns: np.ndarray
    data: np.ndarray

    def residual(self, values):
        """Readings minus prediction."""
        return self.data - self.columns @ values

    def jacobian(self, values):
        """Derivative of the residual."""
        return -self.columns


def test_a_prior_that_is_a_mixture_gives_the_mean_and_covariance_of_the_mixture():
    """Against numerical integration over two parameters, of which one has the mixture."""
    generator = np.random.default_rng(7)
    columns = generator.normal(size=(12, 1, 2)) * [1.0, 0.3]
    for truth in (0.02, 0.4, 2.0):
        data = columns @ [0.7, truth] + 0.5 * generator.standard_normal((12, 1))
        blocks = (
            Block.of("a", ["a"], ["mm"], 5.0),
            Block.of("b", ["b"], ["kg"], 0.1, wide_sd=1.0),
        )
        found = solve(Problem(LinearizedProblem(columns, data), Parameters(blocks), lambda v: v / 0.5))
        a, b = np.meshgrid(np.linspace(-4.0, 5.0, 901), np.linspace(-5.0, 6.0, 2201), indexing="ij")
        squares = ((data[:, 0, None] - columns[:, 0] @ np.stack([a.ravel(), b.ravel()])) ** 2).sum(axis=0) / 0.25
        mixture = np.exp(-0.5 * (b / 0.1) ** 2) / 0.1 + np.exp(-0.5 * b**2)
        weight = np.exp(-0.5 * (squares.reshape(a.shape) - squares.min()) - 0.5 * (a / 5.0) ** 2) * mixture
        weight /= weight.sum()
        mean = np.array([(weight * one).sum() for one in (a, b)])
        off = [a - mean[0], b - mean[1]]
        covariance = [[(weight * x * y).sum() for y in off] for x in off]
        np.testing.assert_allclose(found.values, mean, atol=2e-3)
        np.testing.assert_allclose(found.covariance, covariance, rtol=2e-2, atol=2e-4)


def test_many_columns_are_factored_alike():
    generator = np.random.default_rng(8)
    rows = generator.normal(size=(700, 260)) * 10.0 ** generator.uniform(-4.0, 4.0, 260)
    triangle = triangle_of(rows)
    np.testing.assert_allclose(triangle.T @ triangle, rows.T @ rows, rtol=1e-9, atol=1e-9 * np.abs(rows.T @ rows).max())
    assert numerical_rank(rows) == 260
    rows[:, 7] = 2.0 * rows[:, 9]
    assert numerical_rank(rows) == 259
    np.testing.assert_allclose(np.linalg.norm(triangle_of(rows), axis=0), np.linalg.norm(rows, axis=0), rtol=1e-9)


def test_whitened_noise_has_the_density_of_the_correlated_one():
    series = np.repeat([1, 2], [6, 9])
    noise = NoiseModel(np.array([0.1, 0.2, 0.3]), 0.6, 0.4)
    white, generator = noise.whitening(series), np.random.default_rng(9)
    values = generator.normal(size=(15, 3))
    expected = 0.0
    for label, count in ((1, 6), (2, 9)):
        lag = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
        for axis, sd in enumerate((0.1, 0.2, 0.3)):
            covariance = sd**2 * (0.6**lag + 0.4)
            expected += multivariate_normal.logpdf(values[series == label, axis], cov=covariance)
    got = -0.5 * (white(values) ** 2).sum() + white.log_determinant - 22.5 * np.log(2.0 * np.pi)
    # cosines make an autoregression independent to good approximation
    assert got == pytest.approx(expected, rel=0.05)
