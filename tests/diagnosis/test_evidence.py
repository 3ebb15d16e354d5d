"""The evidence against dense normal densities, numerical integration and scipy."""

from dataclasses import replace
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate
from scipy.fft import dct
from scipy.special import log_ndtr, logsumexp
from scipy.stats import multivariate_normal, norm

from rrru.campaign.noise import along_runs
from rrru.diagnosis import evidence_kernels as kernels
from rrru.diagnosis.evidence import ModelEvidence, averaged
from rrru.diagnosis.marginal_problem import PRIOR_SCALES, Prior
from rrru.diagnosis.state import LinearizedProblem
from rrru.diagnosis.terms import EACH, SAME, EffectTerm
from rrru.diagnosis.whitened import DISCREPANCY_SCALES, spectrum
from rrru.effects.protocol import Coordinates
from rrru.estimation.noise_model import NoiseModel

NOISE_MM = 0.05
RUN = np.repeat([1, 4, 2], [9, 6, 1])


def _effect(typical, legs, positive):
    typical = np.asarray(typical, dtype=float)
    return SimpleNamespace(coordinates=Coordinates(typical, np.asarray(legs), np.full(len(typical), positive), None))


LIBRARY = {"free": _effect([0.3, 2.0], [0, 0], False), "legged": _effect([1.0, 1.0, 1.5], [1, 2, 3], False)}
PULLS = {"pull": _effect([1.0], [0], True), "pair": _effect([1.0, 1.0], [0, 0], True)}


def _evidence(seed=0, with_shapes=False):
    """Evidence on random numbers: three calibration columns, two effects, one with two columns of its shape."""
    generator = np.random.default_rng(seed)
    shape = (len(RUN), 3)
    columns = {("free", 0): generator.normal(size=(*shape, 2)), ("legged", 0): generator.normal(size=(*shape, 3))}
    shape_columns = {"free": 0.03 * generator.normal(size=(*shape, 2))} if with_shapes else {}
    base = generator.normal(size=(*shape, 3)) * [1.0, 30.0, 500.0]
    data = 0.2 * generator.normal(size=shape)
    return ModelEvidence(
        LIBRARY, LinearizedProblem(data, base, columns, shape_columns, {}, None), RUN, NoiseModel.white(NOISE_MM)
    )


def _discrepancy():
    """Covariance (3n, 3n) of the discrepancy at level 1 and unit noise: D' diag D per run, the axes independent."""
    n = len(RUN)
    transform, wave = np.zeros((n, n)), np.zeros(n)
    for label in np.unique(RUN):
        rows = np.flatnonzero(label == RUN)
        transform[np.ix_(rows, rows)] = dct(np.eye(len(rows)), axis=0, norm="ortho")
        wave[rows] = np.arange(len(rows))
    density = 1.0 / (1.0 + (wave / 3.0) ** 2) + 0.01
    return np.kron(transform.T @ np.diag(density / density.mean()) @ transform, np.eye(3))


def _marginal(evidence, columns, prior_covariance, level):
    """Log density of the data with a flat prior on the calibration's errors (restricted likelihood), its constants as
    in `ModelEvidence`.
    """
    data, base = evidence.linear.data.ravel() / NOISE_MM, evidence.linear.base.reshape(-1, 3) / NOISE_MM
    covariance = np.eye(len(data)) + DISCREPANCY_SCALES[level] ** 2 * _discrepancy()
    if columns is not None:
        covariance = covariance + columns @ prior_covariance @ columns.T / NOISE_MM**2
    solve = np.linalg.inv(covariance)
    inner = base.T @ solve @ base
    projector = solve - solve @ base @ np.linalg.inv(inner) @ base.T @ solve
    return -0.5 * (np.linalg.slogdet(covariance)[1] + np.linalg.slogdet(inner)[1] + data @ projector @ data)


def _unit_size(evidence, columns, typical):
    """Prior standard deviations (k,) for which the columns' part beyond the calibration has an rms of one noise per
    axis.
    """
    basis, _ = np.linalg.qr(evidence.linear.base.reshape(-1, 3))
    beyond = columns - basis @ (basis.T @ columns)
    return typical / np.sqrt((beyond**2 * typical**2).sum() / columns.shape[0]) * NOISE_MM


