"""Tables of one real series of an arm. Lengths in mm, angles in rad."""

from collections import defaultdict
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from rrru.arrays import FloatArray
from rrru.campaign import measurements as rows
from rrru.diagnosis.drive_spectra import amplitudes
from rrru.diagnosis.evidence import averaged
from rrru.diagnosis.marginal_problem import PRIOR_SCALES
from rrru.diagnosis.terms import EffectTerm
from rrru.studies.real.arms import Studied
from rrru.studies.real.series import named
from rrru.studies.real.sheets import PLACE
from rrru.studies.real.steps import counted, held_by_robot, held_out, rms, verdict_step

MODELS, UNDIAGNOSED = "abcde", "undiagnosed"
_FUNCTION, _WAVES, _SHOWN = ("drive_error_function", 0), ("transmission_orders", 0), 40
# a held-out residual above this many medians is far off; most readings that a note names
_FAR, _MAX_NAMED = 20.0, 6
# notes of ingest on every such series
_USUAL = ("no column", "undeclared columns left out", "no commanded positions")


def tables(studied: Studied) -> dict[str, pd.DataFrame]:
    """Frames by name, without the campaign; those of the diagnosis are empty without a diagnosis."""
    found = studied.diagnosis
    return {
        "real_verdicts": pd.DataFrame([_verdict(studied)]),
        "real_steps": _steps(studied),
        "real_parameters": _parameters(studied),
        "real_points": _points(studied),
        "real_spectrum": _spectrum(studied),
        "real_budget": found.tables["gap_budget"] if found else pd.DataFrame(),
        "real_seconds": pd.DataFrame({"step": [*studied.seconds], "seconds": [*studied.seconds.values()]}),
    }


def _verdict(studied: Studied) -> dict:
    """The row of `real_verdicts`."""
    found, series, left = _found(studied), studied.series, studied.held_out_mm
    names = ("effects", "probability", "where", "confounded_with", "noise_rms_mm", "gap_rms_mm", "gap_after_rms_mm")
    names = (*names, "share_closed", "share_closed_low", "share_closed_high", "noise_stated_mm", "next_runs", "points")
    verdict = {name: found[name] for name in (*names, "dropped_points")}
    before = studied.step("b").held_out_mm
    notes = (
        f"no cause is named: {found['no_answer']}" if found["no_answer"] else "",
        found["notes"],
        _waves(studied),
        _far(studied),
        *(note for note in studied.notes if not note.startswith(_USUAL)),
    )
    return verdict | {
        **named(series),
        "predicted_share": predicted_share(studied),
        "held_out_share": 1.0 - (rms(left) / rms(before)) ** 2,
        **held_out(left),
        **_by_model(studied, series.section.get("reference", {})),
        "notes": "; ".join(filter(None, notes)),
    }


def _far(studied: Studied) -> str:
    """Held-out readings with far larger residuals, and the rms without them, in words; "" if none."""
    frame, left = studied.measurements, studied.held_out_mm
    held = (frame["status"] == rows.HELD_OUT).to_numpy() & held_by_robot(studied.problem)
    far = left > _FAR * np.median(left) if len(left) else np.zeros(0, dtype=bool)
    if not far.any():
        return ""
    outliers = studied.rows[held][far]
    readings = [f"row {row} of {target}" for row, target in zip(outliers[PLACE], outliers["target"], strict=True)]
    more = f" and {len(readings) - _MAX_NAMED} more" if len(readings) > _MAX_NAMED else ""
    shown = ", ".join(readings[:_MAX_NAMED])
    return f"far off among those held out: {shown}{more}; without: {rms(left[~far]):.3g} mm rms"


def _found(studied: Studied) -> Mapping[str, Any]:
    """The verdict of the diagnosis, or the default values of a series without diagnosis."""
    if studied.diagnosis:
        return studied.diagnosis.verdict
    texts = dict.fromkeys(("where", "confounded_with", "next_runs", "notes", "no_answer"), "")
    return defaultdict(lambda: np.nan, texts, effects=UNDIAGNOSED, points=studied.plain.count, dropped_points=0)


def _waves(studied: Studied) -> str:
    """Evidence for sharp waves of single drives against a rough function of their angles, in words; "" if neither.

    Each is added to the other causes of the verdict, at their prior scales.
    """
    library, named = studied.problem.library, (_FUNCTION[0], _WAVES[0])
    if studied.diagnosis is None or not all(name in library for name in named):
        return ""
    inference = studied.diagnosis.inference
    evidence = inference.evidence
    hypothesis, level = inference.hypothesis, inference.level
    others = tuple(term for term in hypothesis.terms if term.effect not in named)
    fixed = [[strength] for strength in hypothesis.strengths_of(others, level)]

    def log_evidence(*names: str) -> float:
        """Log evidence of effects added to the others."""
        added = tuple(map(EffectTerm, names))
        value, _ = evidence.over_strengths((*others, *added), (*fixed, *(PRIOR_SCALES for _ in names)), [level])
        return float(averaged(value, evidence.log_scales(added))[0])

    neither = log_evidence() if others else evidence.none[level]
    function, waves = map(log_evidence, named)
    if function < neither:
        return ""
    count = len(library[_WAVES[0]].coordinates) // 2
    said = f"a rough function of every drive's angle and {count} sharp waves of single drives both explain errors"
    better = "the function" if function > waves else "the waves"
    return f"{said}; log Bayes factor {abs(function - waves):.0f} for {better}"


