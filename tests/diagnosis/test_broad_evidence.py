"""Terms of many coefficients, which are averaged over first, against the marginal likelihood of the whole model."""

from dataclasses import dataclass, replace
from itertools import permutations, product
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import lsq_linear
from scipy.special import logsumexp
from scipy.stats import multivariate_normal, norm

from rrru.diagnosis.evidence import ModelEvidence
from rrru.diagnosis.hypothesis import Hypothesis
from rrru.diagnosis.marginal_problem import PRIOR_SCALES, Average
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.state import LinearizedProblem
from rrru.diagnosis.terms import EffectTerm
from rrru.diagnosis.whitened import DISCREPANCY_SCALES
from rrru.effects.protocol import Coordinates
from rrru.estimation.noise_model import NoiseModel

NOISE_MM = 0.05
_POINTS, _ROUGH, _FINE = 16, 14, 8
_SIZES = np.random.default_rng(9).uniform(0.3, 3.0, _ROUGH)


# prior mean of a step of payload and tilt, under which "other" deflects
_ABOUT = -1.3


def _effect(typical, positive=False, broad=False, most=np.inf, needs=()):
    typical = np.asarray(typical, dtype=float)
    none = np.zeros(len(typical), dtype=int)
    return SimpleNamespace(
        coordinates=Coordinates(typical, none, np.full(len(typical), positive), None, most=most, broad=broad),
        needs=needs,
    )


LIBRARY = {
    "rough": _effect(_SIZES, broad=True),
    "fine": _effect(np.ones(_FINE), broad=True),
    "free": _effect([0.3, 2.0]),
    "other": _effect([1.0, 1.0, 1.5], needs=("drive_load",)),
    "pull": _effect([0.7], positive=True),
}
ROUGH, FINE, FREE, OTHER, PULL = (EffectTerm(name) for name in LIBRARY)


def _evidence(seed, with_shapes=False, smooth=False):
    """Evidence on random numbers: three calibration columns and the library's, of stops in no order unless smooth."""
    generator, shape = np.random.default_rng(seed), (_POINTS, 3)
    columns = {(name, 0): generator.normal(size=(*shape, len(e.coordinates))) for name, e in LIBRARY.items()}
    shape_columns = {"free": 0.03 * generator.normal(size=(*shape, 1))} if with_shapes else {}
    weight = {("other", 0): 0.2 * generator.normal(size=(*shape, 3))} if with_shapes else {}
    base = generator.normal(size=(*shape, 3)) * [1.0, 30.0, 500.0]
    data = 0.2 * generator.normal(size=shape) + 0.1 * columns["pull", 0][..., 0]
    steps = (("a number", 1.3, 2.3, _ABOUT),)
    linear = LinearizedProblem(data, base, columns, shape_columns, {}, None, weight, steps)
    return ModelEvidence(LIBRARY, linear, np.ones(_POINTS, dtype=int), NoiseModel.white(NOISE_MM), smooth)


