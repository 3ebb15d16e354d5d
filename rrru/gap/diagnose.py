"""The diagnosis of one campaign: where the gap lies, which effect causes it, how far it shrinks, and what to measure next."""

from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.effects.registry import EFFECTS, find
from rrru.errors import ConfigError, FitError
from rrru.gap import shrink
from rrru.gap.advise import advise
from rrru.gap.attribute import attribute
from rrru.gap.case import make_case
from rrru.gap.heldout import folds, predict
from rrru.gap.identify import identify
from rrru.gap.locate import drive_errors, locate, worst_spot
from rrru.gap.posterior import Prior
from rrru.gap.refine import coordinates_of
from rrru.gap.terms import spread
from rrru.gap.verdict import decide, label
from rrru.seeds import stream

# the diagnosis looks further than a calibration's bounds, which a strong effect would press against
_ANGLE_LIMIT_RAD, _LENGTH_LIMIT_MM = 0.3, 100.0


@dataclass(frozen=True)
class GapSettings:
    """effects: names or `module:object` of the laws that may act; known: effect to values of parameters that are known, such as a gear ratio;
    prior; draws: resamplings for intervals; seed.
    """

    effects: tuple = tuple(EFFECTS)
    known: dict = field(default_factory=dict)
    prior: Prior = field(default_factory=Prior)
    draws: int = 200
    seed: int = 0

    @classmethod
    def from_config(cls, section, seed=0):
        """Settings of the configuration's `gap` section."""
        prior = Prior(tuple(section["prior_counts"]), section["prior_unexplained"], section["tolerance"])
        return cls((*section["effects"], *section["own_effects"]), section["known"], prior, section["draws"], seed)

    def without(self, name):
        """The settings with one effect taken out of the library."""
        return replace(self, effects=tuple(effect for effect in self.effects if effect != name))

    def library(self):
        """Effects by name, what is known of them fixed; raises ConfigError for an unknown effect or parameter."""
        found = [find(name) for name in self.effects]
        result = {effect.name: effect for effect in found}
        if len(result) < len(found):
            raise ConfigError(f"gap.effects names an effect twice: {', '.join(self.effects)}")
        for name, values in self.known.items():
            if name not in result:
                raise ConfigError(f"gap.known: no effect {name!r}; known: {', '.join(result)}")
            result[name] = _with_known(result[name], values)
        return result


@dataclass(frozen=True)
class Diagnosis:
    """verdict: mapping of `gap_verdicts` without the campaign; tables: frames by name, without the campaign; state: the corrected sim;
    calibrated_errors (p,): of the calibration alone; attribution: everything that the search found.
    """

    verdict: dict
    tables: dict
    state: object
    calibrated_errors: np.ndarray
    attribution: object


def sim(mechanism):
    """The mechanism with bounds wide enough for a gap to show itself in the errors."""
    return replace(mechanism, angle_limit_rad=_ANGLE_LIMIT_RAD, length_limit_mm=_LENGTH_LIMIT_MM)


def diagnose(measurements, mechanism, masses, settings, noise_mm=None, details=True, name="", use_near_singularity=True):
    """Diagnosis of a measurement table.

    masses: `rrru.mechanisms.dynamics.Masses`; noise_mm: per axis, estimated where None; details: also the tables that no verdict needs; name:
    of the campaign, for its random stream. Raises FitError where there are too few points to calibrate on.
    """
    case = make_case(measurements, sim(mechanism), masses, noise_mm or 1.0, settings.library(), use_near_singularity)
    if 3 * len(case) < 2 * len(case.mechanism.parameters):
        raise FitError(f"{len(case)} usable points are too few for a diagnosis; allowed: at least {len(case.mechanism.parameters)}")
    found = attribute(case, settings.prior, "given" if noise_mm else "estimated")
    case = found.case
    generator = stream(settings.seed, "gap", name)
    ordered = shrink.order_by_share(case, found.evidence, found.hypothesis, found.level)
    verdict = decide(found, {term.effect: share for term, share in ordered})
    unknown = sum(p for (_, flag), p in found.posterior.sets().items() if flag)
    named = [term for term, _ in ordered if term.effect in verdict.effects]
    steps = shrink.steps(found, named, unknown, generator, settings.draws)
    closed = shrink.share_closed(steps[0], steps[-1]) if named else (0.0, 0.0, 0.0)
    residual = case.measured_mm - case.sim(found.calibrated.errors)[case.used]
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
    tables = _tables(found, verdict, steps, residual, further, generator, settings) if details else {}
    return Diagnosis(row, tables, found.state, found.calibrated.errors, found)


def _tables(found, verdict, steps, residual, further, generator, settings):
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
            rows.measured(case.measurements) - case.sim(found.calibrated.errors),
            steps[-1].residual_mm,
            drive_errors(residual, linear.drive),
        ),
    }


