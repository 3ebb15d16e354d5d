"""The diagnosis of one campaign: problem, posterior of the causes, verdict, budget and what to measure next."""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd

from rrru.arrays import FloatArray
from rrru.campaign import measurements as rows
from rrru.diagnosis.aliases import Row
from rrru.diagnosis.budget import budget
from rrru.diagnosis.design.advise import Advice, advise
from rrru.diagnosis.design.run_limits import StatedLimits
from rrru.diagnosis.determined import few_readings, require_determined
from rrru.diagnosis.discrepancy_basis import JUMPS, UNKNOWN, lone_jump
from rrru.diagnosis.discrepancy_bias import discrepancy_covariance
from rrru.diagnosis.drive_functions import drive_functions
from rrru.diagnosis.inference import (
    KNOWN,
    STATED,
    UNKNOWN_NOISE,
    InferenceResult,
    infer,
    with_characteristic_length,
    with_effects,
    with_world_scale,
)
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.model_space import explore
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.posterior import Posterior
from rrru.diagnosis.remainder import NO_REMAINDER, followed_alike, remainder_rows
from rrru.diagnosis.result_notes import (
    bias_notes,
    fit_notes,
    mass_notes,
    mounting_notes,
    noise_notes,
    payload_notes,
    posterior_notes,
    successive_notes,
    undetermined_payload_notes,
    zero_notes,
)
from rrru.diagnosis.result_tables import details_of, left_out, left_out_note, outlier_note, parameter_rows, where
from rrru.diagnosis.settings import GapSettings, Prior
from rrru.diagnosis.shrink import CLOSED, ShrinkStep, losses_without, order_by_share, share_closed, shrink_steps
from rrru.diagnosis.state import ModelState
from rrru.diagnosis.terms import EffectTerm
from rrru.diagnosis.variance_by_factor import worst_spot
from rrru.diagnosis.verdict import Verdict, decide, why_no_answer, without_answer
from rrru.errors import ConfigError
from rrru.estimation.noise_model import CONTRADICTED, NoiseModel
from rrru.kinematics.dynamics import Masses
from rrru.kinematics.robot import Robot
from rrru.robots.drive_words import drive_words
from rrru.seeds import stream

_DEFAULTS = GapSettings()
STEPS = ("problem", "posterior of the causes", "shrinkage and budget", "next runs", "tables")


@dataclass(frozen=True)
class MeasuredRobot:
    """What is known of the robot that a campaign was measured on.

    mechanism: its nominal model; masses: `rrru.kinematics.dynamics.Masses`.
    noise_mm: standard deviation of the instrument's positions per axis. None, for one that is not stated, and 0, of a
        simulation without noise, are replaced by an estimate, with a note for 0.
    noise_rad: standard deviation of measured orientations per axis, None where it is not stated.
    noise_known: whether noise_mm is exact; else it is within 30 %, 1 sigma.
    campaign: name of the campaign, for messages and its random stream.
    limits: of further runs.

    Raises ConfigError for a negative noise_mm, or a noise_rad that is not positive.
    """

    mechanism: Robot
    masses: Masses = field(default_factory=Masses)
    noise_mm: float | None = None
    campaign: str = ""
    noise_rad: float | None = None
    noise_known: bool = False
    limits: StatedLimits = field(default_factory=StatedLimits)

    def __post_init__(self) -> None:
        if self.noise_mm is not None and not self.noise_mm >= 0.0:
            raise ConfigError(f"noise_mm is {self.noise_mm}; allowed: 0 or more, or None where it is unknown")
        if self.noise_rad is not None and not self.noise_rad > 0.0:
            raise ConfigError(f"noise_rad is {self.noise_rad}; allowed: a positive number, or None where it is unknown")


@dataclass(frozen=True)
class Diagnosis:
    """Result of a diagnosis.

    verdict: row of `gap_verdicts` without the campaign; tables: frames by name of the table, without the campaign.
    state: parameters of the corrected model; inference: the posterior and the fit; decided: the Verdict of which
    `verdict` is the row.
    """

    verdict: dict[str, Any]
    tables: dict[str, pd.DataFrame]
    state: ModelState
    inference: InferenceResult
    decided: Verdict


def with_wide_bounds(mechanism: Robot) -> Robot:
    """The mechanism with bounds of its deviations so wide that no effect moves them to a bound."""
    return mechanism.widened(OPTIONS.parameter_bound_rad, OPTIONS.parameter_bound_mm)


