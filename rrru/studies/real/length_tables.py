"""Tables of machines with measured lengths: real_steps, rows of real_verdicts and real_parameters, real_points."""

import numpy as np
import pandas as pd

from rrru.studies.real.length_models import UNEXPLAINED, predict_held_out
from rrru.studies.real.lengths_section import held_out, row_numbers

# most rows that a note names
_NAMED = 10
# draws, blocks and seed of the bootstrap over blocks of rows
_DRAWS, _BLOCKS, _SEED = 1000, 20, 1


def tables(frame, read, case, verdict, readings, chain, parameters, words):
    """Tables of one calibration: real_verdicts, real_steps, real_parameters, real_points.

    frame, read: one row per place, and its Section; readings: names of the lengths; chain: combinations of effect
    models for the steps; parameters: rows of real_parameters; words: notes (sentences), and further columns of the
    verdict.
    """
    models, errors = steps(case, chain, held_out(frame, read))
    notes, columns = words
    rows = row_numbers(frame, read)
    row = verdict_row(case, verdict, errors) | columns
    row |= {"notes": " ".join([*notes, *bad_words(case, readings, rows)])}
    return {
        "real_verdicts": pd.DataFrame([row]),
        "real_steps": models,
        "real_parameters": pd.DataFrame(parameters),
        "real_points": points(case, verdict[2], readings, rows),
    }


def parameter(name, unit, value, standard_error, nominal, note):
    """One row of real_parameters."""
    numbers = {"value": float(value), "standard_error": float(standard_error), "nominal": float(nominal)}
    return {"parameter": name, "unit": unit, **numbers, "note": note}


def anchors(case, chosen, names, note):
    """Rows of real_parameters of the anchors with the verdict's effects, and of the frame alone (bare_)."""
    rows = []
    for prefix, hypothesis, said in (("", chosen, note), ("bare_", case.hypothesis(()), "without effect models")):
        if hypothesis is None:
            continue
        fit = hypothesis.fit
        values, errors = fit.lengths.machine(fit.values)[0], fit.lengths.split(hypothesis.standard_errors)[0]
        for name, place, error in zip(names, values, errors, strict=True):
            coordinates = zip("xyz", place, error, strict=False)
            rows += [
                parameter(f"{prefix}{name}_{axis}", "mm", at, wide, np.nan, said) for axis, at, wide in coordinates
            ]
    return rows


def steps(case, chain, held):
    """Table real_steps of a chain of combinations of effect models, and the held-out errors (N, k) of each.

    Held-out columns: from `predict_held_out`, one value per reading.
    """
    rows, errors = [], {}
    for effect_models in chain:
        hypothesis = case.hypothesis(effect_models)
        if hypothesis is None:
            continue
        fit = hypothesis.fit
        errors[tuple(effect_models)] = off = predict_held_out(fit, held)
        adds = "anchors" + ("" if case.bare.places_mm is not None else " and the place of every row")
        rows.append(
            {
                "model": " + ".join(["frame", *(effect_model.adds for effect_model in effect_models)]),
                "adds": effect_models[-1].adds if effect_models else adds,
                "parameters": len(fit.values),
                "identifiable": fit.estimate.rank,
                "train_rms_mm": fit.rms_mm,
                "held_out_mean_mm": float(np.nanmean(np.abs(off))),
                "held_out_rms_mm": rms(off),
                "held_out_max_mm": float(np.nanmax(np.abs(off))),
            }
        )
    return pd.DataFrame(rows), errors


def verdict_row(case, verdict, errors):
    """The row of real_verdicts without words; errors: of the steps, with those of the bare frame and of the verdict."""
    effects, probability, chosen = verdict
    before, after = errors.get((), errors[chosen.effect_models]), errors[chosen.effect_models]
    noise = chosen.noise_mm if UNEXPLAINED in effects else chosen.fit.noise_mm
    gaps = [float(np.sqrt(max(rms(errors_mm) ** 2 - noise**2, 0.0))) for errors_mm in (before, after)]
    closed = share_closed(before, after, noise) if chosen.effect_models else (0.0, 0.0, 0.0)
    return {
        "effects": "+".join(effects) or "none",
        "probability": probability,
        "noise_rms_mm": noise,
        "gap_rms_mm": gaps[0],
        "gap_after_rms_mm": gaps[1],
        **dict(zip(("share_closed", "share_closed_low", "share_closed_high"), closed, strict=True)),
        "held_out_mean_mm": float(np.nanmean(np.abs(after))),
        "held_out_rms_mm": rms(after),
        "held_out_max_mm": float(np.nanmax(np.abs(after))),
        "points": len(case.used),
        "dropped_points": int((~case.used).any(axis=1).sum()),
    }


def bad_words(case, readings, rows):
    """Sentences on rejected readings and on used ones with large residuals; rows (N,): their numbers."""
    said = []
    for flags, words in (
        (~case.used, "Rejected, because other lengths contradict them"),
        (case.suspect, "Used, although their residuals exceed those of their neighbours"),
    ):
        named = [
            f"row {rows[row]} ({', '.join(np.array(readings)[flags[row]])})"
            for row in np.flatnonzero(flags.any(axis=1))
        ]
        more = f" and {len(named) - _NAMED} more rows" if len(named) > _NAMED else ""
        said += [f"{words}: {'; '.join(named[:_NAMED])}{more}."] if named else []
    return said


def points(case, chosen, readings, rows):
    """Table real_points: a row per reading, with the frame alone (bare_) and with the verdict's effects.

    row, reading; the place in mm, z NaN in the plane; residuals, measured minus modelled length, in mm; used: in the
    fit; stands_out: named for a large residual although used.
    """
    count, bare = len(readings), case.hypothesis(()) or chosen
    columns = {"row": np.repeat(rows, count), "reading": list(readings) * len(rows)}
    for prefix, fit in (("bare_", bare.fit), ("", chosen.fit)):
        places = np.pad(fit.places_mm, ((0, 0), (0, 3 - fit.places_mm.shape[1])), constant_values=np.nan)
        columns |= {f"{prefix}{axis}_mm": np.repeat(places[:, k], count) for k, axis in enumerate("xyz")}
        columns |= {f"{prefix}residual_mm": fit.residual_mm.ravel()}
    return pd.DataFrame(columns | {"used": case.used.ravel(), "stands_out": case.suspect.ravel()})


def rms(values):
    """Root mean square of the values that are not NaN."""
    return float(np.sqrt(np.nanmean(values**2)))


def share_closed(before, after, noise_mm):
    """Explained fraction of the gap from errors (N, k), and its 95 % interval by a block bootstrap of rows."""
    generator = np.random.default_rng(_SEED)
    blocks = np.array_split(np.arange(len(before)), min(_BLOCKS, len(before)))
    counts = np.array([np.isfinite(before[block]).sum() for block in blocks])
    first, second = (np.array([np.nansum(one[block] ** 2) for block in blocks]) for one in (before, after))
    drawn = generator.integers(len(counts), size=(_DRAWS, len(counts)))

    def share(chosen):
        total = np.maximum(counts[chosen].sum(axis=-1), 1)
        gaps = [np.maximum(one[chosen].sum(axis=-1) / total - noise_mm**2, 0.0) for one in (first, second)]
        return np.where(gaps[0] > 0.0, np.maximum(1.0 - gaps[1] / np.maximum(gaps[0], 1e-24), -1.0), 0.0)

    value = float(share(np.arange(len(counts))))
    low, high = np.quantile(share(drawn), [0.025, 0.975])
    return value, float(min(low, value)), float(max(high, value))