@dataclass(frozen=True)
class Dense:
    """The whole Gaussian model of some terms at prior_scales: columns (3n, k) in units of the noise, sizes (k,)."""

    data: np.ndarray
    base: np.ndarray
    columns: np.ndarray
    size: np.ndarray
    owner: np.ndarray
    about: np.ndarray
    weight: np.ndarray

    @classmethod
    def of(cls, evidence, terms, prior_scales):
        """The model of terms at prior scales on the evidence's columns and data."""
        linear = evidence.linear
        base = linear.base.reshape(-1, 3) / NOISE_MM
        basis, _ = np.linalg.qr(base)
        columns, sizes, owner = [np.zeros((len(base), 0))], [], []
        for number, (term, prior_scale) in enumerate(zip(terms, prior_scales, strict=True)):
            own = linear.columns[term.effect, 0].reshape(len(base), -1) / NOISE_MM
            typical = LIBRARY[term.effect].coordinates.typical
            beyond = (own - basis @ (basis.T @ own)) * typical
            columns.append(own)
            # of prior scale 1 the rms of its part beyond the calibration is that of the noise
            sizes.extend(prior_scale * typical / np.sqrt((beyond**2).sum() / len(base)))
            owner.extend([number] * len(typical))
        for term in terms:
            if term.effect in linear.shape_columns:
                own = linear.shape_columns[term.effect].reshape(len(base), -1) / NOISE_MM
                columns.append(own)
                sizes.extend([1.0] * own.shape[1])
                owner.extend([len(terms)] * own.shape[1])
        weight = [False] * len(sizes)
        if OTHER in terms and linear.by_weight:
            columns.append(_by_weight(evidence, terms)[0][:, None] / NOISE_MM)
            sizes.append(1.0)
            owner.append(len(terms))
            weight.append(True)
        data = linear.data.ravel() / NOISE_MM
        arrays = (np.array(one) for one in (sizes, owner, np.multiply(weight, _ABOUT), weight))
        return cls(data, base, np.concatenate(columns, axis=1), *arrays)

    @property
    def likelihood(self):
        """Restricted log likelihood, its constants as in `ModelEvidence`."""
        solve = np.linalg.inv(np.eye(len(self.data)) + (self.columns * self.size**2) @ self.columns.T)
        inner = self.base.T @ solve @ self.base
        projector = solve - solve @ self.base @ np.linalg.inv(inner) @ self.base.T @ solve
        left = self.data - self.columns @ self.about
        value = np.linalg.slogdet(solve)[1] - np.linalg.slogdet(inner)[1] - left @ projector @ left
        return 0.5 * value

    @property
    def averaged(self):
        """Log likelihood averaged over a payload as stated, with a tenth of the deviation, and one that is not."""
        stated = replace(self, size=np.where(self.weight, 0.1 * self.size, self.size))
        return logsumexp([stated.likelihood, self.likelihood], b=[0.5, 0.5])

    @property
    def as_it_is(self):
        """Log likelihood under exactly the payload of the linearisation."""
        nothing = np.zeros(len(self.about))
        return replace(self, size=np.where(self.weight, 1e-4 * self.size, self.size), about=nothing).likelihood

    @property
    def _design(self):
        """Columns and data with the prior as more rows."""
        left = np.zeros((len(self.size), self.base.shape[1]))
        design = np.block([[self.base, self.columns], [left, np.diag(1.0 / self.size)]])
        return design, np.concatenate([self.data, self.about / self.size])

    @property
    def mean(self):
        """Coefficients (k,) by least squares of the whole."""
        design, target = self._design
        return np.linalg.lstsq(design, target, rcond=None)[0][self.base.shape[1] :]

    @property
    def covariance(self):
        """Covariance (k, k) of the coefficients, the calibration's deviations being free."""
        design, _ = self._design
        count = self.base.shape[1]
        return np.linalg.inv(design.T @ design)[count:, count:]

    def bounded_mean(self, positive):
        """Coefficients (k,) by bounded least squares."""
        design, target = self._design
        low = np.concatenate([np.full(self.base.shape[1], -np.inf), np.where(positive, 0.0, -np.inf)])
        return lsq_linear(design, target, (low, np.inf), method="bvls", tol=1e-14).x[self.base.shape[1] :]

    def explained(self, chosen):
        """Rms per axis over the noise of what some coefficients make, calibration taken out."""
        made = self.columns @ np.where(chosen, self.mean, 0.0)
        left = made - self.base @ np.linalg.lstsq(self.base, made, rcond=None)[0]
        return np.sqrt((left**2).mean())


def _by_weight(evidence, terms):
    """Change (3n,) of "other" by a step of the payload, at its size with the others except the broadest, and the
    prior scale under which it has that size.
    """
    rest, linear = [term for term in terms if term != ROUGH], evidence.linear
    known = replace(evidence, linear=replace(linear, by_weight={}))
    dense = Dense.of(known, rest, [PRIOR_SCALES[-1]] * len(rest))
    of_other = dense.owner == rest.index(OTHER)
    at_least = np.sqrt(((dense.mean / dense.size)[of_other] ** 2).mean()) * PRIOR_SCALES[-1]
    return linear.by_weight["other", 0].reshape(-1, 3) @ dense.mean[of_other], at_least


