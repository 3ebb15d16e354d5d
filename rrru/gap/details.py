"""The tables behind a verdict."""

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.gap import shrink
from rrru.gap.heldout import folds, log_score, predict
from rrru.gap.identify import identify
from rrru.gap.locate import drive_errors, locate
from rrru.gap.terms import spread
from rrru.gap.unknown import UNKNOWN
from rrru.gap.verdict import label


def details_of(found, verdict, steps, residual, further, generator, settings):
    """Frames by table name, without the campaign."""
    case, linear = found.case, found.case.linearise(found.calibrated)
    exact = case.measured_mm - case.exact(found.state) if found.state.effects else None
    return {
        "gap_locate": locate(case, residual, linear.drive, generator, settings.draws),
        "gap_identifiability": identify(case, linear),
        "gap_attribute": _attribute_rows(found, verdict),
        "gap_sets": _set_rows(found),
        "gap_shrink": shrink.table(case, steps, exact),
        "gap_parameters": _parameter_rows(found),
        "gap_next_runs": further.assign(rank=np.arange(1, len(further) + 1)),
        "gap_points": _point_rows(
            case,
            rows.measured(case.measurements) - case.sim(found.calibrated.deviations),
            steps[-1].residual_mm,
            drive_errors(residual, linear.drive),
        ),
    }


def _attribute_rows(found, verdict):
    """Rows of `gap_attribute`: every effect of the library, none and unexplained."""
    beliefs, evidence, case = found.posterior, found.evidence, found.case
    none = evidence.none.max()
    fold = folds(case)
    alone = log_score(predict(case, evidence, (), [], 0, fold), case)
    result = []
    for name in case.effects:
        holding = [h for h in beliefs.hypotheses if name in h.effects]
        best = max(holding, key=lambda h: h.evidence.max(), default=None)
        legs = beliefs.legs(name)
        gain, error = np.nan, np.nan
        alone_best = max((h for h in holding if len(h.terms) == 1), key=lambda h: h.evidence.max(), default=None)
        if alone_best:
            hypothesis, level = alone_best, int(alone_best.evidence.argmax())
            gained = (
                log_score(predict(case, evidence, hypothesis.terms, hypothesis.strengths[level], level, fold), case)
                - alone
            )
            by_fold = np.array([gained[fold == k].sum() for k in np.unique(fold)])
            gain, error = (
                float(by_fold.sum()),
                float(np.sqrt(len(by_fold)) * by_fold.std(ddof=1)) if len(by_fold) > 1 else np.nan,
            )
        result.append(
            {
                "effect": name,
                "probability": beliefs.marginal(name),
                "legs": str(max(legs, key=legs.get)) if legs else "",
                "log_evidence": float(best.evidence.max() - none) if best else np.nan,
                "heldout_gain": gain,
                "heldout_gain_se": error,
                "note": "" if best else "far less probable than others",
            }
        )
    empty = {"legs": "", "log_evidence": np.nan, "heldout_gain": np.nan, "heldout_gain_se": np.nan}
    result += [
        {"effect": name, "probability": 0.0, **empty, "note": f"not tested: {note}"}
        for name, note in case.untestable.items()
    ]
    sets = beliefs.sets()
    result.append({"effect": "none", "probability": sets.get((frozenset(), False), 0.0), **empty, "note": ""})
    unknown = sum(p for (_, flag), p in sets.items() if flag)
    result.append(
        {
            "effect": "unexplained",
            "probability": unknown,
            **empty,
            "note": _looks_like(beliefs) if unknown > 0.5 else "",
        }
    )
    return pd.DataFrame(result)


def _looks_like(beliefs):
    """What the unexplained part follows, where one of the unknown functions is likely."""
    likely = {name: beliefs.marginal(name) for name in UNKNOWN}
    best = max(likely, key=likely.get)
    return (
        f"follows {UNKNOWN[best].follows} (p = {likely[best]:.2f})"
        if likely[best] > 0.5
        else "follows no smooth function tried"
    )


