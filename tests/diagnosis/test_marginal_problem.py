"""Least squares with priors: against scipy's bounded least squares, and whatever the order of the terms."""

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from rrru.diagnosis.evidence import ModelEvidence
from rrru.diagnosis.marginal_problem import MarginalProblem, posterior_mean
from rrru.diagnosis.terms import EffectTerm
from tests.diagnosis.test_evidence import LIBRARY, _evidence

GRIDS = [0.3, 10.0, 100.0], [1.0, 30.0], [3.0, 300.0]


def _problem(generator, size, positive, alike):
    """Least squares of rows, and the MarginalProblem of them; the columns are alike except for a share of
    10^-alike.
    """
    design = generator.normal(size=(3 * size, 1)) + 10.0**-alike * generator.normal(size=(3 * size, size))
    data, nothing = generator.normal(size=3 * size), np.zeros(size)
    prior = nothing + 1.0, nothing + np.inf, positive, nothing
    gram, moment = (design.T @ design)[None], (data @ design)[None]
    return design, data, MarginalProblem(gram, moment, *prior, np.zeros(size, dtype=int), np.arange(size))


@pytest.mark.parametrize("alike", [0, 2, 4])
@pytest.mark.parametrize("signs", ["all", "mixed", "one"])
def test_the_mean_is_that_of_bounded_least_squares(signs, alike):
    generator, bound = np.random.default_rng(7), 0
    for size in (1, 2, 5, 12, 40):
        positive = {"all": np.ones(size), "mixed": np.arange(size) % 2, "one": np.arange(size) == size - 1}[signs] > 0
        design, data, problem = _problem(generator, size, positive, alike)
        scale = 10.0 ** generator.uniform(-1.0, 1.5, size)
        rows, values = np.concatenate([design * scale, np.eye(size)]), np.concatenate([data, np.zeros(size)])
        found = posterior_mean(problem, scale)
        expected = lsq_linear(rows, values, (np.where(positive, 0.0, -np.inf), np.inf), "bvls", tol=1e-14).x
        assert (found[positive] >= 0.0).all()
        bound += (found[positive] == 0.0).sum()
        np.testing.assert_allclose(found, scale * expected, rtol=1e-6, atol=1e-8 * scale.max())
    assert bound


def asked(evidence, terms, grids):
    """Answers to a set of terms by the order in which they were asked for, in the order given."""
    answers = {}
    for order in permutations(range(len(terms))):
        values, _ = evidence.over_strengths([terms[k] for k in order], [grids[k] for k in order], [0])
        shape = [len(grids[k]) for k in order]
        answers[order] = np.transpose(values.reshape(shape), np.argsort(order))
    return answers


def the_same(answers):
    first, *others = answers.values()
    for other in others:
        np.testing.assert_allclose(other, first, rtol=1e-9)


def coefficients_of(evidence, terms, order):
    """Means of the terms' coefficients, of each term its own, and what comes after these."""
    mean, _ = evidence.coefficients([terms[k] for k in order], np.full(len(terms), 10.0), 0)
    counts = [len(evidence.library[terms[k].effect].coordinates) for k in order]
    parts = np.split(mean, np.cumsum(counts))
    return [*(parts[order.index(k)] for k in range(len(terms))), np.sort(parts[-1])]


def test_the_order_of_the_terms_makes_no_difference():
    """Neither to a new result nor to one cached from another order."""
    terms = EffectTerm("free"), EffectTerm("legged")
    evidence = _evidence(seed=3, with_shapes=True)
    linear = evidence.linear
    nuisance_sd = {"free": linear.shape_columns["free"], "legged": linear.shape_columns["free"][..., :1]}
    evidence = replace(evidence, linear=replace(linear, shape_columns=nuisance_sd))
    cached = asked(evidence, terms, GRIDS)
    the_same(cached)
    fresh = ModelEvidence(LIBRARY, evidence.linear, evidence.run, evidence.noise)
    anew, _ = fresh.over_strengths(terms[::-1], GRIDS[1::-1], [0])
    np.testing.assert_allclose(anew.reshape(2, 3).T, cached[0, 1], rtol=1e-9)
    for one, other in zip(*(coefficients_of(evidence, terms, order) for order in ((0, 1), (1, 0))), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-7)
