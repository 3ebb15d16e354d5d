"""Probability and moments of the positive orthant: against closed forms, quadrature and importance sampling."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import log_ndtr, logsumexp
from scipy.stats import norm

from rrru.diagnosis.evidence_kernels import log_evidence, log_evidence_and_correction
from rrru.diagnosis.marginal_problem import evidence_error
from tests.diagnosis.evidence_problems import COUNT, problems
from tests.diagnosis.orthant import log_orthant, truncated_moments
from tests.reference.truncated_normal import posterior, sample_evidence

# issue of the estimation core: log evidence within 0.1 nats of importance sampling
_MAX_ERROR_NATS = 0.1


def _normal(generator, count, alike):
    """Posterior of non-negative coefficients whose columns are alike or opposite except for a share 10^-alike."""
    sign = generator.choice([-1.0, 1.0], count) if generator.random() < 0.5 else np.ones(count)
    design = generator.normal(size=(3 * count, 1)) * sign + 10.0**-alike * generator.normal(size=(3 * count, count))
    scale = 10.0 ** generator.uniform(-1.0, 1.5, count)
    data = design @ np.abs(scale * generator.normal(size=count)) + generator.normal(size=3 * count)
    gram, moment = design.T @ design, design.T @ data
    return gram, moment, scale


def _integrate_pair(mean, covariance):
    """Log probability that two coefficients are positive: the trapezoidal rule over the first, where its density is."""
    deviation = np.sqrt(covariance[0, 0])
    slope = covariance[0, 1] / covariance[0, 0]
    rest = np.sqrt(covariance[1, 1] - slope * covariance[0, 1])
    low, high = 0.0, max(mean[0], 0.0) + 12.0 * deviation
    for _ in range(4):
        x = np.linspace(low, high, 20_001)
        density = norm.logpdf(x, mean[0], deviation) + log_ndtr((mean[1] + slope * (x - mean[0])) / rest)
        there = np.flatnonzero(density > density.max() - 40.0)
        low, high = x[max(there[0] - 1, 0)], x[min(there[-1] + 1, len(x) - 1)]
    density[[0, -1]] -= np.log(2.0)
    return logsumexp(density) + np.log(x[1] - x[0])


@settings(max_examples=200, deadline=None)
@given(st.floats(-1e3, 40.0), st.floats(0.01, 100.0))
def test_one_coefficient_is_exact(z, deviation):
    log, correction = log_orthant([z * deviation], [[deviation**2]])
    assert log == pytest.approx(log_ndtr(z), rel=1e-9, abs=1e-7) and correction == 0.0


@pytest.mark.parametrize("correlation", [-0.99, -0.9, -0.5, 0.0, 0.5, 0.9, 0.99])
def test_two_centered_coefficients_have_the_probability_of_their_angle(correlation):
    log, correction = log_orthant([0.0, 0.0], [[1.0, correlation], [correlation, 1.0]])
    exact = np.log(0.25 + np.arcsin(correlation) / (2.0 * np.pi))
    assert abs(log - exact) < 0.01 + abs(correction) and abs(log - exact) < _MAX_ERROR_NATS


@pytest.mark.parametrize("correlation", [-0.999, -0.9, -0.3, 0.3, 0.9, 0.999])
def test_two_coefficients_are_those_of_quadrature(correlation):
    generator = np.random.default_rng(3)
    for _ in range(40):
        deviation, z = generator.uniform(0.1, 10.0, 2), generator.uniform(-6.0, 3.0, 2)
        covariance = np.outer(deviation, deviation) * [[1.0, correlation], [correlation, 1.0]]
        log, _ = log_orthant(z * deviation, covariance)
        assert abs(log - _integrate_pair(z * deviation, covariance)) < _MAX_ERROR_NATS


def test_coefficients_that_do_not_correlate_multiply():
    z = np.array([-40.0, -6.0, -1.0, 0.0, 2.0, 9.0])
    log, correction = log_orthant(z, np.eye(6))
    assert log == pytest.approx(log_ndtr(z).sum(), abs=1e-4) and correction == 0.0


@pytest.mark.parametrize("alike", [0.0, 1.0, 2.0, 3.0])
@pytest.mark.parametrize("count", [2, 3, 6, 12])
def test_strong_correlations_are_within_a_tenth_of_a_nat(count, alike):
    generator = np.random.default_rng([count, int(alike)])
    for seed in range(6):
        gram, moment, scale = _normal(generator, count, alike)
        positive = np.ones(count, dtype=bool)
        sampled = sample_evidence(gram, moment, scale, positive, seed, 2**11)
        found, correction = log_evidence_and_correction(gram[None], moment[None], scale[None], positive)
        error = abs(found[0, 0] - sampled.log)
        assert sampled.error < 0.02 and error < _MAX_ERROR_NATS
        # the correction's size is that of the error at most, except for what is below a hundredth of a nat
        assert error < abs(correction[0, 0]) + 0.01 + 4.0 * sampled.error


@pytest.mark.parametrize("number", range(COUNT))
def test_the_evidence_is_that_of_importance_sampling(number):
    problem = problems()[number]
    own, scale = problem.problem, problem.scale
    sampled = sample_evidence(own.gram[0], own.moment[0], scale, own.positive)
    assert sampled.error < 0.002 and sampled.size > 0.1
    if problem.evidence is None:
        found = log_evidence(own.gram, own.moment, scale[None], own.positive)[0, 0]
    else:
        grids = [[prior_scale] for prior_scale in problem.prior_scales]
        value, _ = problem.evidence.over_strengths(problem.terms, grids, [problem.level])
        found = value[0, 0] - problem.evidence.none[problem.level]
    error = abs(found - sampled.log)
    assert error < _MAX_ERROR_NATS
    assert error < evidence_error(own, scale[None])[0, 0] + 4.0 * sampled.error + 1e-3


@pytest.mark.parametrize("number", range(COUNT))
def test_moments_are_those_of_importance_sampling(number):
    problem = problems()[number]
    own, scale = problem.problem, problem.scale
    gram, moment = own.gram[0], own.moment[0]
    sampled = sample_evidence(gram, moment, scale, own.positive)
    mean, covariance = truncated_moments(*posterior(gram, moment, scale), own.positive)
    deviation = np.sqrt(np.diag(sampled.covariance))
    assert (mean[own.positive] > 0.0).all()
    assert (np.abs(mean - sampled.mean) < 0.1 * deviation).all()
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), deviation, rtol=0.1)


def test_moments_of_one_truncated_coefficient_are_those_of_mills_ratio():
    for z in (-40.0, -5.0, 0.0, 3.0):
        ratio = np.exp(-0.5 * z * z - 0.5 * np.log(2.0 * np.pi) - log_ndtr(z))
        mean, covariance = truncated_moments([2.0 * z, 1.0], [[4.0, 1.0], [1.0, 1.0]], [True, False])
        inside, within = 2.0 * (z + ratio), 4.0 * (1.0 - ratio * (z + ratio))
        np.testing.assert_allclose(mean, [inside, 1.0 + 0.25 * (inside - 2.0 * z)], rtol=1e-5)
        expected = [[within, within / 4.0], [within / 4.0, 0.75 + within / 16.0]]
        np.testing.assert_allclose(covariance, expected, rtol=1e-4)


def test_without_non_negative_coefficients_moments_stay():
    mean, covariance = truncated_moments([-1.0, 2.0], [[1.0, 0.5], [0.5, 1.0]], [False, False])
    assert mean.tolist() == [-1.0, 2.0] and covariance.tolist() == [[1.0, 0.5], [0.5, 1.0]]


def test_the_order_of_the_coefficients_makes_no_difference():
    generator = np.random.default_rng(8)
    for count in (2, 4, 9):
        mean, covariance = posterior(*_normal(generator, count, 1.0))
        order = generator.permutation(count)
        expected = log_orthant(mean, covariance)
        np.testing.assert_allclose(log_orthant(mean[order], covariance[np.ix_(order, order)]), expected, rtol=1e-8)


@pytest.mark.parametrize("varying", [range(7), (1, 2), (3, 6), (), (0, 5)])
def test_many_problems_in_one_call_are_those_of_one_call_each(varying):
    """Whichever coefficients have the same deviation in all of them; at two levels."""
    generator = np.random.default_rng(11)
    problems = [_normal(generator, 7, 1.0)[:2] for _ in range(2)]
    gram, moment = (np.array(part) for part in zip(*problems, strict=True))
    scale = np.tile(10.0 ** generator.integers(-1, 2, 7), (60, 1))
    scale[:, list(varying)] = 10.0 ** generator.integers(-1, 2, (60, len(varying)))
    positive = np.array([True, False, True, True, False, True, True])
    together = log_evidence(gram, moment, scale, positive)
    each = [log_evidence(gram, moment, one[None], positive)[:, 0] for one in scale]
    np.testing.assert_allclose(together, np.transpose(each), rtol=1e-9)