def diagnose(
    measurements: pd.DataFrame,
    robot: MeasuredRobot,
    settings: GapSettings = _DEFAULTS,
    details: bool = True,
    progress: Callable[[str], None] | None = None,
) -> Diagnosis:
    """Diagnosis of a measurement table of a MeasuredRobot.

    details: whether to make all tables, not only budget, parameters, drive functions, remainder, points left out and
    what to measure next. progress: called with each of STEPS as it begins. Raises FitError where the readings do not
    determine the calibration with some to spare, see `rrru.diagnosis.determined`.
    """
    begin = progress or (lambda _: None)
    begin(STEPS[0])
    library = settings.library(robot.mechanism)
    stated = (KNOWN if robot.noise_known else STATED) if robot.noise_mm else UNKNOWN_NOISE
    nominal, near = with_wide_bounds(robot.mechanism), settings.use_near_singularity
    characteristic_length_mm = nominal.characteristic_length_mm if rows.has_turns(measurements) else np.nan
    problem = make_diagnosis_problem(
        measurements, nominal, robot.masses, robot.noise_mm or 1.0, library, near, characteristic_length_mm
    )
    problem = replace(problem, nuisance_sd=settings.nuisance_sd(problem.nuisance_sd))
    problem = require_determined(problem, f"campaign {robot.campaign}: " if robot.campaign else "")
    if rows.has_turns(measurements):
        problem = with_characteristic_length(problem, robot.noise_mm, robot.noise_rad)
    problem = with_world_scale(problem)
    generator = stream(settings.seed, "gap", robot.campaign)
    begin(STEPS[1])
    verdict, inference, ordered = _decide(infer(problem, settings.prior, stated), settings.prior)
    if why := why_no_answer(inference, robot.noise_mm):
        verdict, inference, ordered = without_answer(why), _without_effects(inference, settings.prior), ()
    elif verdict.unexplained:
        inference = replace(inference, fit=replace(inference.fit, bias=discrepancy_covariance(inference.fit)))
    begin(STEPS[2])
    terms = [term for term, _ in ordered]
    steps = shrink_steps(inference, terms, generator, settings.draws)
    jump_generator = stream(settings.seed, "gap jumps", robot.campaign)
    steps = (*steps[:-1], _with_drawn_jumps(inference, steps[-1], terms, (jump_generator, settings.draws)))
    problem = inference.problem
    residual = problem.residual(inference.calibrated)
    budget_generator = stream(settings.seed, "gap budget", robot.campaign)
    parts = budget(inference, robot.noise_mm or None, budget_generator, settings.draws)
    begin(STEPS[3])
    further = advise(inference, verdict, robot.masses, robot.limits)
    begin(STEPS[4])
    worst = worst_spot(problem.motion.position_mm[problem.at][problem.on_robot], residual[problem.on_robot])
    excluded = left_out(problem, near)
    numbers, outliers = parameter_rows(inference), outlier_note(problem, near)
    row = _row(inference, verdict, steps, worst, further, (robot.noise_mm, (excluded, outliers), numbers))
    ranked = further.runs.assign(rank=np.arange(1, len(further.runs) + 1))
    tables = {"gap_budget": parts, "gap_next_runs": ranked, "gap_next_poses": further.poses, "gap_left_out": excluded}
    tables["gap_parameters"] = numbers
    tables["gap_drive_functions"] = drive_functions(inference, drive_words(robot.mechanism).all_names)
    unexplained = verdict.unexplained and not verdict.no_answer
    tables["gap_remainder"] = remainder_rows(inference) if unexplained else NO_REMAINDER
    if details:
        tables |= details_of(inference, verdict, steps, residual, generator, settings.draws)
    return Diagnosis(row, tables, inference.state, inference, verdict)


def _with_drawn_jumps(
    inference: InferenceResult, last: ShrinkStep, terms: Sequence[EffectTerm], drawn: tuple[np.random.Generator, int]
) -> ShrinkStep:
    """The last ShrinkStep, whose draws have the mean error by jumps between stops, with that of drawn places of these.

    drawn: generator and number of draws.
    """
    explained, level = 1.0 - inference.posterior.probability_unexplained, inference.level
    strengths = inference.hypothesis.strengths_of(terms, level)
    mean = inference.held_out.jumps_mm2(terms, strengths, level)
    jumps = inference.held_out.drawn_jumps_mm2(terms, strengths, level, drawn)
    return replace(last, moved_mm2=last.moved_mm2 + explained * (jumps - mean))


def _findings(inference: InferenceResult, named: Collection[str]) -> Iterator[str]:
    """Notes on zero offsets, parameters biased by named effects and the payload, found in addition to the effects."""
    yield from zero_notes(inference.fit.stated, inference.problem.mechanism)
    yield from bias_notes(inference, named)
    yield from payload_notes(inference)
    yield from undetermined_payload_notes(inference)