def _with_nuisance(evidence, terms, prior_scales, number, least):
    """Log likelihood where below the least prior scale of one term the payload stays, at the same cost."""
    given = Dense.of(evidence, terms, prior_scales)
    if prior_scales[number] >= least:
        return given.averaged
    raised = Dense.of(evidence, terms, (*prior_scales[:number], least, *prior_scales[number + 1 :]))
    return given.as_it_is + min(raised.averaged - raised.as_it_is, 0.0)


_SETS = [
    (ROUGH,),
    (ROUGH, FREE),
    (FREE, ROUGH),
    (FREE, ROUGH, OTHER),
    (OTHER, FREE, ROUGH),
    (ROUGH, FINE),
    (FINE, FREE, ROUGH),
]
_GRIDS = ([0.3, 3.0], [1.0, 30.0, 100.0], [0.1, 10.0])


@pytest.mark.parametrize("terms", _SETS, ids=lambda terms: "+".join(term.effect for term in terms))
@pytest.mark.parametrize("with_shapes", [False, True], ids=["", "with shapes"])
def test_scores_equal_a_dense_marginal_likelihood(terms, with_shapes):
    evidence = _evidence(1, with_shapes)
    grids = _GRIDS[: len(terms)]
    found, combinations = evidence.over_strengths(terms, grids)
    assert [tuple(one) for one in combinations] == list(product(*grids)) and found.shape == (1, len(combinations))
    expected = [Dense.of(evidence, terms, one).averaged for one in combinations]
    if with_shapes and OTHER in terms:
        # half the prior scale of what was found is the nearest one that is tried
        number, least = terms.index(OTHER), 0.5 * _by_weight(evidence, terms)[1]
        expected = [_with_nuisance(evidence, terms, one, number, least) for one in combinations]
    np.testing.assert_allclose(found[0], expected, rtol=1e-8)


@pytest.mark.parametrize("size", [3.0, 8.0, 20.0, 60.0])
@pytest.mark.parametrize("off", [0.0, 1.5, -2.5])
def test_evidence_where_the_payload_is_fitted_is_that_of_the_exact_product(size, off):
    """One coefficient c and one error w of the payload: their product c (A + w B) integrated over both."""
    generator, shape = np.random.default_rng(3), (_POINTS, 3)
    a, b = generator.normal(size=(2, *shape, 1))
    b = 0.2 * (a + b)
    data = size * NOISE_MM * a[..., 0] + NOISE_MM * generator.normal(size=shape)
    base, steps = generator.normal(size=(*shape, 3)), (("a number", off, off + 1.0, -off),)
    library = {"one": _effect([1.0], needs=("drive_load",))}
    linear = LinearizedProblem(data, base, {("one", 0): a}, {}, {}, None, {("one", 0): b}, steps)
    evidence = ModelEvidence(library, linear, np.ones(_POINTS, dtype=int), NoiseModel.white(NOISE_MM), False)
    found, grid = evidence.over_strengths((EffectTerm("one"),))
    basis, _ = np.linalg.qr(base.reshape(-1, 3))
    a, b, data = (one.reshape(-1, 1) - basis @ (basis.T @ one.reshape(-1, 1)) for one in (a, b, data))
    unit = NOISE_MM * np.sqrt(len(a) / (a**2).sum())
    w = np.linspace(-6.0, 6.0, 24_001)
    # for each w the integral over c is that of a normal number
    slope = [(a.T @ data).item() / NOISE_MM**2, (b.T @ data).item() / NOISE_MM**2]
    gram = np.array([(x.T @ y).item() for x, y in ((a, a), (a, b), (b, b))]) / NOISE_MM**2
    moment, square = slope[0] + w * slope[1], gram[0] + 2.0 * w * gram[1] + w**2 * gram[2]
    log_prior = logsumexp([norm.logpdf(w, -off, 0.1), norm.logpdf(w, -off, 1.0)], axis=0, b=0.5)
    exact = []
    for (prior_scale,) in grid:
        wide = 1.0 + square * (prior_scale * unit) ** 2
        given = 0.5 * moment**2 * (prior_scale * unit) ** 2 / wide - 0.5 * np.log(wide)
        exact.append(logsumexp(given + log_prior) + np.log(w[1] - w[0]))
    gained = found[0] - evidence.none[0]
    assert abs(logsumexp(gained) - logsumexp(exact)) < 0.3
    likely = np.array(exact) > max(exact) - 2.0
    np.testing.assert_allclose(gained[likely], np.array(exact)[likely], atol=0.3)
    # what is not likely stays so
    assert (gained[~likely] < max(exact) - 1.0).all()


