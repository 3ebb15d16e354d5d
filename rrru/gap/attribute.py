"""Which effects cause the gap: calibrate, look for the best set, fit it on the exact sim, look again from there."""

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rrru.campaign import measurements as rows
from rrru.campaign import noise
from rrru.errors import FitError
from rrru.gap.calibrate import calibrate, origin
from rrru.gap.case import Case
from rrru.gap.evidence import ModelEvidence
from rrru.gap.heldout import HeldOut
from rrru.gap.identify import with_seen
from rrru.gap.noise_model import alike, fit_noise
from rrru.gap.orders import with_orders
from rrru.gap.posterior import Posterior, posterior
from rrru.gap.refine import refine
from rrru.gap.search import Hypothesis, search
from rrru.gap.spectra import with_spectra
from rrru.gap.state import State
from rrru.gap.unknown import UNKNOWN
from rrru.gap.whitened import LEVELS

_MOST_ROUNDS, _MOST_CLEANINGS = 6, 3
# times the noise below which a gap, and share of the noise, rms, below which what the sim bends by is small
_SMALL, _STRAIGHT = 10.0, 0.1
# more columns than this share of the numbers read leave too little to tell the noise by
_MOST_FITTED = 0.5
_NO_COVARIANCE = np.zeros((0, 0))
# what is told of the noise
KNOWN, STATED, UNKNOWN_NOISE = "known", "stated", "unknown"


@dataclass(frozen=True)
class Attribution:
    """What the search has found.

    origin: State that calibrations start from; calibrated: of the calibration alone; state: of the best hypothesis,
    fitted on the exact sim, with the covariance (k, k) of its terms' coefficients; evidence: on the last linearisation,
    about that state; posterior over all hypotheses; hypothesis, level: the best one and its discrepancy level;
    noise_from: "given", "repeats" or "fitted"; dropped: number of points left out as outliers.
    """

    case: Case
    origin: State
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


def with_arm(case, noise_mm=None, noise_rad=None):
    """The case with orientations at the arm that gives them the positions' noise; what is not given is estimated."""
    if not (noise_mm and noise_rad):
        positions, turned, _ = _rough(case, calibrate(case))
        noise_mm, noise_rad = noise_mm or positions, noise_rad or turned / case.arm_mm
    return replace(case, arm_mm=noise_mm / noise_rad)


def with_beside(case):
    """The case with reflectors beside the robot counted by what everything fitted leaves of them and of the others."""
    if not case.beside.any() or case.beside.all():
        return case
    linear, columns = _few(case, calibrate(case))
    flat = columns.reshape(linear.data.size, -1)
    size = np.maximum(np.linalg.norm(flat, axis=0), 1e-300)
    fitted = flat / size @ np.linalg.lstsq(flat / size, linear.data.ravel(), rcond=1e-9)[0]
    squares = ((linear.data.ravel() - fitted).reshape(-1, 3) ** 2).sum(axis=1)
    others = case.positions & ~case.beside
    return replace(case, beside_scale=float(np.sqrt(squares[others].mean() / max(squares[case.beside].mean(), 1e-12))))


def with_noise(case, linear, stated_mm):
    """The case under the noise that is left of a linearisation when all that may be has been fitted, and where from.

    "fitted", see `rrru.gap.noise_model`, or "repeats" where points that were measured again say clearly less.
    """
    columns = np.concatenate([linear.base, *linear.columns.values(), *linear.shape_columns.values()], axis=-1)
    if columns.shape[-1] > _MOST_FITTED * linear.data.size:
        # too few points to fit everything: what the calibration leaves has to do
        columns = linear.base
    rows = case.complete(case.library)
    if 3 * rows.sum() < linear.base.shape[-1] / _MOST_FITTED:
        rows[:] = True
    # an effect that acts where it is unknown how is no noise
    data, columns, series = linear.data[rows], columns[rows], case.series[rows]
    model = fit_noise(data, columns, series, stated_mm)
    model = replace(model, alike=alike(data, columns, case.stop[rows], case.kind[rows]))
    repeated, count = noise.repeat_noise(case.measurements[case.used])
    # what is correlated tells less
    count *= (1.0 - model.correlation**2) / (1.0 + model.correlation**2)
    if count >= noise.ENOUGH_REPEATS and 0.0 < repeated < model.mean_mm * (1.0 - 3.0 / np.sqrt(2.0 * count)):
        return case.under(replace(model, axis_mm=model.axis_mm * repeated / model.mean_mm)), "repeats"
    return case.under(model), "fitted"


def _rough(case, calibrated):
    """`rrru.campaign.noise.estimate` of a case with everything fitted that may be."""
    linear, columns = _few(case, calibrated)
    used = case.measurements[case.used]
    return noise.estimate(used, linear.data, columns, rows.readings(used, case.arm_mm))


def _few(case, calibrated):
    """The linearisation about a calibration, and the columns (m, 3, k) of all but laws of many coefficients.

    Too few points to fit everything: what the calibration leaves has to do.
    """
    few = {name: effect for name, effect in case.library.items() if not effect.coordinates.broad}
    linear = replace(case, library=few).linearise(calibrated)
    columns = np.concatenate([linear.base, *linear.columns.values()], axis=-1)
    return linear, (columns if columns.shape[-1] <= len(case) else linear.base)


