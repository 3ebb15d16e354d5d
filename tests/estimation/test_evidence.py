"""Marginal likelihoods: dense covariances, numerical integrals, and what a discrepancy and bounds change."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy import integrate, special, stats

from rrru.errors import FitError
from rrru.estimation.discrepancy import Discrepancy, cosines
from rrru.estimation.evidence import log_evidence, marginalize
from rrru.estimation.noise_model import NoiseModel
from rrru.estimation.parameters import Block, Parameters
from rrru.estimation.problem import Problem
from rrru.estimation.solver import solve


@dataclass(frozen=True, eq=False)
class _Linear:
    """Readings (n, a) that are columns (n, a, p) times the parameters."""

    data: np.ndarray
    columns: np.ndarray

    def residual(self, values, /):
        return self.data - self.columns @ values

    def jacobian(self, values, /):
        return -self.columns


@dataclass(frozen=True, eq=False)
class _Decay:
    """Readings (n, 1) of exp(-x0 t) x1."""

    time: np.ndarray
    data: np.ndarray

    def residual(self, values, /):
        return self.data - (values[1] * np.exp(-values[0] * self.time))[:, None]

    def jacobian(self, values, /):
        decay = np.exp(-values[0] * self.time)
        return -np.stack([-self.time * values[1] * decay, decay], axis=-1)[:, None]


def _parameters(count, sd, **options):
    return Parameters((Block.of("x", [f"x{k}" for k in range(count)], ["mm"] * count, sd, **options),))


def _linear(seed, rows=12, axes=3, count=4):
    generator = np.random.default_rng(seed)
    return _Linear(generator.normal(size=(rows, axes)), generator.normal(size=(rows, axes, count)))


@pytest.mark.parametrize("seed", range(5))
def test_linear_problem_is_the_normal_density_of_its_dense_covariance(seed):
    """Under correlated noise of unequal axes, from any start, with priors whose means are not 0."""
    readings, sd, mean = _linear(seed), np.array([0.3, 2.0, 1e-3, 50.0]), np.array([1.0, -2.0, 0.5, 0.0])
    noise = NoiseModel(np.array([0.02, 0.05, 0.3]), correlation=0.6, offset=0.4)
    whiten = noise.whitening(np.repeat([0, 1], 6))
    estimate = solve(Problem(readings, _parameters(4, sd, mean=mean), whiten), [np.full(4, 7.0)])
    inverse = whiten(np.eye(36).reshape(12, 3, 36)).reshape(36, 36)
    flat = readings.columns.reshape(36, 4)
    covariance = np.linalg.inv(inverse.T @ inverse) + flat * sd**2 @ flat.T
    expected = stats.multivariate_normal(flat @ mean, covariance).logpdf(readings.data.ravel())
    assert log_evidence(estimate) == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize("units", [("mm", "rad"), ("mm", "mm")])
def test_mixture_prior_is_the_mean_over_its_components(units):
    """Parameters of one unit have the narrow or the wide prior together."""
    readings, wide = _linear(7, count=2), [3.0, 5.0]
    problem = Problem(readings, Parameters((Block.of("x", ["x0", "x1"], units, 0.1, wide_sd=wide),)))
    cases = [(a, b) for a in (0.1, 3.0) for b in (0.1, 5.0)] if units == ("mm", "rad") else [(0.1, 0.1), (3.0, 5.0)]
    each = [log_evidence(solve(Problem(readings, _parameters(2, case)))) for case in cases]
    expected = special.logsumexp(each) - np.log(len(cases))
    assert log_evidence(solve(problem)) == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("lift", [0.4, -0.4])
def test_half_normal_priors_are_the_integral_over_the_quarter_plane(lift):
    generator = np.random.default_rng(1)
    columns = generator.normal(size=(6, 1, 2)) + 1.0
    readings = _Linear(lift + generator.normal(size=(6, 1)), columns)
    estimate = solve(Problem(readings, _parameters(2, [1.0, 2.0], bounds=(0.0, np.inf))), [np.ones(2)])

    def density(second, first):
        log = stats.norm.logpdf(readings.residual(np.array([first, second]))).sum()
        return 4.0 * np.exp(log + stats.norm.logpdf(first) + stats.norm.logpdf(second, scale=2.0))

    whole, _ = integrate.dblquad(density, 0.0, 8.0, 0.0, 12.0, epsabs=0.0, epsrel=1e-6)
    assert log_evidence(estimate) == pytest.approx(np.log(whole), abs=2e-3)


def test_small_nonlinear_problem_is_near_its_integral():
    time = np.linspace(0.0, 2.0, 9)
    data = (3.0 * np.exp(-0.7 * time) + 0.05 * np.random.default_rng(2).normal(size=9))[:, None]
    problem = Problem(_Decay(time, data / 0.05), _parameters(2, [0.5, 20.0], mean=[0.5, 60.0]))
    estimate = solve(problem)
    found = log_evidence(estimate)

    def density(rate, size):
        log = stats.norm.logpdf(problem.observations.residual(np.array([rate, size]))).sum()
        log += stats.norm.logpdf(rate, 0.5, 0.5) + stats.norm.logpdf(size, 60.0, 20.0)
        return np.exp(log - found)

    (rate, size), (rate_sd, size_sd) = estimate.values, estimate.standard_errors
    ratio, _ = integrate.dblquad(
        density, size - 8 * size_sd, size + 8 * size_sd, rate - 8 * rate_sd, rate + 8 * rate_sd, epsabs=1e-4
    )
    assert abs(np.log(ratio)) < 0.01


def test_unknown_noise_is_students_density():
    """Of the dense covariance, and by numerical integration over the noise's size."""
    readings, sd = _linear(3), np.array([0.5, 1.0, 2.0, 4.0])
    estimate = solve(Problem(readings, _parameters(4, sd)))
    found = marginalize(estimate)
    flat = readings.columns.reshape(36, 4)
    covariance = np.eye(36) + flat * sd**2 @ flat.T

    def density(log_scale):
        log = stats.multivariate_normal(cov=covariance * np.exp(2.0 * log_scale)).logpdf(readings.data.ravel())
        # density 1 / s^2 of s^2
        return 2.0 * np.exp(log - found.log_evidence)

    whole, _ = integrate.quad(density, -2.0, 2.0)
    assert np.log(whole) == pytest.approx(0.0, abs=1e-6)
    square = readings.data.ravel() @ np.linalg.solve(covariance, readings.data.ravel())
    assert found.noise_scale == pytest.approx(np.sqrt(square / 36.0), rel=1e-8)