def test_alone_it_is_averaged_over_all_prior_scales_and_levels():
    evidence = _evidence(2, smooth=True)
    found, grid = evidence.over_strengths((ROUGH,), levels=range(len(DISCREPANCY_SCALES)))
    assert found.shape == (len(DISCREPANCY_SCALES), len(PRIOR_SCALES)) and grid[:, 0].tolist() == PRIOR_SCALES.tolist()
    expected = [Dense.of(evidence, (ROUGH,), (prior_scale,)).likelihood for prior_scale in PRIOR_SCALES]
    np.testing.assert_allclose(found[0], expected, rtol=1e-8)
    alone, best = evidence.over_all_strengths((ROUGH,), 0)
    np.testing.assert_allclose(alone, logsumexp(expected) - np.log(len(PRIOR_SCALES)), rtol=1e-8)
    assert best[0] == PRIOR_SCALES[np.argmax(expected)]


@pytest.mark.parametrize("with_shapes", [False, True], ids=["", "with shapes"])
def test_prior_scales_averaged_in_turn_are_those_of_single_grids(with_shapes):
    """The slow way: a new problem for every term, and one that is asked for in another order each time."""
    evidence = _evidence(1, with_shapes)
    for terms in [*permutations((OTHER, FREE, ROUGH)), (FREE, OTHER, FINE, ROUGH)]:
        best, losses, highest = np.ones(len(terms)), np.zeros(len(terms)), -np.inf
        for _ in range(OPTIONS.prior_scale_sweeps):
            for k in range(len(terms)):
                grids = [[one] for one in best]
                grids[k] = PRIOR_SCALES
                value = evidence.over_strengths(terms, grids, [0])[0][0]
                best[k], highest = PRIOR_SCALES[value.argmax()], value.max()
                losses[k] = logsumexp(value) - np.log(len(PRIOR_SCALES)) - highest
        found, scales = evidence.over_all_strengths(terms, 0)
        np.testing.assert_allclose(scales, best)
        np.testing.assert_allclose(found, highest + losses.sum(), rtol=1e-9)


def test_no_effects_matter_at_a_level_that_is_left_out():
    """Not even those that explain everything but the noise."""
    evidence = _evidence(2, smooth=True)
    left_out = sorted(set(range(len(DISCREPANCY_SCALES))) - set(evidence.levels.tolist()))
    assert 0 < len(left_out) < len(DISCREPANCY_SCALES)
    for terms in _SETS:
        found, _ = evidence.over_strengths(terms, levels=left_out)
        assert found.max() < evidence.none.max() - OPTIONS.negligible_nats
    # and the limit is one of any data that the effects of a model leave
    exact = replace(evidence, linear=replace(evidence.linear, data=np.zeros_like(evidence.linear.data)))
    limits = [evidence._whitened.none(level)[1] for level in left_out]
    np.testing.assert_allclose([exact.none[level] for level in left_out], limits, rtol=1e-12)


@pytest.mark.parametrize("terms", _SETS[:-2], ids=lambda terms: "+".join(term.effect for term in terms))
def test_a_broad_term_is_what_the_same_term_is_that_is_not(terms):
    """At every level of a smooth discrepancy: being averaged over first changes nothing."""
    broad = _evidence(3, with_shapes=True, smooth=True)
    # the changes by the payload are made with coefficients found together with the broad term
    broad = replace(broad, linear=replace(broad.linear, by_weight={}))
    rough = LIBRARY["rough"].coordinates
    plain = replace(
        broad, library=LIBRARY | {"rough": SimpleNamespace(coordinates=replace(rough, broad=False), needs=())}
    )
    grids = _GRIDS[: len(terms)]
    np.testing.assert_allclose(broad.over_strengths(terms, grids)[0], plain.over_strengths(terms, grids)[0], rtol=1e-9)


