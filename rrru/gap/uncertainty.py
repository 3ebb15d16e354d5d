"""How sure the corrected sim's numbers are: calibration and effects together.

With coefficients c of covariance S and deviations b that follow them, b | c ~ N(F c + .., C):

    cov(b) = C + F S F',    cov(b, c) = F S
"""

import numpy as np

from rrru.gap.terms import spread


def fitted_terms(attribution):
    """The terms whose coefficients the state holds, in the order of its covariance."""
    return [term for term in attribution.hypothesis.terms if (term.effect, term.shape) in attribution.state.effects]


def coefficient_covariance(attribution):
    """Covariance (k, k) of the coefficients of `fitted_terms`."""
    terms, level = fitted_terms(attribution), attribution.level
    count = sum(spread(attribution.case.library[t.effect].coordinates, t.legs).shape[1] for t in terms)
    if len(attribution.covariance) == count:
        return attribution.covariance
    # the state was fitted with other choices of legs
    strengths = attribution.hypothesis.strengths_of(terms, level)
    return attribution.evidence.coefficients(terms, strengths, level)[1][:count, :count]


def covariance_of(attribution):
    """Covariance (p + k, p + k) of the deviations, and after them of the coefficients of `fitted_terms`."""
    terms, own = fitted_terms(attribution), coefficient_covariance(attribution)
    given, follows = attribution.evidence.calibration(terms, attribution.level)
    across = follows @ own
    return np.block([[given + across @ follows.T, across], [across.T, own]])


def one_sigma_steps(attribution):
    """Independent errors of one standard deviation each: deviations (q, p), and coordinates (q, c) by key of effect."""
    covariance, count = covariance_of(attribution), len(attribution.state.deviations)
    size = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    share, axes = np.linalg.eigh(covariance / np.outer(size, size))
    steps = (size[:, None] * axes * np.sqrt(np.maximum(share, 0.0))).T
    result, start = {}, count
    for term in fitted_terms(attribution):
        matrix = spread(attribution.case.library[term.effect].coordinates, term.legs)
        result[term.effect, term.shape] = steps[:, start : start + matrix.shape[1]] @ matrix.T
        start += matrix.shape[1]
    return steps[:, :count], result
