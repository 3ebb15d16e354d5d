"""Tables of one real series of an arm. Lengths in mm, angles in rad."""

from collections import defaultdict
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.diagnosis.drive_spectra import amplitudes
from rrru.diagnosis.evidence import PRIOR_SCALES, averaged
from rrru.diagnosis.terms import EffectTerm
from rrru.studies.real.arms import Studied
from rrru.studies.real.refusals import named
from rrru.studies.real.sheets import PLACE
from rrru.studies.real.steps import counted, held_by_robot, held_out, rms, verdict_step

MODELS, UNDIAGNOSED = "abcde", "undiagnosed"
_FUNCTION, _WAVES, _SHOWN = ("drive_error_function", 0), ("transmission_orders", 0), 40
# a reading held out is far off from so many medians on; so many are told
_FAR, _TOLD = 20.0, 6
# what ingest says of every such series
_USUAL = ("no column", "undeclared columns left out", "no commanded positions")


def tables(studied: Studied) -> dict[str, pd.DataFrame]:
    """Frames by name, without the campaign; those of the diagnosis are empty where there is none."""
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
    told = ("effects", "probability", "where", "confusable_with", "noise_rms_mm", "gap_rms_mm", "gap_after_rms_mm")
    told = (*told, "share_closed", "share_closed_low", "share_closed_high", "noise_stated_mm", "next_runs", "points")
    own = {name: found[name] for name in (*told, "dropped_points")}
    before = studied.step("b").held_out_mm
    notes = (
        f"no cause is named: {found['no_answer']}" if found["no_answer"] else "",
        found["notes"],
        _waves(studied),
        _far(studied),
        *(note for note in studied.notes if not note.startswith(_USUAL)),
    )
    return own | {
        **named(series),
        "predicted_share": predicted_share(studied),
        "held_out_share": 1.0 - (rms(left) / rms(before)) ** 2,
        **held_out(left),
        **_by_model(studied, series.section.get("reference", {})),
        "notes": "; ".join(filter(None, notes)),
    }


def _far(studied: Studied) -> str:
    """Which readings on the rows held out no law comes near, and what is left without them, in words; "" if none."""
    frame, left = studied.measurements, studied.held_out_mm
    held = (frame["status"] == rows.HELD_OUT).to_numpy() & held_by_robot(studied.case)
    far = left > _FAR * np.median(left) if len(left) else np.zeros(0, dtype=bool)
    if not far.any():
        return ""
    own = studied.rows[held][far]
    readings = [f"row {row} of {target}" for row, target in zip(own[PLACE], own["target"], strict=True)]
    more = f" and {len(readings) - _TOLD} more" if len(readings) > _TOLD else ""
    return f"far off among those held out: {', '.join(readings[:_TOLD])}{more}; without: {rms(left[~far]):.3g} mm rms"


def _found(studied: Studied) -> Mapping[str, Any]:
    """The verdict of the diagnosis; without one what a series has that nobody has diagnosed."""
    if studied.diagnosis:
        return studied.diagnosis.verdict
    texts = dict.fromkeys(("where", "confusable_with", "next_runs", "notes", "no_answer"), "")
    return defaultdict(lambda: np.nan, texts, effects=UNDIAGNOSED, points=studied.plain.count, dropped_points=0)


def _waves(studied: Studied) -> str:
    """Whether a few sharp waves of single drives do, or a rough function of their angles, in words; "" if neither.

    Each beside the other causes of the verdict, at the strengths that these have.
    """
    library, named = studied.case.library, (_FUNCTION[0], _WAVES[0])
    if studied.diagnosis is None or not all(name in library for name in named):
        return ""
    inference = studied.diagnosis.inference
    hypothesis, level = inference.hypothesis, inference.level
    rest = tuple(term for term in hypothesis.terms if term.effect not in named)
    fixed = [[strength] for strength in hypothesis.strengths_of(rest, level)]

    def told(*names: str) -> float:
        """Log evidence of laws beside the rest."""
        terms, grids = (*rest, *map(EffectTerm, names)), (*fixed, *(PRIOR_SCALES for _ in names))
        return float(averaged(inference.evidence.over_strengths(terms, grids, [level])[0], len(names))[0])

    neither, function, waves = told() if rest else inference.evidence.none[level], *map(told, named)
    if function < neither:
        return ""
    count = len(library[_WAVES[0]].coordinates) // 2
    said = f"a rough function of every drive's angle and {count} sharp waves of single drives both explain errors"
    likelier = "the function" if function > waves else "the waves"
    return f"{said}; {likelier} by {abs(function - waves):.0f} nats of evidence"


