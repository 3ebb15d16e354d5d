"""Which effects cause the gap: calibrate, look for the best set, fit it on the exact sim, look again from there."""

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rrru.campaign import measurements as rows
from rrru.campaign import noise
from rrru.errors import FitError
from rrru.fit.least_squares import least_squares
from rrru.fit.residuals import Residuals
from rrru.gap.case import Case, State
from rrru.gap.evidence import ModelEvidence
from rrru.gap.heldout import HeldOut
from rrru.gap.posterior import Posterior, posterior
from rrru.gap.refine import refine
from rrru.gap.search import Hypothesis, search
from rrru.gap.unknown import UNKNOWN

_MOST_ROUNDS, _MOST_CLEANINGS = 4, 3
# a gap of fewer times the noise is linear in everything that can cause it
_SMALL = 10.0
_NO_COVARIANCE = np.zeros((0, 0))


@dataclass(frozen=True)
class Attribution:
    """What the search has found.

    calibrated: State of the calibration alone; state: of the best hypothesis, fitted on the exact sim, with the
    covariance (k, k) of its terms' coefficients; evidence: on the last linearisation, about that state; posterior over
    all hypotheses; hypothesis, level: the best one and its discrepancy level; noise_from: "given", "repeats" or
    "high_frequency"; dropped: number of points left out as outliers.
    """

    case: Case
    calibrated: State
    state: State
    covariance: np.ndarray
    evidence: ModelEvidence
    posterior: Posterior
    hypothesis: Hypothesis
    level: int
    noise_from: str = "given"
    dropped: int = 0

    @cached_property
    def held_out(self):
        """Predictions of left-out points."""
        return HeldOut(self.case, self.evidence)

    def believing(self, beliefs):
        """The attribution with another posterior and its best hypothesis; the state stays."""
        hypothesis, level = beliefs.best()
        return replace(self, posterior=beliefs, hypothesis=hypothesis, level=level)


def calibrate(case):
    """State of the plain calibration of the case's used points; raises FitError where there are too few of them."""
    frame = case.measurements[case.used]
    driven = rows.actuators(frame, case.mechanism), rows.measured(frame), rows.command(frame)
    fit = least_squares(Residuals(case.mechanism, *driven, rows.readings(frame, case.arm_mm)))
    return State(fit.deviations, {})


def with_arm(case, noise_mm=None, noise_rad=None):
    """The case with orientations at the arm that gives them the positions' noise; what is not given is estimated."""
    positions, turned, _ = _rough(case, calibrate(case))
    positions, turned = noise_mm or positions, noise_rad or turned / case.arm_mm
    return replace(case, arm_mm=positions / turned)


def with_noise(case, calibrated):
    """The case with its noise estimated, and where from: from what neither calibration nor any effect can fit."""
    noise_mm, _, source = _rough(case, calibrated)
    return replace(case, noise_mm=noise_mm), source


def _rough(case, calibrated):
    """`rrru.campaign.noise.estimate` of a case with everything fitted that may be."""
    linear = case.linearise(calibrated)
    columns = np.concatenate([linear.base, *linear.columns.values()], axis=-1)
    if columns.shape[-1] > len(case):
        # too few points to fit everything: what the calibration leaves has to do
        columns = linear.base
    used = case.measurements[case.used]
    return noise.estimate(used, linear.data, columns, rows.readings(used, case.arm_mm))


def attribute(case, prior, noise_from="given"):
    """Attribution of a case; its noise is estimated first where noise_from is not "given"."""
    total = case.count
    for cleaning in range(_MOST_CLEANINGS + 1):
        calibrated = calibrate(case)
        if noise_from != "given":
            # spikes would pass for noise
            outliers = noise.isolated(case.residual(calibrated), case.series, 0.0)
            if outliers.any():
                case = case.without(outliers)
                calibrated = calibrate(case)
            case, noise_from = with_noise(case, calibrated)
        attribution = _rounds(case, calibrated, prior)
        outliers = noise.isolated(case.residual(attribution.state), case.series, case.noise_mm)
        if cleaning == _MOST_CLEANINGS or not outliers.any():
            break
        case = case.without(outliers)
    return replace(attribution, noise_from=noise_from, dropped=total - case.count)


def with_effects(attribution, effects):
    """The attribution with hypothesis and state of exactly the named effects, fitted anew; the posterior stays."""
    if attribution.hypothesis.effects == frozenset(effects):
        return attribution
    known = attribution.posterior.best_of(frozenset(effects))
    if known is None:
        before = attribution.hypothesis
        chosen = [k for k, term in enumerate(before.terms) if term.effect in effects]
        terms = tuple(before.terms[k] for k in chosen)
        known = Hypothesis(terms, attribution.evidence.score(terms), before.strengths[:, chosen]), attribution.level
    hypothesis, level = known
    state, covariance = attribution.calibrated, _NO_COVARIANCE
    if hypothesis.terms:
        # where the exact sim cannot follow only the linear one is corrected
        with suppress(FitError):
            state, covariance = refine(attribution.case, attribution.state, hypothesis, level)
    return replace(attribution, hypothesis=hypothesis, level=level, state=state, covariance=covariance)


def _rounds(case, calibrated, prior):
    """Search and refinement in turn until the best hypothesis repeats itself."""
    state, covariance, last = calibrated, _NO_COVARIANCE, None
    linear = case.linearise(state)
    evidence = ModelEvidence(case.library, linear, case.series, case.noise_mm)
    # where an unknown function wins, a second look from its fit shows nothing else, unless the gap is too large for the
    # linear sim or a law's shape is still to be fitted
    small = np.sqrt((linear.data**2).mean()) < _SMALL * case.noise_mm
    for _ in range(_MOST_ROUNDS):
        beliefs = posterior(evidence, search(evidence), prior)
        hypothesis, level = beliefs.best()
        if not hypothesis.terms:
            state, covariance = calibrated, _NO_COVARIANCE
            break
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
            evidence = ModelEvidence(case.library, case.linearise(state), case.series, case.noise_mm)
        except FitError:
            # the sim cannot follow: what the last linearisation says stands
            break
    return Attribution(case, calibrated, state, covariance, evidence, beliefs, hypothesis, level)