@pytest.mark.parametrize("level", range(len(DISCREPANCY_SCALES)))
@pytest.mark.parametrize("legs", [EACH, SAME, 2])
def test_scores_equal_a_dense_marginal_likelihood(level, legs):
    evidence = _evidence()
    raw = evidence.linear.columns["legged", 0].reshape(-1, 3)
    columns = {EACH: raw, SAME: raw.sum(axis=1, keepdims=True), 2: raw[:, 1:2]}[legs]
    typical = {EACH: np.array([1.0, 1.0, 1.5]), SAME: np.array([3.5 / 3.0]), 2: np.array([1.0])}[legs]
    size = _unit_size(evidence, columns, typical)
    expected = [_marginal(evidence, columns, np.diag((s * size) ** 2), level) for s in PRIOR_SCALES]
    term = EffectTerm("legged", 0, legs)
    found, grid = evidence.over_strengths((term,), levels=[level])
    np.testing.assert_allclose(grid[:, 0], PRIOR_SCALES)
    np.testing.assert_allclose(found[0], expected, rtol=1e-8)
    alone, best = evidence.over_all_strengths((term,), level)
    np.testing.assert_allclose(alone, logsumexp(expected) - np.log(len(PRIOR_SCALES)), rtol=1e-8)
    assert best[0] == PRIOR_SCALES[np.argmax(expected)]
    np.testing.assert_allclose(evidence.none[level], _marginal(evidence, None, None, level), rtol=1e-8)


@pytest.mark.parametrize("level", [0, 3, 6])
def test_two_terms_and_shape_parameters_equal_a_dense_marginal_likelihood(level):
    evidence = _evidence(seed=1, with_shapes=True)
    linear = evidence.linear
    free, legged, shape = (
        linear.columns["free", 0].reshape(-1, 2),
        linear.columns["legged", 0].reshape(-1, 3),
        linear.shape_columns["free"].reshape(-1, 2),
    )
    sizes = (
        _unit_size(evidence, free, LIBRARY["free"].coordinates.typical),
        _unit_size(evidence, legged, np.array([1.0, 1.0, 1.5])),
    )
    together = np.concatenate([free, legged, shape], axis=1)
    expected = []
    for first, second in product(PRIOR_SCALES, PRIOR_SCALES):
        prior = np.concatenate([first * sizes[0], second * sizes[1], np.ones(2)])
        expected.append(_marginal(evidence, together, np.diag(prior**2), level))
    found, _ = evidence.over_strengths((EffectTerm("free"), EffectTerm("legged")), levels=[level])
    np.testing.assert_allclose(found[0], expected, rtol=1e-7)


@pytest.mark.parametrize("level", [0, 4])
def test_coefficients_are_the_generalised_ridge_solution(level):
    evidence = _evidence(seed=2)
    columns = evidence.linear.columns["free", 0].reshape(-1, 2)
    scale = 3.0 * _unit_size(evidence, columns, LIBRARY["free"].coordinates.typical)
    base, data = evidence.linear.base.reshape(-1, 3), evidence.linear.data.ravel()
    weight = np.linalg.inv(np.eye(len(data)) + DISCREPANCY_SCALES[level] ** 2 * _discrepancy()) / NOISE_MM**2
    design = np.concatenate([base, columns], axis=1)
    precision = design.T @ weight @ design + np.diag([0.0, 0.0, 0.0, *scale**-2.0])
    mean, covariance = evidence.coefficients((EffectTerm("free"),), [3.0], level)
    np.testing.assert_allclose(mean, np.linalg.solve(precision, design.T @ weight @ data)[3:], rtol=1e-6)
    np.testing.assert_allclose(covariance, np.linalg.inv(precision)[3:, 3:], rtol=1e-6)
    np.testing.assert_allclose(evidence.scales((EffectTerm("free"),), [3.0]), scale, rtol=1e-9)


def _kernel(design, data, scale, positive):
    gram, moment = design.T @ design, design.T @ data
    return kernels.log_evidence(gram[None], moment[None], np.asarray(scale, dtype=float)[None], np.asarray(positive))[
        0, 0
    ]


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 4))
def test_the_kernel_is_a_ratio_of_normal_densities(seed, count):
    generator = np.random.default_rng(seed)
    design, scale = generator.normal(size=(7, count)), generator.uniform(0.01, 10.0, count)
    data = generator.normal(size=7) * generator.uniform(0.1, 10.0)
    with_them = multivariate_normal.logpdf(data, cov=np.eye(7) + design @ np.diag(scale**2) @ design.T)
    expected = with_them - multivariate_normal.logpdf(data, cov=np.eye(7))
    assert _kernel(design, data, scale, [False] * count) == pytest.approx(expected, rel=1e-8, abs=1e-8)