def _by_model(studied: Studied, reference: Mapping[str, Any]) -> dict[str, float]:
    """Held-out rms of the models' letters, ours and others'; of the kinds of compliance that of the last."""
    ours = {step.model[0]: rms(step.held_out_mm) for step in studied.steps}
    stated = reference.get(studied.series.label, {})
    result = {f"held_out_{model}_rms_mm": ours.get(model, np.nan) for model in MODELS}
    return result | {f"reference_{model}_rms_mm": float(stated.get(model, np.nan)) for model in MODELS}


def predicted_share(studied: Studied) -> float:
    """Share of the mean square of the calibrated model's misses that the causes take off, by folds of training rows."""
    if studied.diagnosis is None:
        return np.nan
    inference = studied.diagnosis.inference
    hypothesis, level = inference.hypothesis, inference.level
    at = counted(studied.case)
    misses = [
        (inference.held_out.predict(terms, strengths, level, uncertain=False).residual_mm[at] ** 2).sum(axis=1).mean()
        for terms, strengths in (((), ()), (hypothesis.terms, hypothesis.strengths[level]))
    ]
    return float(1.0 - misses[1] / misses[0])


def _steps(studied: Studied) -> pd.DataFrame:
    """Rows of `real_steps`: the plain models, and that of the verdict."""
    made = [*studied.steps]
    if studied.diagnosis:
        made.append(verdict_step(studied.case, studied.state, studied.seconds["gap"]))
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
    frame, case = studied.measurements, studied.case
    count = len(frame)
    bare, last = (
        np.linalg.norm(case.left(state)[:count], axis=1) for state in (studied.step("b").state, studied.state)
    )
    places = dict(zip(("x_mm", "y_mm", "z_mm"), rows.measured(frame).T, strict=True))
    empty = dict.fromkeys(("bare_x_mm", "bare_y_mm", "bare_z_mm"), np.nan)
    used = np.zeros(count, dtype=bool)
    used[case.at] = True
    return pd.DataFrame(
        {"row": studied.rows[PLACE], "reading": studied.rows["target"], **places, **empty}
        | {"bare_residual_mm": bare, "residual_mm": last, "used": used}
        | {"stands_out": (frame["status"] == "outlier").to_numpy()}
    )


def _spectrum(studied: Studied) -> pd.DataFrame:
    """Rows of `real_spectrum`, of the joints that turn."""
    case, robot = studied.case, studied.case.mechanism
    orders, parts = np.arange(1, _SHOWN + 1), []
    found = studied.state.effects.get(_FUNCTION)
    before, after = (amplitudes(case, state, orders) for state in (studied.step("b").state, studied.state))
    for number, (drive, unit) in enumerate(zip(robot.parts.drives, robot.parts.units, strict=True)):
        if unit != "rad":
            continue
        sine, cosine, error = np.zeros((3, len(orders)))
        if found is not None and studied.diagnosis:
            errors = studied.diagnosis.tables["gap_parameters"]
            errors = errors.loc[errors["effect"] == _FUNCTION[0], "standard_error"].to_numpy()
            shape = len(robot.parts.drives), -1, 2
            own = np.reshape(found, shape)[number, : len(orders)]
            error[: len(own)] = np.reshape(errors, shape)[number, : len(orders)].mean(axis=1)
            sine[: len(own)], cosine[: len(own)] = own.T
        reach = float(np.ptp(case.motion.drive[case.used][:, number]))
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
