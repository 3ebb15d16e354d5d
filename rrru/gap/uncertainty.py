"""How sure the corrected sim's numbers are: calibration and effects together.

With coefficients c of covariance S and deviations b that follow them, b | c ~ N(F c + .., C):

    cov(b) = C + F S F',    cov(b, c) = F S
"""

import numpy as np

from rrru.gap.terms import spread

# standard errors from which on the weight is told to be off
_TOLD = 3.0


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


def weight_of(attribution):
    """What the weight is off by: name, unit, value and standard error of each number, nothing where none was fitted."""
    terms, level, linear = fitted_terms(attribution), attribution.level, attribution.evidence.linear
    weight = attribution.state.weight
    if not weight or not attribution.evidence.projected(terms, [level]).weights:
        return []
    strengths = attribution.hypothesis.strengths_of(terms, level)
    errors = attribution.evidence.weight_errors(terms, strengths, level)
    return [
        (name, "kg" if name.endswith("kg") else "rad", weight[name], float(abs(stepped - value) * error))
        for (name, value, stepped, _), error in zip(linear.weight_steps, errors, strict=True)
    ]


def weight_notes(attribution):
    """Sentences on what the weight is surely off by."""
    for name, unit, value, error in weight_of(attribution):
        if abs(value) > _TOLD * error:
            what = "more at the platform" if unit == "kg" else f"that the base leans about {name[-1]}"
            yield f"weight not as told: {value:.3g} +- {error:.2g} {unit} {what}"


def covariance_of(attribution):
    """Covariance (p + k, p + k) of the deviations, and after them of the coefficients of `fitted_terms`."""
    terms, own = fitted_terms(attribution), coefficient_covariance(attribution)
    given, follows = attribution.evidence.calibration(terms, attribution.level)
    across = follows @ own
    return np.block([[given + across @ follows.T, across], [across.T, own]])


def deviation_errors(attribution):
    """Standard errors (p,) of the deviations."""
    return np.sqrt(np.diag(covariance_of(attribution))[: len(attribution.state.deviations)])


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