def test_discrepancy_is_the_mean_over_dense_covariances():
    """Known noise: each size and length scale is one dense covariance."""
    generator = np.random.default_rng(4)
    readings, places = _linear(4, rows=20, axes=2, count=3), generator.uniform(-3.0, 3.0, (20, 2))
    estimate = solve(Problem(readings, _parameters(3, 2.0)))
    discrepancy = Discrepancy.over_places(places, 2, noise=1.0)
    found = marginalize(estimate, discrepancy, noise_known=True)
    flat, waves = readings.columns.reshape(40, 3), discrepancy.columns.reshape(40, -1)
    base = np.eye(40) + 4.0 * flat @ flat.T
    logs = [
        stats.multivariate_normal(cov=base + waves * (size * amplitudes) ** 2 @ waves.T).logpdf(readings.data.ravel())
        for amplitudes in discrepancy.amplitudes
        for size in discrepancy.sizes
    ]
    assert found.log_evidence == pytest.approx(special.logsumexp(logs) - np.log(len(logs)), abs=1e-7)
    assert found.discrepancy_scale == discrepancy.sizes[np.argmax(logs) % len(discrepancy.sizes)]


def test_discrepancy_of_size_one_has_unit_variance_and_its_length_scale():
    places = np.random.default_rng(5).uniform(0.0, 1.0, (300, 1))
    discrepancy = Discrepancy.over_places(places, 1, noise=1.0)
    halves = [discrepancy.columns[:, 0] * amplitudes for amplitudes in discrepancy.amplitudes]
    for half in halves:
        assert (half**2).sum(axis=1).mean() == pytest.approx(1.0)
    # a squared exponential away from the ends, which reflect the cosines
    inner = np.abs(places[:, 0] - 0.5) < 0.2
    covariance = (halves[0] @ halves[0].T)[np.ix_(inner, inner)]
    off = np.subtract.outer(places[inner, 0], places[inner, 0])
    np.testing.assert_allclose(covariance, np.exp(-0.5 * (off / 0.1) ** 2) * covariance[0, 0], atol=0.1)
    waves, frequencies = cosines(places)
    assert waves.shape[1] == len(frequencies) and (np.diff(frequencies) >= 0.0).all()


def test_what_has_no_evidence_is_refused():
    readings = _linear(6)
    flat = solve(Problem(readings, _parameters(4, [np.inf, 1.0, 1.0, 1.0])))
    with pytest.raises(FitError, match="flat priors of x0"):
        log_evidence(flat)
    assert np.isfinite(log_evidence(flat, common=["x0"]))
    with pytest.raises(FitError, match="cauchy"):
        log_evidence(solve(Problem(readings, _parameters(4, 1.0), loss="cauchy")))
    with pytest.raises(FitError, match="log_determinant"):
        log_evidence(solve(Problem(readings, _parameters(4, 1.0), lambda values: 2.0 * values)))
    twice = _Linear(readings.data, readings.columns[..., [0, 0]])
    with pytest.raises(FitError, match="determine"):
        log_evidence(solve(Problem(twice, _parameters(2, np.inf))), common=["x0", "x1"])


def test_flat_priors_are_the_limit_of_wide_ones():
    readings = _linear(8)
    flat = log_evidence(solve(Problem(readings, _parameters(4, [np.inf, 1.0, 1.0, 1.0]))), common=["x0"])
    wide = log_evidence(solve(Problem(readings, _parameters(4, [1e4, 1.0, 1.0, 1.0]))))
    assert flat == pytest.approx(wide + 0.5 * np.log(2.0 * np.pi) + np.log(1e4), abs=1e-6)
