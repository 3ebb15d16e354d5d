"""Which effects cause the gap: calibrate, look for the best set, fit it on the exact sim, look again from there."""

from dataclasses import dataclass, replace

import numpy as np

from rrru.campaign import measurements as rows
from rrru.errors import FitError
from rrru.fit.least_squares import least_squares
from rrru.fit.residuals import Residuals
from rrru.gap.case import State
from rrru.gap.evidence import Evidence
from rrru.gap.noise import estimate_noise, spoilt
from rrru.gap.posterior import posterior
from rrru.gap.refine import refine
from rrru.gap.search import Hypothesis, search
from rrru.gap.unknown import UNKNOWN

_MOST_ROUNDS, _MOST_CLEANINGS = 4, 3
# a gap of fewer times the noise is linear in everything that can cause it
_SMALL = 10.0


@dataclass(frozen=True)
class Attribution:
    """What the search has found.

    calibrated: State of the calibration alone; state: of the best hypothesis, fitted on the exact sim, with the
    covariance (k, k) of its terms' coefficients; evidence: on the last linearisation, about that state; posterior over
    all hypotheses; hypothesis, level: the best one and its discrepancy level; noise_from: "given", "repeats" or
    "high_frequency"; dropped: number of points left out as spoilt.
    """

    case: object
    calibrated: State
    state: State
    covariance: np.ndarray
    evidence: Evidence
    posterior: object
    hypothesis: object
    level: int
    noise_from: str
    dropped: int


def calibrate(case):
    """State of the plain calibration of the case's used points; raises FitError where there are too few of them."""
    frame = case.measurements.iloc[np.flatnonzero(case.used)]
    fit = least_squares(Residuals(case.mechanism, rows.actuators(frame), rows.measured(frame), rows.command(frame)))
    return State(fit.deviations, {})


def attribute(case, prior, noise_from="given"):
    """Attribution of a case; its noise is estimated first where noise_from is not "given"."""
    total = len(case)
    for cleaning in range(_MOST_CLEANINGS + 1):
        calibrated = calibrate(case)
        if noise_from != "given":
            # spikes would pass for noise
            bad = spoilt(case, case.measured_mm - case.model(calibrated), 0.0)
            if bad.any():
                case = case.without(bad)
                calibrated = calibrate(case)
            noise, noise_from = estimate_noise(case, case.linearise(calibrated))
            case = replace(case, noise_mm=noise)
        found = _rounds(case, calibrated, prior)
        bad = spoilt(case, case.measured_mm - case.model(found[0]), case.noise_mm)
        if cleaning == _MOST_CLEANINGS or not bad.any():
            break
        case = case.without(bad)
    state, covariance, evidence, beliefs, hypothesis, level = found
    return Attribution(
        case, calibrated, state, covariance, evidence, beliefs, hypothesis, level, noise_from, total - len(case)
    )


def settle(found, effects):
    """The attribution with its hypothesis and state those of exactly the named effects, fitted anew; the posterior
    stays.
    """
    if found.hypothesis.effects == frozenset(effects):
        return found
    known = found.posterior.best_of(frozenset(effects))
    if known is None:
        chosen = [k for k, term in enumerate(found.hypothesis.terms) if term.effect in effects]
        terms = tuple(found.hypothesis.terms[k] for k in chosen)
        known = Hypothesis(terms, found.evidence.score(terms), found.hypothesis.strengths[:, chosen]), found.level
    hypothesis, level = known
    if not hypothesis.terms:
        return replace(found, hypothesis=hypothesis, level=level, state=found.calibrated, covariance=np.zeros((0, 0)))
    try:
        state, covariance = refine(found.case, found.state, hypothesis, level)
    except FitError:
        # the exact sim cannot follow: only the linear one is corrected
        return replace(found, hypothesis=hypothesis, level=level, state=found.calibrated, covariance=np.zeros((0, 0)))
    return replace(found, hypothesis=hypothesis, level=level, state=state, covariance=covariance)


def _rounds(case, calibrated, prior):
    """Search and refinement in turn until the best hypothesis repeats itself."""
    state, covariance, last = calibrated, np.zeros((0, 0)), None
    linear = case.linearise(state)
    evidence = Evidence(case.library, linear, case.run, case.noise_mm)
    # where an unknown function wins, a second look from its fit shows nothing else, unless the gap is too large for the
    # linear sim or a law's shape is still to be fitted
    small = np.sqrt((linear.data**2).mean()) < _SMALL * case.noise_mm
    for _ in range(_MOST_ROUNDS):
        beliefs = posterior(evidence, search(evidence), prior)
        hypothesis, level = beliefs.best()
        if not hypothesis.terms:
            return calibrated, np.zeros((0, 0)), evidence, beliefs, hypothesis, level
        shaped = any(len(case.library[term.effect].coordinates.shapes) > 1 for term in hypothesis.terms)
        unknown = not hypothesis.effects.isdisjoint(UNKNOWN)
        if last == frozenset(hypothesis.terms) or (small and not shaped and unknown):
            break
        first, last = last is None, frozenset(hypothesis.terms)
        if first and shaped and unknown:
            # a law off the grid of its shapes gets its chance before an unknown function takes what it leaves
            hypothesis, level = beliefs.best_of(hypothesis.effects - set(UNKNOWN)) or (hypothesis, level)
        try:
            state, covariance = refine(case, state, hypothesis, level)
            evidence = Evidence(case.library, case.linearise(state), case.run, case.noise_mm)
        except FitError:
            # the sim cannot follow: what the last linearisation says stands
            break
    return state, covariance, evidence, beliefs, hypothesis, level