def attribute(case, prior, stated=KNOWN):
    """Attribution of a case; stated: whether its noise is KNOWN, STATED within limits, or UNKNOWN_NOISE."""
    total = case.count
    for cleaning in range(_MOST_CLEANINGS + 1):
        calibrated = calibrate(case)
        if stated == UNKNOWN_NOISE:
            # spikes would pass for noise
            outliers = noise.isolated(case.residual(calibrated), case.series, 0.0, case.kind)
            # what arrived from the other side than its neighbours is no outlier
            outliers &= case.complete(case.library)
            if outliers.any():
                case = case.without(outliers)
                calibrated = calibrate(case)
        case = case.standing(calibrated)
        attribution = _rounds(case, calibrated, prior, stated)
        found = attribution.case
        outliers = noise.isolated(found.residual(attribution.state), found.series, found.noise_mm, found.kind)
        if cleaning == _MOST_CLEANINGS or not outliers.any():
            break
        case = case.without(outliers)
    return replace(attribution, dropped=total - case.count)


def with_effects(attribution, effects):
    """The attribution with hypothesis and state of exactly the named effects, fitted anew; the posterior stays."""
    same = attribution.hypothesis.effects == frozenset(effects)
    if same and set(attribution.state.effects) <= {(t.effect, t.shape) for t in attribution.hypothesis.terms}:
        return attribution
    known = (attribution.hypothesis, attribution.level) if same else attribution.posterior.best_of(frozenset(effects))
    if known is None:
        terms = tuple(term for term in attribution.hypothesis.terms if term.effect in effects)
        found, strengths = np.full(len(LEVELS), -np.inf), np.ones((len(LEVELS), len(terms)))
        levels = attribution.evidence.levels
        found[levels], strengths[levels] = attribution.evidence.independent(terms, levels)
        # what an unknown function took beside them is a discrepancy without it
        known = Hypothesis(terms, found, strengths), int(found.argmax())
    hypothesis, level = known
    state, covariance = attribution.calibrated, _NO_COVARIANCE
    if hypothesis.terms:
        # where the exact sim cannot follow only the linear one is corrected
        with suppress(FitError):
            state, covariance = refine(attribution.case, (attribution.state, attribution.origin), hypothesis, level)
    found = {"hypothesis": hypothesis, "level": level, "state": state, "covariance": covariance}
    return replace(attribution, case=attribution.case.with_approach(state), **found)


class _Looks:
    """What one sees of a case at a state: laws found in it, columns at the state, the noise; once for each call."""

    def __init__(self, stated, stated_mm):
        self._stated, self._stated_mm = stated, stated_mm
        self._source = None

    def at(self, case, state, terms=()):
        """Case with its laws and noise, its linearisation at a state with a hypothesis' terms, the noise's source."""
        linear = case.linearise(state)
        case, orders = with_orders(case, linear, terms)
        case, waves = with_spectra(case, linear, terms)
        kept = {key: columns for key, columns in linear.columns.items() if key[0] in case.library}
        linear = replace(linear, columns=kept)
        if orders or waves:
            linear = replace(linear, columns=kept | case.linearise(state, [*orders, *waves]).columns)
        if self._stated == KNOWN:
            return case, linear, "given"
        # many columns take long to be projected out, and leave the same wherever they are taken
        if self._source and any(effect.coordinates.broad for effect in case.library.values()):
            return case, linear, self._source
        under, self._source = with_noise(case, linear, self._stated_mm if self._stated == STATED else None)
        return under, linear, self._source


def _bends(case, linear, state, fitted):
    """Whether the exact sim at a fitted state without shapes is off what a linearisation about a state says there."""
    said = linear.data - linear.base @ (fitted.deviations - state.deviations)
    said = said - sum(linear.columns[key] @ numbers for key, numbers in fitted.effects.items())
    return np.sqrt(((case.residual(fitted) - said) ** 2).mean()) > _STRAIGHT * case.noise_mm


def _rounds(case, calibrated, prior, stated):
    """Search and refinement in turn until a hypothesis is the best one again."""
    state, covariance, seen, looks = calibrated, _NO_COVARIANCE, set(), _Looks(stated, case.noise_mm)
    start = origin(case)
    case, linear, source = looks.at(case, state)
    case, linear = with_seen(case, linear)
    evidence = case.evidence(linear)
    small = np.sqrt((linear.data**2).mean()) < _SMALL * case.noise_mm
    for _ in range(_MOST_ROUNDS):
        beliefs = posterior(evidence, search(evidence), prior)
        hypothesis, level = beliefs.best()
        if not hypothesis.terms:
            state, covariance = calibrated, _NO_COVARIANCE
            break
        shaped = any(len(case.library[term.effect].coordinates.shapes) > 1 for term in hypothesis.terms)
        unknown = not hypothesis.effects.isdisjoint(UNKNOWN)
        # where an unknown function wins, a second look from its fit shows nothing else, unless the sim bends on the way
        # there or a law's shape is still to be fitted
        settled = unknown and small and not shaped
        # laws get their chance before an unknown function takes what their linear fit leaves
        named = beliefs.best_of(hypothesis.effects - set(UNKNOWN)) if unknown and (small or shaped) else None
        tried, its_level = named or (hypothesis, level)
        if frozenset(hypothesis.terms) in seen or (settled and (tried is hypothesis or not tried.terms)):
            break
        seen.add(frozenset(hypothesis.terms))
        try:
            # what a dropped effect has done to the others' numbers can hold a fit back
            dropped = {name for name, _ in state.effects} - tried.effects
            fitted, spread = refine(case, (calibrated if dropped else state, start), tried, its_level)
            if settled and not _bends(case, linear, state, fitted):
                break
            hypothesis, level, state, covariance = tried, its_level, fitted, spread
            case = case.standing(state).with_approach(state)
            case, linear, source = looks.at(case, state, hypothesis.terms)
            evidence = case.evidence(linear)
        except FitError:
            # the sim cannot follow: what the last linearisation says stands
            break
    return Attribution(case, start, calibrated, state, covariance, evidence, beliefs, hypothesis, level, source)
