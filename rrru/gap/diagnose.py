"""The diagnosis of one campaign: where the gap lies, which effect causes it, how far it shrinks, and what to measure
next.
"""

from dataclasses import dataclass, replace

import numpy as np

from rrru.errors import FitError
from rrru.gap import shrink
from rrru.gap.advise import advise
from rrru.gap.attribute import attribute, settle
from rrru.gap.case import make_case
from rrru.gap.details import details_of
from rrru.gap.heldout import folds, log_score, predict
from rrru.gap.locate import worst_spot
from rrru.gap.settings import GapSettings
from rrru.gap.verdict import decide
from rrru.seeds import stream

# fewer points fit any effect, and left-out ones are extrapolated
_POINTS_PER_PARAMETER = 3
# what an effect may lose on left-out points before it is ruled out
_VETO_NATS = 3.0
# the diagnosis looks further than a calibration's bounds, which a strong effect would press against
_ANGLE_LIMIT_RAD, _LENGTH_LIMIT_MM = 0.3, 100.0
_DEFAULTS = GapSettings()


@dataclass(frozen=True)
class Diagnosis:
    """verdict: mapping of `gap_verdicts` without the campaign; tables: frames by name, without the campaign; state: the
    corrected sim; calibrated_deviations (p,): of the calibration alone; attribution: everything that the search found.
    """

    verdict: dict
    tables: dict
    state: object
    calibrated_errors: np.ndarray
    attribution: object


def sim(mechanism):
    """The mechanism with bounds wide enough for a gap to show itself in the errors."""
    return replace(mechanism, angle_limit_rad=_ANGLE_LIMIT_RAD, length_limit_mm=_LENGTH_LIMIT_MM)


def diagnose(
    measurements, mechanism, masses, settings=_DEFAULTS, noise_mm=None, details=True, name="", use_near_singularity=True
):
    """Diagnosis of a measurement table.

    masses: `rrru.robots.dynamics.Masses`; noise_mm: per axis, estimated where None; details: also the tables that no
    verdict needs; name: of the campaign, for its random stream. Raises FitError where there are too few points to
    calibrate on.
    """
    case = make_case(
        measurements,
        sim(mechanism),
        masses,
        noise_mm or 1.0,
        settings.library(mechanism.drive_unit),
        use_near_singularity,
    )
    least = _POINTS_PER_PARAMETER * len(case.mechanism.parameters)
    if len(case) < least:
        whose = f"campaign {name}: " if name else ""
        raise FitError(f"{whose}{len(case)} usable points are too few for a diagnosis; allowed: at least {least}")
    found = attribute(case, settings.prior, "given" if noise_mm else "estimated")
    case = found.case
    generator = stream(settings.seed, "gap", name)
    verdict, found, ordered = _decide(found)
    unknown = sum(p for (_, flag), p in found.posterior.sets().items() if flag)
    named = [term for term, _ in ordered]
    steps = shrink.steps(found, named, unknown, generator, settings.draws)
    closed = shrink.share_closed(steps[0], steps[-1]) if named else (0.0, 0.0, 0.0)
    residual = case.measured_mm - case.model(found.calibrated)
    worst = worst_spot(case.motion.position_mm[case.used], residual)
    further = advise(found, verdict, masses)
    row = {
        "effects": verdict.label,
        "probability": verdict.probability,
        "leg": verdict.leg,
        "confusable_with": ", ".join(verdict.confusable_with),
        "noise_rms_mm": float(np.sqrt(3.0) * case.noise_mm),
        "gap_rms_mm": shrink.gap_rms(steps[0].gap_mm2),
        "gap_after_rms_mm": shrink.gap_rms(steps[-1].gap_mm2) if named else shrink.gap_rms(steps[0].gap_mm2),
        **dict(zip(("share_closed", "share_closed_low", "share_closed_high"), closed, strict=True)),
        **dict(zip(("worst_x_mm", "worst_y_mm", "worst_z_mm"), worst.tolist(), strict=True)),
        "next_runs": "; ".join(further["run"]),
        "noise_from": found.noise_from,
        "points": len(case),
        "dropped_points": found.dropped,
        "notes": "; ".join(f"{effect} not tested: {note}" for effect, note in case.untestable.items()),
    }
    tables = details_of(found, verdict, steps, residual, further, generator, settings) if details else {}
    return Diagnosis(row, tables, found.state, found.calibrated.deviations, found)


def _decide(found):
    """Verdict, the attribution settled on it, and its terms with their shares in order.

    The probabilities come from the evidence; prediction has a veto: an effect that makes left-out points worse than the
    verdict without it does, by more than chance, is ruled out and the rest decides again.
    """
    while True:
        ordered = shrink.order_by_share(found.case, found.evidence, found.hypothesis, found.level)
        verdict = decide(found, {term.effect: share for term, share in ordered})
        settled = settle(found, verdict.effects)
        ordered = shrink.order_by_share(settled.case, settled.evidence, settled.hypothesis, settled.level)
        worse = [name for name in verdict.effects if _gain(settled, name) < -_VETO_NATS]
        if not worse:
            return verdict, settled, ordered
        beliefs = found.posterior
        for name in worse:
            beliefs = beliefs.without(name)
        hypothesis, level = beliefs.best()
        found = replace(found, posterior=beliefs, hypothesis=hypothesis, level=level)


def _gain(found, name):
    """Log predictive score that one effect of the hypothesis gains on left-out points over the others."""
    terms, strengths = found.hypothesis.terms, found.hypothesis.strengths[found.level]
    others = [k for k, term in enumerate(terms) if term.effect != name]
    fold = folds(found.case)
    whole = predict(found.case, found.evidence, terms, strengths, found.level, fold)
    rest = predict(found.case, found.evidence, tuple(terms[k] for k in others), strengths[others], found.level, fold)
    return float((log_score(whole, found.case) - log_score(rest, found.case)).sum())