def _notes(inference: InferenceResult, stated_mm: float | None, excluded: pd.DataFrame, outliers: str) -> Iterator[str]:
    """What the data lack for a better answer, and what they contradict.

    excluded: the rows of `gap_left_out`; outliers: a sentence on those to the diagnosis, empty where there are none.
    """
    problem = inference.problem
    yield from fit_notes(inference)
    yield from posterior_notes(inference.posterior)
    if problem.count < OPTIONS.min_used_share * len(problem.used):
        yield left_out_note(excluded, problem.count, len(problem.used))
    if outliers:
        yield outliers
    if few := few_readings(problem):
        yield few
    acting = {name for name, _ in inference.state.effects} & problem.known.keys()
    if lacking := problem.count - len(np.unique(problem.at[problem.complete(acting)])):
        where_not = f"{lacking} of {problem.count} points, where the rows do not determine all that is needed"
        yield f"{', '.join(sorted(acting))} fitted without {where_not}"
    yield from noise_notes(problem, stated_mm, CONTRADICTED)
    yield from successive_notes(inference, stated_mm, CONTRADICTED)
    yield from mass_notes(problem)
    yield from mounting_notes(inference)
    for effect, note in problem.untestable.items():
        yield f"{effect} not tested: {note}"


def _joined(notes: Sequence[str]) -> str:
    """Notes as one text, separated by semicolons; those within a note become commas."""
    return "; ".join(note.replace("; ", ", ") for note in notes)


def _row(
    inference: InferenceResult,
    verdict: Verdict,
    steps: Sequence[ShrinkStep],
    worst_mm: FloatArray,
    further: Advice,
    about: tuple[float | None, tuple[pd.DataFrame, str], pd.DataFrame],
) -> Row:
    """The row of `gap_verdicts` without the campaign.

    worst_mm (3,): where the residual is largest; about: the stated noise in mm, `gap_left_out` and its outliers
    in words, and `gap_parameters`. Columns of a corrected file are filled where one is written.
    """
    stated_mm, excluded, numbers = about
    found = [] if verdict.no_answer else _findings(inference, verdict.effects)
    problem, noise = inference.problem, inference.problem.noise or NoiseModel.white(inference.problem.noise_mm)
    return {
        "effects": verdict.label,
        "unnamed": "+".join(t.effect for t in inference.hypothesis.terms if t.effect not in verdict.effects),
        "probability": verdict.probability,
        "leg": verdict.leg,
        "where": where(inference, verdict.effects, numbers),
        "confounded_with": ", ".join(verdict.confounded_with),
        "groups": "; ".join(" | ".join(group.names) for group in verdict.groups),
        "searches_apart": inference.posterior.apart,
        "noise_rms_mm": float(np.sqrt(3.0) * problem.noise_mm),
        "gap_rms_mm": steps[0].gap_rms_mm,
        "gap_after_rms_mm": steps[-1].gap_rms_mm,
        **dict(zip(CLOSED, share_closed(steps[0], steps[-1]), strict=True)),
        **dict(zip(("worst_x_mm", "worst_y_mm", "worst_z_mm"), worst_mm.tolist(), strict=True)),
        "next_runs": "; ".join(further.runs["run"]),
        "undecided": further.undecided,
        "noise_stated_mm": stated_mm or np.nan,
        "noise_correlation": noise.correlation,
        "noise_runs_mm": float(np.sqrt(noise.offset * (noise.axis_mm**2).mean())),
        "noise_from": inference.noise_from,
        "points": problem.count,
        "dropped_points": inference.dropped,
        "notes": _joined([*found, *_notes(inference, stated_mm, *excluded), *filter(None, [further.limited])]),
        "not_in_model": "",
        "no_answer": verdict.no_answer,
        "file_error_mm": np.nan,
        "file_error_fresh_mm": np.nan,
        "file_expected_mm": np.nan,
        "file_remainder": "",
        "file_headline": "",
    }


