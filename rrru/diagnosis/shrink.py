"""How far the gap shrinks as effects are added: on points left out of the fit, and on the re-simulated campaign."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import pandas as pd

from rrru.arrays import BoolArray, FloatArray, IntArray
from rrru.diagnosis.aliases import Row
from rrru.diagnosis.heldout import HeldOut, resampled_groups, resampled_quantiles, resampled_rows
from rrru.diagnosis.inference import InferenceResult
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.diagnosis.terms import EffectTerm

CLOSED = ("share_closed", "share_closed_low", "share_closed_high")


@dataclass(frozen=True)
class ShrinkStep:
    """The gap after some effects are added, at those of m readings that count.

    squares_mm2 (m,): of the gap at each reading, less noise. For b draws: picks (b, m), readings resampled from all;
    shown_mm2 (m,): their part from the residuals; moved_mm2 (b, m): their part from drawn numbers. groups (m,): labels
    of the readings that are resampled together.
    """

    added: str
    effects: tuple[str, ...]
    residual_mm: FloatArray
    squares_mm2: FloatArray
    picks: IntArray
    groups: IntArray
    shown_mm2: FloatArray
    moved_mm2: FloatArray
    counted: BoolArray

    def part(self, chosen: BoolArray) -> Self:
        """The step at those of the chosen readings (m,) that count."""
        return replace(self, counted=self.counted & chosen)

    @property
    def gap_rms_mm(self) -> float:
        """Root mean square gap."""
        return gap_rms(self.squares_mm2[self.counted])

    @property
    def drawn_rms_mm(self) -> FloatArray:
        """Root mean square gap (b,) of the draws, NaN of those that have no reading that counts."""
        picked = self.counted[self.picks]
        with np.errstate(invalid="ignore"):
            shown = np.where(picked, self.shown_mm2[self.picks], 0.0).sum(axis=1) / picked.sum(axis=1)
        return np.asarray(np.sqrt(np.maximum(shown + self.moved_mm2[:, self.counted].mean(axis=1), 0.0)))


def gap_rms(squares: FloatArray) -> float:
    """Root mean square gap from squared gaps whose noise is taken off; zero where noise explains all."""
    return float(np.sqrt(max(float(np.mean(squares)), 0.0)))


def order_by_share(inference: InferenceResult) -> tuple[tuple[EffectTerm, float], ...]:
    """(term, share of the gap's mean square on left-out points that it removes when it comes next), largest first."""
    left, result = list(inference.hypothesis.terms), []
    chosen: list[EffectTerm] = []
    start = now = _gap_mm2(inference, [], inference.held_out)
    while left:
        after = [_gap_mm2(inference, [*chosen, term], inference.held_out) for term in left]
        best = int(np.argmin(after))
        result.append((left[best], (now - after[best]) / max(start, 1e-12)))
        now = after[best]
        chosen.append(left.pop(best))
    return tuple(result)


def losses_without(inference: InferenceResult) -> dict[str, float]:
    """By effect of the fit how much larger the mean square gap on left-out points is without it.

    As a share of what remains with all of them. Readings at which one of them lacks what it needs do not count.
    """
    terms = inference.hypothesis.terms
    held_out = inference.held_out.on_complete(terms)
    remains = max(_gap_mm2(inference, terms, held_out), 1e-300)
    without = {one.effect: _gap_mm2(inference, [term for term in terms if term != one], held_out) for one in terms}
    return {name: gap / remains - 1.0 for name, gap in without.items()}


def _gap_mm2(inference: InferenceResult, terms: Sequence[EffectTerm], held_out: HeldOut) -> float:
    """Mean square gap on left-out points with some terms of the hypothesis, less noise, and at least zero."""
    hypothesis, level, problem = inference.hypothesis, inference.level, held_out.problem
    prediction = held_out.predict(terms, hypothesis.strengths_of(terms, level), level, uncertain=False)
    squares = (prediction.residual_mm[problem.on_robot] ** 2).sum(axis=1)
    return max(float(squares.mean()) - 3.0 * problem.noise_mm**2, 0.0)


def shrink_steps(
    inference: InferenceResult, ordered: Sequence[EffectTerm], generator: np.random.Generator, draws: int
) -> tuple[ShrinkStep, ...]:
    """Steps from the calibration alone to all effects, one after another.

    ordered: terms in the order in which they are added. What the last step leaves is the uncertainty of its numbers
    at new stops where it explains all, what the residuals show beyond the noise where it does not; the two are mixed by
    the probability that something is unexplained. The draws resample runs (stretches where there are fewer than ten)
    and redraw the fitted numbers.
    """
    problem, hypothesis, level = inference.problem, inference.hypothesis, inference.level
    picks, groups, result = resampled_rows(problem, generator, draws), resampled_groups(problem), []
    for count in range(len(ordered) + 1):
        terms = ordered[:count]
        last = count == len(ordered)
        strengths = hypothesis.strengths_of(terms, level)
        prediction = inference.held_out.predict(terms, strengths, level, uncertain=False)
        spread = inference.held_out.spread_at_new_stops(terms, strengths, level) if last else prediction.spread
        shown = (prediction.residual_mm**2).sum(axis=1) - 3.0 * problem.noise_mm**2
        weight = inference.posterior.probability_unexplained if last else 1.0
        numbers = generator.standard_normal((draws, spread.shape[-1]))
        jumps = inference.held_out.jumps_mm2(terms, strengths, level) if last else np.zeros(len(problem))
        moved = ((spread @ numbers.T) ** 2).sum(axis=1).T + jumps
        squares = weight * shown + (1.0 - weight) * ((spread**2).sum(axis=(1, 2)) + jumps)
        result.append(
            ShrinkStep(
                added=terms[-1].effect if terms else "",
                effects=tuple(term.effect for term in terms),
                residual_mm=prediction.residual_mm,
                squares_mm2=squares,
                picks=picks,
                groups=groups,
                shown_mm2=weight * shown,
                moved_mm2=(1.0 - weight) * moved,
                counted=problem.on_robot,
            )
        )
    return tuple(result)


def share_closed(before: ShrinkStep, after: ShrinkStep) -> tuple[float, float, float]:
    """Explained fraction between two steps and its 95 % interval from their draws, see `resampled_quantiles`.

    Zero where there was no gap.
    """
    share = _share(before.gap_rms_mm, after.gap_rms_mm)
    drawn = zip(before.drawn_rms_mm, after.drawn_rms_mm, strict=True)
    pairs = [_share(*pair) for pair in drawn if np.isfinite(pair).all()]
    ends = resampled_quantiles(before.groups[before.counted])
    low, high = np.quantile(pairs, ends) if pairs else (np.nan, np.nan)
    return share, float(np.minimum(low, share)), float(np.maximum(high, share))


def shrink_table(
    problem: DiagnosisProblem, steps: Sequence[ShrinkStep], resimulated_mm: FloatArray | None
) -> pd.DataFrame:
    """Rows of `gap_shrink` without the campaign.

    resimulated_mm (m, 3): residuals of the corrected model, None without effects.
    """
    trajectory = problem.points["trajectory"].to_numpy()
    noise = float(np.sqrt(3.0) * problem.noise_mm)
    rows = []
    for number, step in enumerate(steps):
        for name in ("*", *pd.unique(trajectory[problem.on_robot])):
            chosen = np.full(len(trajectory), True) if name == "*" else trajectory == name
            part = step.part(chosen)
            share = share_closed(steps[0].part(chosen), part) if number else (np.nan,) * 3
            sizes = _sizes(part.residual_mm[part.counted]) | {"noise_rms_mm": noise, "gap_rms_mm": part.gap_rms_mm}
            rows.append(_label(number, step, name, "held_out") | sizes | dict(zip(CLOSED, share, strict=True)))
    if resimulated_mm is not None:
        resimulated_mm = resimulated_mm[problem.on_robot]
        after = gap_rms((resimulated_mm**2).sum(axis=1) - noise**2)
        sizes = _sizes(resimulated_mm) | {"noise_rms_mm": noise, "gap_rms_mm": after}
        share = _share(steps[0].gap_rms_mm, after), np.nan, np.nan
        label = _label(len(steps) - 1, steps[-1], "*", "resimulated")
        rows.append(label | sizes | dict(zip(CLOSED, share, strict=True)))
    return pd.DataFrame(rows)


def model_row(shrink: pd.DataFrame, kind: str, left_mm: FloatArray, noise_mm: float) -> Row:
    """A row of `gap_shrink` of a robot's file, given_model or corrected_model, in addition to the other rows.

    left_mm (m, 3): measured minus the file's robot, NaN where it was not driven; noise_mm: per axis.
    """
    last, noise = shrink["step"].max(), float(np.sqrt(3.0) * noise_mm)
    step = 0 if kind == "given_model" else last
    of_step = shrink[(shrink["step"] == step) & (shrink["kind"] == "held_out")].iloc[0]
    start = float(shrink.loc[(shrink["step"] == 0) & (shrink["trajectory"] == "*"), "gap_rms_mm"].iloc[0])
    left = left_mm[np.isfinite(left_mm).all(axis=1)]
    after = gap_rms((left**2).sum(axis=1) - noise**2)
    share = (np.nan if kind == "given_model" else _share(start, after)), np.nan, np.nan
    label = {name: of_step[name] for name in ("step", "added", "effects")} | {"trajectory": "*", "kind": kind}
    sizes = _sizes(left) | {"noise_rms_mm": noise, "gap_rms_mm": after}
    return label | sizes | dict(zip(CLOSED, share, strict=True))


def _label(number: int, step: ShrinkStep, trajectory: str, kind: str) -> Row:
    """What a row of `gap_shrink` is about."""
    effects = "+".join(step.effects) or "none"
    return {"step": number, "added": step.added, "effects": effects, "trajectory": trajectory, "kind": kind}


def _sizes(residual_mm: FloatArray) -> Row:
    """Points and sizes of residuals (n, 3)."""
    distance = np.linalg.norm(residual_mm, axis=1)
    rms = float(np.sqrt((distance**2).mean()))
    return {"points": len(distance), "rms_mm": rms, "max_mm": float(distance.max())}


def _share(before: float, after: float) -> float:
    """Reduction of the mean square from one rms to another, not below -1; zero where there was no gap."""
    return max(1.0 - (after / before) ** 2, -1.0) if before > 0.0 else 0.0
