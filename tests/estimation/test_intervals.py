"""Credible intervals against scipy's distributions, and against truths that are drawn from the prior."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.stats import norm, truncnorm

from rrru.estimation.intervals import NormalMixture
from rrru.estimation.parameters import Block, Parameters
from rrru.estimation.problem import Problem
from rrru.estimation.solver import solve

_ONE = np.ones(1)


def test_of_a_normal_distribution_it_is_two_standard_errors_to_both_sides():
    found = NormalMixture(_ONE, np.array([3.0]), np.array([0.5])).interval()
    np.testing.assert_allclose(found, norm(3.0, 0.5).interval(0.95), atol=3e-3)


@pytest.mark.parametrize("mean", [-30.0, -2.0, -0.1])
def test_at_a_bound_it_begins_there(mean):
    """The density falls from the bound on: the shortest interval ends at the truncated density's 95 % quantile."""
    found = NormalMixture(_ONE, np.array([mean]), np.array([2.0])).interval(low=0.0)
    end = truncnorm(-mean / 2.0, np.inf, loc=mean, scale=2.0).ppf(0.95)
    assert found[0] == 0.0 and found[1] == pytest.approx(end, rel=0.01)


def test_beyond_the_upper_bound_it_ends_there():
    low, high = NormalMixture(_ONE, np.array([5.0]), np.array([1.0])).interval(high=4.0)
    assert high == 4.0 and low == pytest.approx(truncnorm(-np.inf, -1.0, loc=5.0).ppf(0.05), rel=0.01)


def test_of_a_mixture_it_holds_its_share_and_has_equal_densities_at_its_ends():
    share, mean, sd = np.array([0.6, 0.4]), np.array([0.0, 0.3]), np.array([0.1, 1.0])
    low, high = NormalMixture(share, mean, sd).interval()
    assert share @ (norm.cdf(high, mean, sd) - norm.cdf(low, mean, sd)) == pytest.approx(0.95, abs=2e-3)
    assert share @ norm.pdf(low, mean, sd) == pytest.approx(share @ norm.pdf(high, mean, sd), rel=0.02)


class _OnAllNodes(NormalMixture):
    """A mixture that has nodes next to every bound, wherever its density is."""

    def _nodes(self, low, high):
        nodes = [(self.mean[:, None] + self.sd[:, None] * np.linspace(-6.0, 6.0, 2001)).ravel()]
        for bound, side in ((low, 1.0), (high, -1.0)):
            distances = np.concatenate([[0.0], *(sd * np.logspace(-6.0, 1.0, 2000) for sd in self.sd)])
            nodes.append(bound + side * distances)
        return np.unique(np.clip(np.concatenate(nodes), low, high))


@pytest.mark.parametrize("low", [-1000.0, -30.0, -21.0, -5.0, 0.0, 0.9])
@pytest.mark.parametrize("high", [1.3, 4.0, 45.0, 60.0, 1000.0])
def test_nodes_next_to_a_bound_without_density_change_no_digit(low, high):
    share, mean, sd = np.array([0.6, 0.4]), np.array([0.2, 1.0]), np.array([0.3, 0.5])
    one, other = (kind(share, mean, sd) for kind in (NormalMixture, _OnAllNodes))
    assert one.interval(low, high) == other.interval(low, high)
    assert len(one._nodes(-1000.0, 1000.0)) < 0.4 * len(other._nodes(-1000.0, 1000.0))


@dataclass(frozen=True)
class LinearizedProblem:
    """Readings (n, 1) of a linear model."""

    matrix: np.ndarray
    data: np.ndarray

    def residual(self, values):
        """Readings minus prediction."""
        return (self.data - self.matrix @ values)[:, None]

    def jacobian(self, values):
        """Derivative of the residual."""
        return -self.matrix[:, None]


def _parameters(narrow, wide):
    """A free number, one that cannot be negative, and one whose prior has two widths."""
    blocks = (
        Block.of("free", ["free"], [""], 1.0),
        Block.of("positive", ["positive"], [""], 1.0, bounds=(0.0, np.inf)),
        Block.of("nuisance", ["nuisance"], [""], narrow, wide_sd=wide),
    )
    return Parameters(blocks)


