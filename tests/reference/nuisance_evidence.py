"""Evidence of effects with payload and tilt as nuisance parameters, their products with the coefficients exact.

The loads' columns are linear in the nuisance parameters w, and so is the model in the coefficients c at known w,

    d = (X + sum_j w_j Y_j) c + e,    p(d) = integral of p(d | w) p(w) dw,

with p(w) the mixture of `rrru.diagnosis.payload_nuisance` and p(d | w) the evidence of a linear model.
`rrru.diagnosis.payload_nuisance` replaces w_j c by w_j times the coefficients found under weak priors, which is a
linearisation and fast. Here the integral over w, one to four parameters, is importance sampling from a mixture of the
prior and a t distribution that is fitted to earlier draws (Cappe, Douc, Guillin, Marin and Robert, Adaptive importance
sampling in general mixture classes, Statistics and Computing 18, 2008). The difference of both shows how far off the
linearisation is.
"""

from typing import NamedTuple

import numpy as np
from scipy.stats import multivariate_t, norm

from rrru.diagnosis.evidence_kernels import log_evidence, log_sum_exp
from rrru.diagnosis.payload_nuisance import cases_of

# share of draws from the prior, which bounds the weights, and degrees of freedom of the fitted t distribution
_PRIOR_DRAW_SHARE, _DEGREES_OF_FREEDOM = 0.2, 5.0
# draws of each round that fits it, most rounds, effective share of the draws that ends them
_DRAWS_PER_ROUND, _MAX_ROUNDS, _MIN_EFFECTIVE_SHARE = 1024, 12, 0.3
# factor by which its variances exceed those of the draws
_VARIANCE_FACTOR = 1.2
# smallest variance of a proposal, over that of the prior
_MIN_VARIANCE_RATIO = 1e-6
# draws whose Gram matrices are made at a time
_MAX_DRAWS_PER_BLOCK = 512


class SampledEvidence(NamedTuple):
    """Log evidence over that of no effect, its standard error, and the effective number of draws."""

    log: float
    error: float
    size: float


class ProductModel(NamedTuple):
    """Linear models of k coefficients at known nuisance parameters (q,).

    gram (r, r), moment (r,): of the columns; mix (1 + q, r, k): the columns of each coefficient are mix[0] plus the
    nuisance parameters times the others; scale, positive (k,): prior of the coefficients; mean (q,): of the prior of
    the nuisance parameters; log_chance (c,), sd (c, q): of its cases.
    """

    gram: np.ndarray
    moment: np.ndarray
    mix: np.ndarray
    scale: np.ndarray
    positive: np.ndarray
    mean: np.ndarray
    log_chance: np.ndarray
    sd: np.ndarray

    @classmethod
    def make(cls, problem, blocks, steps, grams, prior_scales):
        """Model of a MarginalProblem without nuisance parameters at prior_scales (terms,).

        blocks, steps: as in `rrru.diagnosis.payload_nuisance.with_nuisance`; grams: as in
        `rrru.diagnosis.marginal_problem.MarginalProblem.of`, of one level.
        """
        k, q = len(problem.size), len(steps)
        index = np.concatenate([problem.index, *(numbers.ravel() for _, numbers in blocks.values())])
        mix = np.zeros((1 + q, len(index), k))
        mix[0, :k] = np.eye(k)
        row = k
        for term, (matrix, _) in blocks.items():
            for parameter in range(q):
                mix[1 + parameter, row : row + len(matrix), problem.owner == term] = matrix.T
                row += len(matrix)
        (gram,), (moment,) = grams(index)
        scale = problem.scale(np.asarray(prior_scales, dtype=float)[None])[0]
        mean = np.array([step[-1] for step in steps])
        return cls(gram, moment, mix, scale, problem.positive, mean, *cases_of([step[0] for step in steps]))

    def log_likelihood(self, nuisance):
        """Log evidence (n,) of the coefficients at nuisance parameters (n, q)."""
        parts = []
        for some in np.split(nuisance, range(_MAX_DRAWS_PER_BLOCK, len(nuisance), _MAX_DRAWS_PER_BLOCK)):
            mix = self.mix[0] + np.tensordot(some, self.mix[1:], 1)
            turned = mix.transpose(0, 2, 1)
            parts.append(log_evidence(turned @ self.gram @ mix, turned @ self.moment, self.scale[None], self.positive))
        return np.concatenate(parts)[:, 0]

    def log_prior(self, nuisance):
        """Log prior density (n,) of nuisance parameters (n, q)."""
        each = norm.logpdf(nuisance[:, None], self.mean, self.sd).sum(axis=-1)
        return log_sum_exp(each + self.log_chance)

    def draw_prior(self, generator, count):
        """Nuisance parameters (n, q) from the prior."""
        case = generator.choice(len(self.sd), count, p=np.exp(self.log_chance))
        return self.mean + self.sd[case] * generator.standard_normal((count, len(self.mean)))


def sample_evidence(model, generator, draws=4096):
    """SampledEvidence of a ProductModel by so many draws of a numpy Generator, after those that fit the proposal."""
    widest = np.diag(model.sd.max(axis=0) ** 2)
    proposal = model.mean, widest
    for _ in range(_MAX_ROUNDS):
        nuisance, log = _draw(model, proposal, generator, _DRAWS_PER_ROUND)
        share = np.exp(log - log_sum_exp(log))
        center = share @ nuisance
        apart = nuisance - center
        covariance = _VARIANCE_FACTOR * (share[:, None] * apart).T @ apart
        proposal = center, covariance + _MIN_VARIANCE_RATIO * widest
        if 1.0 / (share**2).sum() > _MIN_EFFECTIVE_SHARE * _DRAWS_PER_ROUND:
            break
    _, log = _draw(model, proposal, generator, draws)
    weight = np.exp(log - log.max())
    error = weight.std() / weight.mean() / np.sqrt(draws)
    size = weight.sum() ** 2 / (weight**2).sum()
    return SampledEvidence(float(np.log(weight.mean()) + log.max()), float(error), float(size))


def _draw(model, proposal, generator, count):
    """Nuisance parameters (n, q) from prior and proposal (mean, covariance), and logarithms (n,) of their weights."""
    density = multivariate_t(*proposal, df=_DEGREES_OF_FREEDOM)
    fitted = np.reshape(density.rvs(count, random_state=generator), (count, -1))
    from_prior = generator.random((count, 1)) < _PRIOR_DRAW_SHARE
    nuisance = np.where(from_prior, model.draw_prior(generator, count), fitted)
    prior = model.log_prior(nuisance)
    own = np.log1p(-_PRIOR_DRAW_SHARE) + np.atleast_1d(density.logpdf(nuisance))
    drawn_from = np.logaddexp(own, np.log(_PRIOR_DRAW_SHARE) + prior)
    return nuisance, model.log_likelihood(nuisance) + prior - drawn_from