def _decide(
    inference: InferenceResult, prior: Prior
) -> tuple[Verdict, InferenceResult, tuple[tuple[EffectTerm, float], ...]]:
    """Verdict, the inference fitted to it, and its terms with their shares in order.

    The probabilities come from the evidence, and cross-validation has a veto. An effect that predicts left-out points
    worse than the verdict without it, by more than chance, is ruled out, and the others are decided again. Where
    something is unexplained an effect may be a part of that: it has to predict them better, and to make more than a
    small part of the gap, to be named. One that is too small for a name stays in the model where it predicts left-out
    points better. Both are asked with the one jump that acts; the model that is given has none. Where an answer's
    predictions are further off than those of the calibration alone, its worst effect is ruled out.
    """
    ruled_out: set[str] = set()
    small: frozenset[str] = frozenset()
    unnamed: tuple[str, ...] = ()
    while True:
        if inference.lacks_fit:
            inference = inference.with_posterior(inference.posterior.all_unexplained())
        verdict = decide(inference.posterior, inference.problem.effects, small)
        names = (*verdict.effects, *(name for name in unnamed if name not in ruled_out))
        jump = lone_jump(inference.hypothesis.effects) if verdict.unexplained else ()
        fitted = with_effects(inference, (*names, *jump))
        least = OPTIONS.max_heldout_loss_nats if verdict.unexplained else -OPTIONS.max_heldout_loss_nats
        worse = {name for name, gain in _gains(fitted).items() if gain < least} or _misleading(fitted)
        if not worse:
            ordered = tuple(one for one in order_by_share(fitted) if one[0].effect not in JUMPS)
            shares = {term.effect: share for term, share in ordered}
            # decided once, with all effects fitted: an effect that is left out would be a part of the remainder
            if not small and (small := _small(fitted, verdict)):
                unnamed = tuple(name for name in verdict.effects if name in small and shares.get(name, 0.0) > 0.0)
                continue
            if any(shares.get(name, 1.0) <= 0.0 for name in unnamed):
                # a rough function can be probable and predict left-out points worse
                unnamed = tuple(name for name in unnamed if shares.get(name, 0.0) > 0.0)
                continue
            named = tuple(term.effect for term, _ in ordered if term.effect in verdict.effects)
            final = with_effects(fitted, names)
            # without the jump an effect may have another shape or act on other legs
            terms = {term.effect: term for term in final.hypothesis.terms}
            ordered = tuple((terms[term.effect], share) for term, share in ordered)
            return replace(verdict, effects=named), final, ordered
        ruled_out |= worse
        inference = inference.with_posterior(_without(inference, ruled_out, worse, prior))


def _small(inference: InferenceResult, verdict: Verdict) -> frozenset[str]:
    """Effects of a verdict that may be a part of the remainder."""
    # shares are of positions on the robot: reflectors elsewhere may show effects that hardly move these
    if not verdict.unexplained or inference.problem.on_world.any():
        return frozenset()
    hypothesis, level = inference.hypothesis, inference.level
    shares = inference.held_out.shares(hypothesis.terms, hypothesis.prior_scales[level], level)
    jumped = [shares.pop(name) for name in JUMPS.keys() & shares.keys()]
    if jumped and not level:
        # nothing else is unexplained, and no effect is a part of a jump
        return frozenset()
    losses, least = losses_without(inference), OPTIONS.min_share_with_unexplained
    rest = max(1.0 - sum(jumped), 1e-12)
    found = {name for name, share in shares.items() if min(share / rest, losses[name]) < least}
    residual = inference.problem.residual(inference.calibrated)[inference.problem.on_robot]
    gap_mm = float(np.sqrt((residual**2).sum(axis=1).mean()))
    alike, left_mm = followed_alike(inference, remainder_rows(inference), tuple(shares))
    least_mm = OPTIONS.min_size_per_remainder * left_mm
    return frozenset(found | {name for name in alike if np.sqrt(max(shares[name], 0.0)) * gap_mm < least_mm})


def _without(inference: InferenceResult, ruled_out: set[str], worse: set[str], prior: Prior) -> Posterior:
    """The posterior without effects that have just been found worse, and without all that have been ruled out.

    Where every likely set holds one of them, the search is repeated without them.
    """
    posterior = inference.posterior
    remaining = posterior
    for name in worse:
        remaining = remaining.without(name)
    if remaining.height > posterior.height - OPTIONS.negligible_nats:
        return remaining
    evidence = inference.evidence.on_library()
    return explore(evidence, prior, ruled_out)


def _without_effects(inference: InferenceResult, prior: Prior) -> InferenceResult:
    """The inference of the calibration alone, with a posterior that has no effect of the library."""
    names = set(inference.problem.effects)
    return with_effects(inference.with_posterior(_without(inference, names, names, prior)), ())


def _misleading(inference: InferenceResult) -> set[str]:
    """The effect that is ruled out where predictions with those of the hypothesis are further off than without any."""
    terms, level = inference.hypothesis.terms, inference.level
    if not inference.hypothesis.effects.isdisjoint(UNKNOWN):
        return set()
    worst = inference.held_out.misleading(terms, inference.hypothesis.prior_scales[level], level)
    return {worst.effect} if worst else set()


def _gains(inference: InferenceResult) -> dict[str, float]:
    """Log predictive score that each effect of the hypothesis gains on left-out points over the others."""
    terms, level = inference.hypothesis.terms, inference.level
    gains = inference.held_out.gains(terms, inference.hypothesis.prior_scales[level], level)
    return {term.effect: gain for term, gain in zip(terms, gains, strict=True) if term.effect not in JUMPS}