def test_truths_that_are_drawn_from_the_prior_lie_inside_as_often_as_stated():
    """Numbers that the readings hardly determine, so that bound and mixture matter; 800 draws, 4 binomial errors."""
    generator, draws, held = np.random.default_rng(5), 800, []
    narrow, wide = 0.1, 1.0
    parameters = _parameters(narrow, wide)
    for _ in range(draws):
        matrix = generator.normal(size=(6, 3))
        truth = generator.standard_normal(3)
        truth[1], truth[2] = abs(truth[1]), truth[2] * (narrow if generator.random() < 0.5 else wide)
        data = matrix @ truth + 2.0 * generator.standard_normal(6)
        estimate = solve(Problem(LinearizedProblem(matrix, data), parameters, lambda v: v / 2.0), [np.zeros(3)])
        low, high = estimate.intervals.T
        held.append((low <= truth) & (truth <= high))
    np.testing.assert_allclose(np.mean(held, axis=0), 0.95, atol=4.0 * np.sqrt(0.05 * 0.95 / draws))


@dataclass(frozen=True)
class DeflectionProblem:
    """Readings (n, 1) of a joint that deflects by a compliance times a load (n,), whose mass is not as stated."""

    load: np.ndarray
    more: np.ndarray
    data: np.ndarray

    def residual(self, values):
        """Readings minus prediction."""
        zero, compliance, mass = values
        return (self.data - zero - compliance * (self.load + mass * self.more))[:, None]

    def jacobian(self, values):
        """Derivative of the residual."""
        _, compliance, mass = values
        load = self.load + mass * self.more
        return -np.stack([np.ones(len(load)), load, compliance * self.more], axis=1)[:, None]


def _deflections(seed):
    """Readings with a noise of 0.02 under a load and a mass drawn from the priors, the problem's truth, the Problem."""
    generator = np.random.default_rng(seed)
    truth = np.array([generator.normal(), abs(generator.normal()), (0.1 if generator.random() < 0.5 else 1.0)])
    truth[2] *= abs(generator.normal())
    load = generator.normal(size=30)
    readings = DeflectionProblem(load, load + 0.1 * generator.normal(size=30), np.zeros(30))
    data = -readings.residual(truth)[:, 0] + 0.02 * generator.standard_normal(30)
    blocks = (
        Block.of("zero", ["zero"], [""], 10.0),
        Block.of("compliance", ["compliance"], [""], 1.0, bounds=(0.0, np.inf)),
        Block.of("mass", ["mass"], ["kg"], 0.1, wide_sd=1.0, bounds=(-0.9, 10.0)),
    )
    return truth, Problem(replace(readings, data=data), Parameters(blocks), lambda v: v / 0.02)


def test_an_estimate_of_two_factors_fits_the_readings_and_lies_in_its_own_interval():
    """The mean of a compliance and that of a mass are no pair that fits: the product is what the readings know."""
    for seed in range(100):
        _, problem = _deflections(seed)
        estimate = solve(problem, [np.array([0.0, 0.5, 0.0])])
        low, high = estimate.intervals.T
        assert (low <= estimate.values).all() and (estimate.values <= high).all(), seed
        rows = 0.5 * (estimate.standardized_residual**2).sum()
        assert rows < 0.5 * (30 + 6.0 * np.sqrt(60.0)), seed


def test_intervals_of_two_factors_hold_truths_from_the_prior_as_often_as_stated():
    """400 draws, 4 binomial errors."""
    held = []
    for seed in range(400):
        truth, problem = _deflections(1000 + seed)
        low, high = solve(problem, [np.array([0.0, 0.5, 0.0])]).intervals.T
        held.append((low <= truth) & (truth <= high))
    np.testing.assert_allclose(np.mean(held, axis=0), 0.95, atol=4.0 * np.sqrt(0.05 * 0.95 / 400))