def _with_positive(evidence, terms, prior_scales):
    """Log likelihood with the positive half of the prior of "pull", by quadrature over its coefficient."""
    others = tuple(term for term in terms if term != PULL)
    number = terms.index(PULL)
    rest = Dense.of(evidence, others, np.delete(prior_scales, number))
    pull = Dense.of(evidence, (PULL,), [prior_scales[number]])
    column, size = pull.columns[:, 0], pull.size[0]

    def log_density(c):
        moved = replace(rest, data=rest.data - c * column)
        return moved.likelihood - 0.5 * (c / size) ** 2 - np.log(size * np.sqrt(0.5 * np.pi))

    # a parabola in the coefficient: three of its values determine it
    a, b, c = np.polyfit([-size, 0.0, size], [log_density(x) for x in (-size, 0.0, size)], 2)
    top, width = -0.5 * b / a, (-2.0 * a) ** -0.5
    low = max(top - 12.0 * width, 0.0)
    shift = max(a * x * x + b * x + c for x in (low, max(top, 0.0)))
    area, _ = quad(lambda x: np.exp(a * x * x + b * x + c - shift), low, max(top, 0.0) + 12.0 * width, limit=200)
    return shift + np.log(area)


@pytest.mark.parametrize("terms", [(ROUGH, PULL), (PULL, ROUGH), (PULL, FREE, ROUGH)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_with_a_positive_coefficient_half_its_prior_is_left(terms, sign):
    evidence = _evidence(4)
    linear = evidence.linear
    evidence = replace(evidence, linear=replace(linear, data=sign * linear.data))
    grids = _GRIDS[: len(terms)]
    found, combinations = evidence.over_strengths(terms, grids)
    expected = [_with_positive(evidence, terms, one) for one in combinations]
    np.testing.assert_allclose(found[0], expected, rtol=1e-6)


@pytest.mark.parametrize("terms", _SETS, ids=lambda terms: "+".join(term.effect for term in terms))
@pytest.mark.parametrize("with_shapes", [False, True], ids=["", "with shapes"])
def test_coefficients_and_what_they_explain_are_the_direct_solution(terms, with_shapes):
    evidence = _evidence(5, with_shapes)
    # the payload's share of it has a test of its own
    evidence = replace(evidence, linear=replace(evidence.linear, by_weight={}))
    prior_scales = np.array([3.0, 0.5, 10.0])[: len(terms)]
    dense = Dense.of(evidence, terms, prior_scales)
    found = evidence._mean(terms, prior_scales, 0)
    np.testing.assert_allclose(found, dense.mean, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(evidence.coefficients(terms, prior_scales, 0)[0], dense.mean, rtol=1e-6, atol=1e-9)
    value = np.full(len(DISCREPANCY_SCALES), -np.inf)
    value[0] = 0.0
    hypothesis = Hypothesis(terms, value, np.tile(prior_scales, (len(DISCREPANCY_SCALES), 1)))
    for names in ({"rough"}, {"free"}, {"free", "rough"}, {term.effect for term in terms}):
        chosen = np.array([*(term.effect in names for term in terms), True])[dense.owner]
        expected = dense.explained(chosen) if names & hypothesis.effects else 0.0
        assert evidence.explained(hypothesis, names) == pytest.approx(expected, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("terms", [(OTHER,), (FREE, OTHER)])
def test_under_an_unknown_weight_coefficients_are_a_mixtures(terms):
    """Means and covariance of both cases by their probabilities, each by least squares of the whole."""
    evidence, prior_scales = _evidence(6, with_shapes=True), {1: [300.0], 2: [3.0, 300.0]}[len(terms)]
    wide = Dense.of(evidence, terms, prior_scales)
    cases = [replace(wide, size=np.where(wide.weight, share * wide.size, wide.size)) for share in (0.1, 1.0)]
    chance = np.exp([one.likelihood - logsumexp([case.likelihood for case in cases]) for one in cases])
    expected = chance @ [one.mean for one in cases]
    spread = sum(
        p * (one.covariance + np.outer(one.mean - expected, one.mean - expected))
        for p, one in zip(chance, cases, strict=True)
    )
    mean, covariance = evidence.coefficients(terms, prior_scales, 0)
    np.testing.assert_allclose(mean, expected, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(covariance, spread, rtol=1e-6, atol=1e-12)
    assert chance.min() > 0.0 and wide.weight[-1]


@pytest.mark.parametrize("terms", [(ROUGH, PULL), (PULL, FREE, ROUGH), (PULL, ROUGH, OTHER)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_coefficients_that_cannot_be_negative_are_bounded_least_squares(terms, sign):
    evidence = _evidence(6)
    linear = evidence.linear
    evidence = replace(evidence, linear=replace(linear, data=sign * linear.data))
    prior_scales = np.array([3.0, 1.0, 10.0])[: len(terms)]
    dense = Dense.of(evidence, terms, prior_scales)
    positive = dense.owner == terms.index(PULL)
    expected = dense.bounded_mean(positive)
    found = evidence._mean(terms, prior_scales, 0)
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-7)
    assert (expected[positive] == 0.0).all() == (sign < 0.0)


def test_an_average_is_an_integral_over_the_coefficients():
    """Of normal densities: data with the averaged columns in their covariance, the others' coefficients given."""
    generator = np.random.default_rng(7)
    columns, data, size = generator.normal(size=(9, 5)), generator.normal(size=9), generator.uniform(0.3, 2.0, 3)
    index, others = np.array([1, 2, 4]), np.array([0, 3])
    gram0 = gram = columns.T @ columns
    made = Average(gram, columns.T @ data, index, size)
    averaged = np.eye(9) + (columns[:, index] * size**2) @ columns[:, index].T
    assert np.flatnonzero(made.others).tolist() == others.tolist()
    ratio = multivariate_normal.logpdf(data, cov=averaged) - multivariate_normal.logpdf(data, cov=np.eye(9))
    assert made.evidence == pytest.approx(ratio, rel=1e-9)
    for values in generator.normal(size=(4, 2)):
        moved = multivariate_normal.logpdf(data - columns[:, others] @ values, cov=averaged)
        gram, moment = made.rest(others)
        predicted = moment @ values - 0.5 * values @ gram @ values
        assert moved - multivariate_normal.logpdf(data, cov=averaged) == pytest.approx(predicted, rel=1e-8)
    gram, moment = made.rest(np.array([3]))
    whole = made.rest(others)
    assert gram[0, 0] == pytest.approx(whole[0][1, 1]) and moment[0] == pytest.approx(whole[1][1])
    assert (made.across[index] == 0.0).all()
    assert np.flatnonzero(Average(gram0, columns.T @ data, index, size, [0]).others).tolist() == [3]
    values = generator.normal(size=2)
    design = np.concatenate([columns[:, index], np.diag(1.0 / size)])
    target = np.concatenate([data - columns[:, others] @ values, np.zeros(3)])
    expected = np.linalg.lstsq(design, target, rcond=None)[0]
    found = Average(columns.T @ columns, columns.T @ data, index, size).mean(others, values)
    np.testing.assert_allclose(found, expected, rtol=1e-8)


def test_of_sizes_that_the_campaign_has_chosen_one_prior_scale_is_just_these():
    """Many coefficients determine their common size far better than the grid of prior scales."""
    plain, rough = _evidence(8), LIBRARY["rough"].coordinates
    for factor in (0.01, 0.17, 1.0, 2.3):
        typical = factor * rough.typical
        sized = SimpleNamespace(coordinates=replace(rough, typical=typical, sized=True))
        evidence = replace(plain, library=LIBRARY | {"rough": sized})
        scales = np.array([evidence.scales((ROUGH,), [prior_scale]) for prior_scale in PRIOR_SCALES])
        shares = scales / typical
        np.testing.assert_allclose(shares, np.tile(shares[:, :1], len(typical)), rtol=1e-9)
        assert np.abs(shares[:, 0] - 1.0).min() < 1e-9
        np.testing.assert_allclose(shares[:, 0] / shares[0, 0], PRIOR_SCALES / PRIOR_SCALES[0], rtol=1e-9)