def _integrated(column, data, scale):
    """Evidence ratio of one positive coefficient by quadrature."""
    gram, moment = column @ column, column @ data
    centre, width = moment / (gram + scale**-2.0), (gram + scale**-2.0) ** -0.5
    shift = max(0.5 * moment**2 / (gram + scale**-2.0), 0.0) if centre > 0.0 else 0.0

    def density(c):
        return 2.0 * norm.pdf(c, scale=scale) * np.exp(c * moment - 0.5 * c * c * gram - shift)

    low, high = max(centre - 12.0 * width, 0.0), max(centre, 0.0) + 12.0 * width
    return np.log(integrate.quad(density, low, high, limit=200)[0]) + shift


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), size=st.floats(-3.0, 3.0))
def test_a_positive_coefficient_has_half_its_prior(seed, size):
    generator = np.random.default_rng(seed)
    column = generator.normal(size=6)
    data, scale = size * column + generator.normal(size=6), float(generator.uniform(0.1, 5.0))
    assert _kernel(column[:, None], data, [scale], [True]) == pytest.approx(_integrated(column, data, scale), abs=1e-6)


def test_independent_positive_coefficients_multiply():
    generator = np.random.default_rng(5)
    basis, _ = np.linalg.qr(generator.normal(size=(6, 2)))
    for coefficients in ((2.0, 1.0), (0.3, -0.5), (-2.0, -1.0)):
        data = basis @ np.array(coefficients) + 0.1 * generator.normal(size=6)
        expected = _integrated(basis[:, 0], data, 0.7) + _integrated(basis[:, 1], data, 3.0)
        assert _kernel(basis, data, [0.7, 3.0], [True, True]) == pytest.approx(expected, abs=1e-6)


@settings(max_examples=200)
@given(st.floats(-1e4, 40.0))
def test_the_normal_distributions_logarithm_is_scipys(x):
    assert kernels.log_ndtr(x) == pytest.approx(log_ndtr(x), rel=1e-9, abs=1e-7 if x < -29.9 else 1e-12)


@settings(max_examples=30)
@given(st.lists(st.integers(1, 12), min_size=1, max_size=5), st.integers(0, 1000))
def test_the_cosine_transform_keeps_lengths_and_runs_apart(lengths, seed):
    generator = np.random.default_rng(seed)
    run = np.repeat(generator.permutation(len(lengths)), lengths)
    values = generator.normal(size=(len(run), 2))
    turned, wave = along_runs(values, run)
    for label in range(len(lengths)):
        here = run == label
        np.testing.assert_allclose((turned[here] ** 2).sum(axis=0), (values[here] ** 2).sum(axis=0))
        np.testing.assert_allclose(turned[here][0], values[here].sum(axis=0) / np.sqrt(here.sum()))
        assert wave[here].tolist() == list(range(here.sum()))
    matrix, _ = along_runs(np.eye(len(run)), run)
    np.testing.assert_allclose(matrix.T @ matrix, np.eye(len(run)), atol=1e-12)
    assert np.abs(matrix[run[:, None] != run]).sum() == 0.0


@settings(max_examples=30)
@given(st.lists(st.integers(0, 200), min_size=1, max_size=60))
def test_the_discrepancy_has_the_level_as_its_rms_and_falls_with_frequency(waves):
    shape = spectrum(np.sort(np.array(waves, dtype=float)))
    assert shape.mean() == pytest.approx(1.0) and (np.diff(shape) <= 1e-12).all() and (shape > 0.0).all()


def test_no_effect_explains_nothing_and_a_strong_one_what_it_made():
    evidence = _evidence(seed=4)
    linear = evidence.linear
    made = linear.columns["free", 0] @ np.array([2.0, -1.0])
    same = LinearizedProblem(made, linear.base, linear.columns, {}, {}, None)
    strong = ModelEvidence(LIBRARY, same, RUN, NoiseModel.white(NOISE_MM))
    hypothesis = SimpleNamespace(
        terms=(EffectTerm("free"),),
        effects={"free"},
        evidence=np.eye(len(DISCREPANCY_SCALES))[0],
        prior_scales=np.full((len(DISCREPANCY_SCALES), 1), 300.0),
    )
    basis, _ = np.linalg.qr(linear.base.reshape(-1, 3))
    beyond = made.ravel() - basis @ (basis.T @ made.ravel())
    assert strong.explained(hypothesis, {"free", "legged"}) == pytest.approx(
        np.sqrt((beyond**2).mean()) / NOISE_MM, rel=1e-3
    )
    assert strong.explained(hypothesis, {"legged"}) == 0.0
    assert strong.explained(SimpleNamespace(terms=(), effects=set()), {"free"}) == 0.0


