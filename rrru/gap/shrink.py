"""How far the gap shrinks as effects are added: on points that were left out of the fit, and once more on the
re-simulated campaign.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from rrru.gap.heldout import folds, predict, resampled_rows


@dataclass(frozen=True)
class Step:
    """The gap after some effects are added: squared gap (n,) in mm^2 at each point, noise taken off, and its draws (b,
    n) for intervals.
    """

    added: str
    effects: tuple
    residual_mm: np.ndarray
    gap_mm2: np.ndarray
    draws: np.ndarray


def gap_rms(squares):
    """Root mean square gap from squared gaps whose noise is taken off; zero where noise explains all."""
    return float(np.sqrt(max(float(np.mean(squares)), 0.0)))


def order_by_share(case, evidence, hypothesis, level):
    """(effect, share of the gap's mean square that it removes when it comes next) from the largest on, on left-out
    points.
    """
    fold, left, chosen, result = folds(case), list(hypothesis.terms), [], []
    noise = 3.0 * case.noise_mm**2

    def gap(terms):
        strengths = [_strength(hypothesis, term, level) for term in terms]
        residual = predict(case, evidence, tuple(terms), strengths, level, fold).residual_mm
        return max(float((residual**2).sum(axis=1).mean()) - noise, 0.0)

    start = now = gap([])
    while left:
        after = [gap([*chosen, term]) for term in left]
        best = int(np.argmin(after))
        result.append((left[best], (now - after[best]) / max(start, 1e-12)))
        now = after[best]
        chosen.append(left.pop(best))
    return tuple(result)


def steps(attribution, ordered, unexplained, generator, draws=200):
    """Steps from the calibration alone to all effects, one after another.

    ordered: terms in the order in which they are added; unexplained: probability that something is left. What the last
    step leaves is the uncertainty of its numbers where it explains all, what the residuals show beyond the noise where
    it does not, and the two are mixed by that probability. The draws resample runs (stretches where there are fewer
    than ten) and redraw the fitted numbers.
    """
    case, evidence, level = attribution.case, attribution.evidence, attribution.level
    fold = folds(case)
    picks = resampled_rows(case.run, generator, draws)
    result = []
    for count in range(len(ordered) + 1):
        terms = tuple(ordered[:count])
        strengths = [_strength(attribution.hypothesis, term, level) for term in terms]
        prediction = predict(case, evidence, terms, strengths, level, fold)
        shown = (prediction.residual_mm**2).sum(axis=1) - 3.0 * case.noise_mm**2
        last = count == len(ordered)
        weight = unexplained if last else 1.0
        numbers = generator.standard_normal((draws, prediction.spread.shape[-1]))
        moved = (
            ((prediction.spread.reshape(-1, numbers.shape[1]) @ numbers.T) ** 2)
            .reshape(len(shown), 3, draws)
            .sum(axis=1)
            .T
        )
        squares = weight * shown + (1.0 - weight) * prediction.uncertainty_mm2
        drawn = (
            weight * np.take_along_axis(np.broadcast_to(shown, (draws, len(shown))), picks, axis=1)
            + (1.0 - weight) * moved
        )
        added = ordered[count - 1].effect if count else ""
        result.append(Step(added, tuple(t.effect for t in terms), prediction.residual_mm, squares, drawn))
    return tuple(result)


def share_closed(before, after):
    """Share of the gap closed between two steps and its 95 % interval from their draws; zero where there was no gap."""
    first, last = gap_rms(before.gap_mm2), gap_rms(after.gap_mm2)
    share = _share(first, last)
    pairs = [_share(gap_rms(a), gap_rms(b)) for a, b in zip(before.draws, after.draws, strict=True)]
    low, high = np.quantile(pairs, [0.025, 0.975])
    return share, float(min(low, share)), float(max(high, share))


def table(case, found, resimulated_mm):
    """Rows of `gap_shrink` without the campaign; resimulated_mm: residuals (n, 3) of the corrected simulator, or None
    without effects.
    """
    trajectory = case.measurements["trajectory"].to_numpy()[case.used]
    noise = float(np.sqrt(3.0) * case.noise_mm)
    rows = []
    for number, step in enumerate(found):
        for name in ("*", *pd.unique(trajectory)):
            here = np.ones(len(trajectory), dtype=bool) if name == "*" else trajectory == name
            share = share_closed(_part(found[0], here), _part(step, here)) if number else (np.nan,) * 3
            rows.append(
                _row(number, step, name, "held_out", step.residual_mm[here], noise, gap_rms(step.gap_mm2[here]), share)
            )
    if resimulated_mm is not None:
        before, step = gap_rms(found[0].gap_mm2), found[-1]
        after = gap_rms((resimulated_mm**2).sum(axis=1) - noise**2)
        share = (_share(before, after), np.nan, np.nan)
        rows.append(_row(len(found) - 1, step, "*", "resimulated", resimulated_mm, noise, after, share))
    return pd.DataFrame(rows)


def _row(number, step, trajectory, kind, residual_mm, noise, gap, share):
    """One row of `gap_shrink`."""
    distance = np.linalg.norm(residual_mm, axis=1)
    return {
        "step": number,
        "added": step.added,
        "effects": "+".join(step.effects) or "none",
        "trajectory": trajectory,
        "kind": kind,
        "points": len(distance),
        "rms_mm": float(np.sqrt((distance**2).mean())),
        "max_mm": float(distance.max()),
        "noise_rms_mm": noise,
        "gap_rms_mm": gap,
        **dict(zip(("share_closed", "share_closed_low", "share_closed_high"), share, strict=True)),
    }


def _share(before, after):
    """1 - after / before, not below -1; zero where there was no gap."""
    return max(1.0 - after / before, -1.0) if before > 0.0 else 0.0


def _part(step, here):
    """The step at some of its points."""
    return Step(step.added, step.effects, step.residual_mm[here], step.gap_mm2[here], step.draws[:, here])


def _strength(hypothesis, term, level):
    """Strength of one term of a hypothesis at a level."""
    return float(hypothesis.strengths[level][hypothesis.terms.index(term)])