def _attribute_rows(found, verdict):
    """Rows of `gap_attribute`: every effect of the library, none and unexplained."""
    beliefs, evidence, case = found.posterior, found.evidence, found.case
    none = evidence.none.max()
    fold = folds(case)
    alone = _log_score(predict(case, evidence, (), [], 0, fold), case)
    result = []
    for name in case.library:
        holding = [h for h in beliefs.hypotheses if name in h.effects]
        best = max(holding, key=lambda h: h.evidence.max(), default=None)
        legs = beliefs.legs(name)
        gain, error = np.nan, np.nan
        alone_best = max((h for h in holding if len(h.terms) == 1), key=lambda h: h.evidence.max(), default=None)
        if alone_best:
            hypothesis, level = alone_best, int(alone_best.evidence.argmax())
            gained = _log_score(predict(case, evidence, hypothesis.terms, hypothesis.strengths[level], level, fold), case) - alone
            by_fold = np.array([gained[fold == k].sum() for k in np.unique(fold)])
            gain, error = float(by_fold.sum()), float(np.sqrt(len(by_fold)) * by_fold.std(ddof=1)) if len(by_fold) > 1 else np.nan
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
    result += [{"effect": name, "probability": 0.0, **empty, "note": f"not tested: {note}"} for name, note in case.untestable.items()]
    sets = beliefs.sets()
    result.append({"effect": "none", "probability": sets.get((frozenset(), False), 0.0), **empty, "note": ""})
    result.append({"effect": "unexplained", "probability": sum(p for (_, flag), p in sets.items() if flag), **empty, "note": ""})
    return pd.DataFrame(result)


def _log_score(prediction, case):
    """Log predictive score (n,) of left-out points under the instrument's noise and the prediction's own uncertainty."""
    variance = case.noise_mm**2 + prediction.uncertainty_mm2 / 3.0
    return -0.5 * (prediction.residual_mm**2).sum(axis=1) / variance - 1.5 * np.log(variance)


def _set_rows(found, most=20):
    """Rows of `gap_sets`: the most probable sets."""
    result = []
    for rank, ((effects, flag), p) in enumerate(list(found.posterior.sets().items())[:most], start=1):
        hypothesis, _ = found.posterior.best_of(effects, flag)
        legs = ", ".join(f"{term.effect}: {term.legs}" for term in hypothesis.terms)
        gained = float(hypothesis.evidence.max() - found.evidence.none.max())
        names = label(tuple(sorted(effects)), flag)
        result.append({"rank": rank, "effects": names, "legs": legs, "unexplained": flag, "probability": p, "log_evidence": gained})
    return pd.DataFrame(result)


def _parameter_rows(found):
    """Rows of `gap_parameters`: the numbers of the corrected sim, with standard errors by their change with the coordinates."""
    columns = ("effect", "parameter", "unit", "value", "standard_error", "at_bound")
    result, start, library = [], 0, found.case.library
    for term in found.hypothesis.terms:
        key, effect = (term.effect, term.shape), library[term.effect]
        if key not in found.state.effects:
            break
        shape, coordinates = found.state.shape(library, key), found.state.effects[key]
        values = effect.coordinates.to_values(coordinates, shape)
        matrix = spread(effect.coordinates, term.legs)
        covariance = matrix @ found.covariance[start : start + matrix.shape[1], start : start + matrix.shape[1]] @ matrix.T
        start += matrix.shape[1]
        errors = np.sqrt(np.maximum(np.diag(_slope(effect, coordinates, shape) @ covariance @ _slope(effect, coordinates, shape).T), 0.0))
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
        difference = effect.coordinates.to_values(coordinates + shift, shape) - effect.coordinates.to_values(coordinates - shift, shape)
        columns.append(np.where(np.abs(difference) > np.pi, 0.0, difference) / (2.0 * step))
    return np.stack(columns, axis=-1)


def _point_rows(case, before, after, drive):
    """Rows of `gap_points`: residuals before (m, 3), after and as drive errors (n, 3) of the used points."""
    frame = case.measurements[["run", "trajectory", "point"]].reset_index(drop=True)
    position = rows.command(case.measurements)
    result = frame.assign(**{f"command_{axis}_mm": position[:, k] for k, axis in enumerate("xyz")})
    result = result.assign(**{f"before_{axis}_mm": before[:, k] for k, axis in enumerate("xyz")})
    for stem, values, suffix in (("after_{}_mm", after, "xyz"), ("drive_error{}_rad", drive, "123")):
        full = np.full(position.shape, np.nan)
        full[case.used] = values
        result = result.assign(**{stem.format(end): full[:, k] for k, end in enumerate(suffix)})
    return result.assign(used=case.used)


def _with_known(effect, values):
    """The effect with parameters of its shapes fixed to known values; raises ConfigError for a parameter that no shape holds."""
    coordinates = effect.coordinates
    unknown = [key for key in values if key not in coordinates.shapes[0]]
    if unknown:
        allowed = ", ".join(coordinates.shapes[0]) or "none"
        raise ConfigError(f"gap.known: {effect.name} has no known {unknown[0]!r}; allowed: {allowed}")
    shapes = tuple(dict(pairs) for pairs in dict.fromkeys(tuple((dict(shape) | dict(values)).items()) for shape in coordinates.shapes))
    return replace(effect, coordinates=replace(coordinates, shapes=shapes))