def _set_rows(found, most=20):
    """Rows of `gap_sets`: the most probable sets."""
    result = []
    for rank, ((effects, flag), p) in enumerate(list(found.posterior.sets().items())[:most], start=1):
        hypothesis, _ = found.posterior.best_of(effects, flag)
        legs = ", ".join(f"{term.effect}: {term.legs}" for term in hypothesis.terms)
        gained = float(hypothesis.evidence.max() - found.evidence.none.max())
        names = label(tuple(sorted(effects)), flag)
        result.append(
            {
                "rank": rank,
                "effects": names,
                "legs": legs,
                "unexplained": flag,
                "probability": p,
                "log_evidence": gained,
            }
        )
    return pd.DataFrame(result)


def _parameter_rows(found):
    """Rows of `gap_parameters`: all numbers of the corrected sim, the effects' with standard errors by their change
    with the coordinates.
    """
    columns = ("effect", "parameter", "unit", "value", "standard_error", "at_bound")
    result, start, library = [], 0, found.case.library
    for parameter, value in zip(found.case.mechanism.parameters, found.state.deviations, strict=True):
        result.append(
            dict(zip(columns, ("calibration", parameter.name, parameter.unit, value, np.nan, False), strict=True))
        )
    for term in found.hypothesis.terms:
        key, effect = (term.effect, term.shape), library[term.effect]
        if key not in found.state.effects:
            break
        shape, coordinates = found.state.shape(library, key), found.state.effects[key]
        values = effect.coordinates.to_values(coordinates, shape)
        matrix = spread(effect.coordinates, term.legs)
        covariance = (
            matrix @ found.covariance[start : start + matrix.shape[1], start : start + matrix.shape[1]] @ matrix.T
        )
        start += matrix.shape[1]
        errors = np.sqrt(
            np.maximum(
                np.diag(_slope(effect, coordinates, shape) @ covariance @ _slope(effect, coordinates, shape).T), 0.0
            )
        )
        bound = effect.parameters.at_bound(values)
        for k, parameter in enumerate(effect.parameters):
            fitted = bool(errors[k] > 0.0)
            result.append(
                dict(
                    zip(
                        columns,
                        (
                            term.effect,
                            parameter.name,
                            parameter.unit,
                            values[k],
                            errors[k] if fitted else np.nan,
                            fitted and bool(bound[k]),
                        ),
                        strict=True,
                    )
                )
            )
    return pd.DataFrame(result, columns=columns)


def _slope(effect, coordinates, shape):
    """Derivative (p, c) of an effect's parameter values by its coordinates."""
    steps = 1e-4 * np.asarray(effect.coordinates.typical)
    columns = []
    for k, step in enumerate(steps):
        shift = np.zeros(len(steps))
        shift[k] = step
        difference = effect.coordinates.to_values(coordinates + shift, shape) - effect.coordinates.to_values(
            coordinates - shift, shape
        )
        columns.append(np.where(np.abs(difference) > np.pi, 0.0, difference) / (2.0 * step))
    return np.stack(columns, axis=-1)


def _point_rows(case, before, after, drive):
    """Rows of `gap_points`: residuals before (m, 3), after and as drive errors (n, 3) of the used points."""
    frame = case.measurements[["run", "trajectory", "point"]].reset_index(drop=True)
    position = rows.command(case.measurements)
    result = frame.assign(**{f"command_{axis}_mm": position[:, k] for k, axis in enumerate("xyz")})
    result = result.assign(**{f"before_{axis}_mm": before[:, k] for k, axis in enumerate("xyz")})
    unit = case.mechanism.drive_unit
    other = "mm" if unit == "rad" else "rad"
    drives = (("drive_error{}_" + unit, drive, "123"), ("drive_error{}_" + other, np.nan, "123"))
    for stem, values, suffix in (("after_{}_mm", after, "xyz"), *drives):
        full = np.full(position.shape, np.nan)
        full[case.used] = values
        result = result.assign(**{stem.format(end): full[:, k] for k, end in enumerate(suffix)})
    return result.assign(used=case.used)
