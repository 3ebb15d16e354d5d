"""How far the gap shrinks as effects are added: on points left out of the fit, and on the re-simulated campaign."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from rrru.gap.heldout import resampled_rows
from rrru.gap.options import OPTIONS

CLOSED = ("share_closed", "share_closed_low", "share_closed_high")


@dataclass(frozen=True)
class ShrinkStep:
    """The gap after some effects are added: its square (n,) in mm^2 at each point, less noise; draws (b, n) of it."""

    added: str
    effects: tuple
    residual_mm: np.ndarray
    gap_mm2: np.ndarray
    draws: np.ndarray

    def part(self, chosen):
        """The step at some of its points (n,)."""
        at = self.residual_mm[chosen], self.gap_mm2[chosen], self.draws[:, chosen]
        return ShrinkStep(self.added, self.effects, *at)

    @property
    def gap_rms_mm(self):
        """Root mean square gap."""
        return gap_rms(self.gap_mm2)


def gap_rms(squares):
    """Root mean square gap from squared gaps whose noise is taken off; zero where noise explains all."""
    return float(np.sqrt(max(float(np.mean(squares)), 0.0)))


def order_by_share(attribution):
    """(term, share of the gap's mean square on left-out points that it removes when it comes next), largest first."""
    hypothesis, level = attribution.hypothesis, attribution.level
    left, chosen, result = list(hypothesis.terms), [], []
    noise = 3.0 * attribution.case.noise_mm**2

    def gap(terms):
        prediction = attribution.held_out.predict(terms, hypothesis.strengths_of(terms, level), level, uncertain=False)
        return max(float((prediction.residual_mm**2).sum(axis=1).mean()) - noise, 0.0)

    start = now = gap([])
    while left:
        after = [gap([*chosen, term]) for term in left]
        best = int(np.argmin(after))
        result.append((left[best], (now - after[best]) / max(start, 1e-12)))
        now = after[best]
        chosen.append(left.pop(best))
    return tuple(result)


def shrink_steps(attribution, ordered, generator, draws):
    """Steps from the calibration alone to all effects, one after another.

    ordered: terms in the order in which they are added. What the last step leaves is the uncertainty of its numbers
    where it explains all, what the residuals show beyond the noise where it does not; the two are mixed by the
    probability that something is unexplained. The draws resample runs (stretches where there are fewer than ten) and
    redraw the fitted numbers.
    """
    case, hypothesis, level = attribution.case, attribution.hypothesis, attribution.level
    picks = resampled_rows(case, generator, draws)
    result = []
    for count in range(len(ordered) + 1):
        terms = ordered[:count]
        last = count == len(ordered)
        prediction = attribution.held_out.predict(terms, hypothesis.strengths_of(terms, level), level, uncertain=last)
        shown = (prediction.residual_mm**2).sum(axis=1) - 3.0 * case.noise_mm**2
        weight = attribution.posterior.probability_unexplained if last else 1.0
        numbers = generator.standard_normal((draws, prediction.spread.shape[-1]))
        moved = ((prediction.spread @ numbers.T) ** 2).sum(axis=1).T
        squares = weight * shown + (1.0 - weight) * prediction.uncertainty_mm2
        drawn = weight * shown[picks] + (1.0 - weight) * moved
        added = terms[-1].effect if terms else ""
        result.append(ShrinkStep(added, tuple(t.effect for t in terms), prediction.residual_mm, squares, drawn))
    return tuple(result)


def share_closed(before, after):
    """Share of the gap closed between two steps and its 95 % interval from their draws; zero where there was no gap."""
    share = _share(before.gap_rms_mm, after.gap_rms_mm)
    pairs = [_share(gap_rms(a), gap_rms(b)) for a, b in zip(before.draws, after.draws, strict=True)]
    low, high = np.quantile(pairs, OPTIONS.interval_quantiles)
    return share, float(min(low, share)), float(max(high, share))


def shrink_table(case, steps, resimulated_mm):
    """Rows of `gap_shrink` without the campaign; resimulated_mm (n, 3): of the corrected sim, None without effects."""
    trajectory = case.points["trajectory"].to_numpy()
    noise = float(np.sqrt(3.0) * case.noise_mm)
    rows = []
    for number, step in enumerate(steps):
        for name in ("*", *pd.unique(trajectory)):
            chosen = np.full(len(trajectory), True) if name == "*" else trajectory == name
            part = step.part(chosen)
            share = share_closed(steps[0].part(chosen), part) if number else (np.nan,) * 3
            sizes = _sizes(part.residual_mm) | {"noise_rms_mm": noise, "gap_rms_mm": part.gap_rms_mm}
            rows.append(_label(number, step, name, "held_out") | sizes | dict(zip(CLOSED, share, strict=True)))
    if resimulated_mm is not None:
        after = gap_rms((resimulated_mm**2).sum(axis=1) - noise**2)
        sizes = _sizes(resimulated_mm) | {"noise_rms_mm": noise, "gap_rms_mm": after}
        share = _share(steps[0].gap_rms_mm, after), np.nan, np.nan
        label = _label(len(steps) - 1, steps[-1], "*", "resimulated")
        rows.append(label | sizes | dict(zip(CLOSED, share, strict=True)))
    return pd.DataFrame(rows)


def model_row(shrink, kind, left_mm, noise_mm):
    """A row of `gap_shrink` of a robot's file, given_model or corrected_model, beside the other rows.

    left_mm (m, 3): measured minus the file's robot, NaN where it was not driven; noise_mm: per axis.
    """
    last, noise = shrink["step"].max(), float(np.sqrt(3.0) * noise_mm)
    own = shrink[(shrink["step"] == (0 if kind == "given_model" else last)) & (shrink["kind"] == "held_out")].iloc[0]
    start = float(shrink.loc[(shrink["step"] == 0) & (shrink["trajectory"] == "*"), "gap_rms_mm"].iloc[0])
    left = left_mm[np.isfinite(left_mm).all(axis=1)]
    after = gap_rms((left**2).sum(axis=1) - noise**2)
    share = (np.nan if kind == "given_model" else _share(start, after)), np.nan, np.nan
    label = {name: own[name] for name in ("step", "added", "effects")} | {"trajectory": "*", "kind": kind}
    sizes = _sizes(left) | {"noise_rms_mm": noise, "gap_rms_mm": after}
    return label | sizes | dict(zip(CLOSED, share, strict=True))


def _label(number, step, trajectory, kind):
    """What a row of `gap_shrink` is about."""
    effects = "+".join(step.effects) or "none"
    return {"step": number, "added": step.added, "effects": effects, "trajectory": trajectory, "kind": kind}


def _sizes(residual_mm):
    """Points and sizes of residuals (n, 3)."""
    distance = np.linalg.norm(residual_mm, axis=1)
    rms = float(np.sqrt((distance**2).mean()))
    return {"points": len(distance), "rms_mm": rms, "max_mm": float(distance.max())}


def _share(before, after):
    """1 - after / before, not below -1; zero where there was no gap."""
    return max(1.0 - after / before, -1.0) if before > 0.0 else 0.0
