"""Payload and tilt as nuisance parameters: against quadrature, and how far off the fast linearisation is."""

from functools import cache, partial

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import norm

from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.evidence_kernels import log_evidence
from rrru.diagnosis.marginal_problem import PRIOR_SCALES
from rrru.diagnosis.terms import EffectTerm
from tests.diagnosis import arms, campaigns
from tests.reference.nuisance_evidence import ProductModel, sample_evidence

# nats that the linearisation is off at most, where the effect acts that bears the loads
_MAX_ERROR_NATS = 0.25


def _model(count, nuisance, positive, seed=0):
    """A model of random columns, every coefficient's with one further column a nuisance parameter."""
    generator = np.random.default_rng(seed)
    design = generator.normal(size=(20, count * (1 + nuisance)))
    mix = np.zeros((1 + nuisance, design.shape[1], count))
    for block in range(1 + nuisance):
        mix[block, block * count : (block + 1) * count] = np.eye(count)
    truth = np.abs(generator.normal(size=count))
    data = design @ (mix[0] + 0.5 * mix[1:].sum(axis=0)) @ truth + generator.normal(size=20)
    chance, sd = np.log([0.5, 0.5]), np.array([np.full(nuisance, 0.1), np.full(nuisance, 1.0)])
    prior = np.full(count, 2.0), np.full(count, positive), np.full(nuisance, 0.2)
    return ProductModel(design.T @ design, design.T @ data, mix, *prior, chance, sd)


def _integrate(model):
    """Log evidence of one coefficient and one nuisance parameter on a dense grid."""
    c, w = np.linspace(-12.0, 12.0, 4001), np.linspace(-6.0, 6.0, 2001)
    if model.positive[0]:
        c = np.linspace(0.0, 12.0, 4001)[1:]
    column = np.stack([np.ones(len(w)), w])
    gram = np.einsum("in,ij,jn->n", column, model.gram, column)
    log = np.outer(model.moment @ column, c) - 0.5 * np.outer(gram, c**2)
    log += norm.logpdf(c, scale=model.scale[0]) + np.log(2.0 if model.positive[0] else 1.0)
    prior = logsumexp(norm.logpdf(w[:, None], model.mean[0], model.sd[:, 0]) + model.log_chance, axis=1)
    return logsumexp(log + prior[:, None]) + np.log((c[1] - c[0]) * (w[1] - w[0]))


@pytest.mark.parametrize("positive", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_one_product_is_that_of_quadrature(positive, seed):
    model = _model(1, 1, positive, seed)
    sampled = sample_evidence(model, np.random.default_rng(seed))
    assert sampled.error < 0.03 and abs(sampled.log - _integrate(model)) < 4.0 * sampled.error + 0.003


def test_without_products_the_nuisance_changes_nothing():
    model = _model(3, 2, True)
    model = model._replace(mix=model.mix * np.array([1.0, 0.0, 0.0])[:, None, None])
    gram, moment = model.gram[:3, :3], model.moment[:3]
    expected = log_evidence(gram[None], moment[None], model.scale[None], model.positive)[0, 0]
    sampled = sample_evidence(model, np.random.default_rng(1))
    assert abs(sampled.log - expected) < 4.0 * sampled.error + 0.003


def test_the_same_seed_gives_the_same_numbers():
    model = _model(2, 3, True)
    first, second = (sample_evidence(model, np.random.default_rng(5)) for _ in range(2))
    assert first == second and first.size > 500.0


@cache
def _evidence(robot):
    """Evidence of a robot whose drives are soft."""
    if robot == "3-RRRU":
        problem = campaigns.problem_of(campaigns.measure((campaigns.strong("drive_compliance", 3.0, 1),)))
    else:
        soft = arms.active("drive_compliance", [1e-9, 2e-9, 1e-9, 0.0, 1e-9, 0.0])
        problem = arms.problem_of(arms.measure((soft,), 60), "backlash", "drive_compliance")
    return problem.evidence(problem.linearise(calibrate(problem)))


@pytest.mark.parametrize("robot", ["3-RRRU", "arm"])
@pytest.mark.parametrize("names", [("drive_compliance",), ("drive_compliance", "backlash")])
def test_the_linearisation_is_a_quarter_of_a_nat_off_where_the_effect_acts(robot, names):
    terms = tuple(map(EffectTerm, names))
    evidence = _evidence(robot).on_complete(terms)
    grids = PRIOR_SCALES, *([1.0],) * (len(terms) - 1)
    found, grid = evidence.over_strengths(terms, grids, [0])
    grams = partial(evidence._grams, [0])
    parts = evidence._without_nuisance(terms, grams), evidence._blocks(terms), evidence.linear.weight_steps, grams
    sampled = [sample_evidence(ProductModel.make(*parts, row), np.random.default_rng(2)) for row in grid]
    exact, error, _ = np.transpose(sampled)
    averaged = logsumexp(found[0] - evidence.none[0])
    assert error[exact.argmax()] < 0.03 and abs(averaged - logsumexp(exact)) < _MAX_ERROR_NATS
    assert np.argmax(found[0]) == np.argmax(exact)