def _by_model(studied: Studied, reference: Mapping[str, Any]) -> dict[str, float]:
    """Held-out rms by letter of the model, ours and published ones; of the compliances that of the last one."""
    ours = {step.model[0]: rms(step.held_out_mm) for step in studied.steps}
    stated = reference.get(studied.series.label, {})
    result = {f"held_out_{model}_rms_mm": ours.get(model, np.nan) for model in MODELS}
    return result | {f"reference_{model}_rms_mm": float(stated.get(model, np.nan)) for model in MODELS}


def predicted_share(studied: Studied) -> float:
    """Fraction of the calibrated model's mean square residual that the causes explain, by cross-validation."""
    if studied.diagnosis is None:
        return np.nan
    inference = studied.diagnosis.inference
    hypothesis, level = inference.hypothesis, inference.level
    used = counted(studied.problem)
    squares = [
        (inference.held_out.predict(terms, strengths, level, uncertain=False).residual_mm[used] ** 2).sum(axis=1).mean()
        for terms, strengths in (((), ()), (hypothesis.terms, hypothesis.prior_scales[level]))
    ]
    return float(1.0 - squares[1] / squares[0])


def _steps(studied: Studied) -> pd.DataFrame:
    """Rows of `real_steps`: the plain models, and the model of the verdict."""
    made = [*studied.steps]
    if studied.diagnosis:
        made.append(verdict_step(studied.problem, studied.state, studied.seconds["gap"]))
    return pd.DataFrame([step.row for step in made]).assign(number=np.arange(1, len(made) + 1))


def _parameters(studied: Studied) -> pd.DataFrame:
    """Rows of `real_parameters`; those of the error functions are in the spectrum."""
    if studied.diagnosis is None:
        return pd.DataFrame()
    frame = studied.diagnosis.tables["gap_parameters"]
    frame = frame[frame["effect"] != _FUNCTION[0]]
    return frame[["effect", "parameter", "unit", "value", "standard_error"]].assign(nominal=np.nan, note="")


def _points(studied: Studied) -> pd.DataFrame:
    """Rows of `real_points`."""
    frame, problem = studied.measurements, studied.problem
    count = len(frame)
    bare, last = (
        np.linalg.norm(problem.left(state)[:count], axis=1) for state in (studied.step("b").state, studied.state)
    )
    places = dict(zip(("x_mm", "y_mm", "z_mm"), rows.measured(frame).T, strict=True))
    empty = dict.fromkeys(("bare_x_mm", "bare_y_mm", "bare_z_mm"), np.nan)
    used = np.zeros(count, dtype=bool)
    used[problem.at] = True
    return pd.DataFrame(
        {"row": studied.rows[PLACE], "reading": studied.rows["target"], **places, **empty}
        | {"bare_residual_mm": bare, "residual_mm": last, "used": used}
        | {"stands_out": (frame["status"] == "outlier").to_numpy()}
    )


def _waves_of(values: FloatArray, number: int, drives: int) -> FloatArray:
    """Numbers (orders, 2) of sine and cosine of one drive from those of all drives, each of which begins with its
    constant.
    """
    return np.reshape(np.reshape(values, (drives, -1))[number, 1:], (-1, 2))


def _spectrum(studied: Studied) -> pd.DataFrame:
    """Rows of `real_spectrum` of the rotary joints."""
    problem, robot = studied.problem, studied.problem.mechanism
    orders, parts = np.arange(1, _SHOWN + 1), []
    found = studied.state.effects.get(_FUNCTION)
    before, after = (amplitudes(problem, state, orders) for state in (studied.step("b").state, studied.state))
    for number, (drive, unit) in enumerate(zip(robot.parts.drives, robot.parts.units, strict=True)):
        if unit != "rad":
            continue
        sine, cosine, error = np.zeros((3, len(orders)))
        if found is not None and studied.diagnosis:
            errors = studied.diagnosis.tables["gap_parameters"]
            errors = errors.loc[errors["effect"] == _FUNCTION[0], "standard_error"].to_numpy()
            values = problem.library[_FUNCTION[0]].coordinates.to_values(found, {})
            waves = _waves_of(values, number, len(robot.parts.drives))[: len(orders)]
            error[: len(waves)] = _waves_of(errors, number, len(robot.parts.drives))[: len(orders)].mean(axis=1)
            sine[: len(waves)], cosine[: len(waves)] = waves.T
        reach = float(np.ptp(problem.motion.drive[problem.used][:, number]))
        parts.append(
            pd.DataFrame(
                {
                    "joint": drive.site,
                    "order": orders,
                    "resolution": 2.0 * np.pi / max(reach, 1e-9),
                    "before_rad": before[number],
                    "after_rad": after[number],
                    "found_rad": np.hypot(sine, cosine),
                    "found_phase_rad": np.arctan2(cosine, sine),
                    "found_error_rad": error,
                }
            )
        )
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()