def test_the_coefficients_mean_keeps_positive_ones_positive_and_is_optimal_there():
    """Against a fine search of the penalised least squares over the quadrant."""
    generator = np.random.default_rng(8)
    columns = generator.normal(size=(len(RUN), 3, 2))
    columns[..., 1] = -0.9 * columns[..., 0] + 0.3 * columns[..., 1]
    data = columns @ np.array([1.0, -0.4])
    linear = LinearizedProblem(
        data, 1e-9 + 0.0 * columns[..., :1] + np.eye(3)[0][:, None], {("pair", 0): columns}, {}, {}, None
    )
    evidence = ModelEvidence(PULLS, linear, RUN, NoiseModel.white(NOISE_MM))
    mean, _ = evidence.coefficients((EffectTerm("pair"),), [100.0], 0)
    problem = evidence.projected((EffectTerm("pair"),), evidence.levels)
    gram, moment = problem.gram, problem.moment
    precision = gram[0] + np.diag(evidence.scales((EffectTerm("pair"),), [100.0]) ** -2.0)
    grid = np.stack(np.meshgrid(*(np.linspace(0.0, 2.0, 401),) * 2), axis=-1).reshape(-1, 2)
    cost = 0.5 * np.einsum("ij,jk,ik->i", grid, precision, grid) - grid @ moment[0]
    assert (mean >= 0.0).all()
    assert 0.5 * mean @ precision @ mean - mean @ moment[0] <= cost.min() + 1e-6 * abs(cost.min())


def test_no_prior_scale_makes_a_prior_wider_than_its_effect_allows():
    """A coefficient that the calibration nearly absorbs would else have an estimate of metres."""
    free = _evidence()
    shape = free.library["free"].coordinates
    narrow = SimpleNamespace(coordinates=replace(shape, most=np.array([1e-3, 2e-3])))
    bounded = replace(free, library=free.library | {"free": narrow})
    term = (EffectTerm("free"),)
    assert (bounded.scales(term, [300.0]) <= [1e-3, 2e-3]).all() and (free.scales(term, [300.0]) > 1.0).all()
    _, covariance = bounded.coefficients(term, [300.0], 0)
    assert (np.sqrt(np.diag(covariance)) <= [1e-3, 2e-3]).all()
    # prior scales beyond the bound are all the same hypothesis
    value, _ = bounded.over_strengths(term, None, [0])
    assert value[0, -1] == pytest.approx(value[0, -2]) and value[0, 0] != pytest.approx(value[0, -1])


@pytest.mark.parametrize("highest", [0.03, 0.1, 0.2, 5.0, 10.0, 11.0, 250.0, 300.0, 1e4])
def test_prior_scales_are_even_in_their_logarithm_up_to_the_bound(highest):
    """The share of each is that of its step of a distribution that is even from the step below 0.1 up to the bound."""
    size, nothing = np.array([2e-3, 5e-3]), np.zeros(2)
    found = np.exp(Prior(nothing.astype(int), size, highest * size * [0.5, 1.0], nothing > 0.0).log_scales)
    assert found.sum() == pytest.approx(1.0)
    # PRIOR_SCALES as steps 0, 1, 2, .. of their logarithm
    top = np.interp(np.log(highest), np.log(PRIOR_SCALES), np.arange(len(PRIOR_SCALES)))
    drawn = np.ceil(np.linspace(-1.0, top, 100_001)[1:]).astype(int)
    expected = np.bincount(drawn, minlength=len(PRIOR_SCALES)) / len(drawn)
    np.testing.assert_allclose(found, expected, atol=1e-4)


def test_an_upper_bound_makes_an_effect_more_probable_by_the_sizes_that_it_excludes_alone():
    """All scales beyond the bound counted at it: an effect that could just be so large was four times as probable."""
    free = _evidence()
    term = (EffectTerm("free"),)
    deviations = free.scales(term, [10.0])
    narrow = SimpleNamespace(coordinates=replace(free.library["free"].coordinates, most=deviations))
    bounded = replace(free, library=free.library | {"free": narrow})
    alike = np.where(PRIOR_SCALES == 10.0, 0.0, -np.inf)
    ratio = averaged(alike, bounded.log_scales(term)) - averaged(alike, free.log_scales(term))
    assert ratio == pytest.approx(np.log(len(PRIOR_SCALES) / np.count_nonzero(PRIOR_SCALES <= 10.0)))
