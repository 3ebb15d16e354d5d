"""The answer of a diagnosis for scripts: a mapping, which becomes `verdict.json`, with the sentences for people.

`rrru/pipeline/verdict.schema.yaml` is its schema. mm, rad; sizes are root mean squares of 3-D distances.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from rrru.diagnosis.aliases import Facts
from rrru.diagnosis.design.rival_answers import apart
from rrru.diagnosis.result_tables import acting_places
from rrru.diagnosis.verdict import NOT_TESTED
from rrru.diagnosis.verdict_text import sentences
from rrru.effects.causes import cause_texts
from rrru.robots.drive_words import DriveWords

SCHEMA = 1
# first words of the column not_in_model where no file was written
NOT_CORRECTED = "not corrected: "
_VERDICT = ("gap_rms_mm", "gap_after_rms_mm", "share_closed", "share_closed_low", "share_closed_high", "noise_rms_mm")
_NOISE = ("noise_stated_mm", "noise_correlation", "noise_runs_mm", "noise_from")
_PART = ("part", "kind", "rms_mm", "share", "share_low", "share_high", "probability")
_WORST = ("name", "unit", "drive_value", "error", "low_95", "high_95")
_NUMBER = ("parameter", "place", "unit", "value", "standard_error", "low_95", "high_95", "at_bound")
_ADVICE = ("inspect", "remedy", "source")
_FOLLOWS = ("follows", "explained", "scale", "unit", "rms_mm")
_RUN = ("run", "kind", "trajectory", "reverse", "speed_mm_s", "payload_kg", "points", "separates", "gain_nats")
_APART = ("none", "unexplained")
_WORDS = DriveWords()


def answer(
    campaign: str, verdict: Facts, tables: Mapping[str, pd.DataFrame], drives: DriveWords = _WORDS
) -> dict[str, Any]:
    """The facts of one campaign as a mapping, which `rrru.store.json_files` writes.

    verdict: the row of `gap_verdicts` as a mapping; tables: the frames of the other tables of the diagnosis by name;
    drives: the robot's DriveWords.
    """
    budget = [_row(part, _PART) for part in tables["gap_budget"].to_dict("records")]
    budget = [part | {"probability": _clipped(part["probability"])} for part in budget]
    names = [name for name in verdict["effects"].split("+") if name not in _APART]
    facts = {
        "schema": SCHEMA,
        "campaign": campaign,
        "effects": [_effect(name, tables, budget, drives) for name in names],
        "unnamed": [name for name in verdict["unnamed"].split("+") if name],
        "unexplained": "unexplained" in verdict["effects"].split("+"),
        "probability": _clipped(verdict["probability"]),
        "leg": verdict["leg"] or None,
        "where": verdict["where"],
        "confounded_with": [name for name in verdict["confounded_with"].split(", ") if name],
        "groups": [
            _group(names.split(" | "), tables, budget, drives) for names in verdict["groups"].split("; ") if names
        ],
        "searches_apart": verdict["searches_apart"],
        **_row(verdict, _VERDICT + _NOISE),
        "unexplained_follows": [_row(row, _FOLLOWS) for row in tables["gap_remainder"].to_dict("records")],
        "worst_mm": [verdict[f"worst_{axis}_mm"] for axis in "xyz"],
        "budget": budget,
        "next": [_row(run, _RUN) for run in tables["gap_next_runs"].to_dict("records")],
        "undecided": _undecided(verdict["undecided"], drives),
        **_row(verdict, ("points", "dropped_points")),
        "left_out": [_row(row, ("reason", "points")) for row in tables["gap_left_out"].to_dict("records")],
        "not_tested": _not_tested(tables["gap_attribute"]),
        "notes": [note for note in verdict["notes"].split("; ") if note],
        "no_answer": verdict["no_answer"],
        "corrected_file": _corrected_file(verdict),
    }
    return facts | {"sentences": sentences(facts)}


def _corrected_file(verdict: Facts) -> dict[str, Any] | None:
    """Residual errors of the robot's corrected file; None where the robot has no file."""
    known = np.isfinite(verdict["file_error_mm"])
    if not (known or verdict["not_in_model"]):
        return None
    return {
        **{key: verdict[f"file_{key}"] if known else None for key in ("error_mm", "error_fresh_mm")},
        "expected_mm": verdict["file_expected_mm"] if known else None,
        "remainder": verdict["file_remainder"],
        "headline": verdict["file_headline"],
        "not_in_model": [one for one in verdict["not_in_model"].split("; ") if one],
    }


def not_corrected(facts: Facts) -> str:
    """Why a robot's file was not corrected, from the facts of its campaign; empty where it was, or has no file."""
    file = facts.get("corrected_file")
    lacking = "; ".join(file["not_in_model"]) if file else ""
    return lacking if lacking.startswith(NOT_CORRECTED) else ""


def _row(values: Facts, names: Iterable[str]) -> dict[str, Any]:
    """Some entries of a mapping."""
    return {name: values[name] for name in names}


def _clipped(value: float) -> float:
    """A probability that is a sum without what rounding adds to 1; NaN stays."""
    return value if np.isnan(value) else min(value, 1.0)


def _effect(
    name: str, tables: Mapping[str, pd.DataFrame], budget: Sequence[Facts], drives: DriveWords
) -> dict[str, Any]:
    """Facts of one effect of the verdict."""
    share = next((part for part in budget if part["part"] == name and part["kind"] == "effect"), {})
    cause = tables["gap_attribute"].set_index("effect").loc[name]
    legs = cause["legs"] if isinstance(cause["legs"], str) else ""
    numbers = tables["gap_parameters"].query("effect == @name").to_dict("records")
    leg = _leg(legs)
    places = tables["gap_drive_functions"].query("effect == @name and worst")
    # of an effect of one leg its largest error is that of its drive
    places = places[places["drive"].isin(leg or places["drive"])]
    return {
        "name": name,
        **vars(cause_texts(name, drives, leg)),
        "probability": _clipped(cause["probability"]),
        "decision": cause["decision"],
        "legs": legs,
        "place": drives.place(*leg) if leg else _places(numbers),
        **{key: share.get(key) for key in ("rms_mm", "share", "share_low", "share_high")},
        "parameters": [_row(number, _NUMBER) for number in numbers],
        "worst_places": [_row(place, _WORST) for place in places.to_dict("records")],
    }


def _places(numbers: Sequence[Facts]) -> str:
    """Where an effect acts whose parameters, rows of `gap_parameters`, each belong to one of several legs or drives."""
    places = [place.partition(" ") for place in acting_places(numbers)]
    return f"{places[0][0]} {', '.join(name for _, _, name in places)}" if places else ""


def _group(
    names: list[str], tables: Mapping[str, pd.DataFrame], budget: Sequence[Facts], drives: DriveWords
) -> dict[str, Any]:
    """Facts of a group of confounded causes."""
    causes = tables["gap_attribute"].set_index("effect").loc[names]
    # they exclude each other, or nearly so
    parts = [part for part in budget if part["kind"] == "effect" and part["part"] in names]
    texts = [cause_texts(name, drives, _leg(legs)) for name, legs in zip(names, causes["legs"], strict=True)]
    return {
        "names": names,
        "causes": [{"name": name} | _row(vars(text), _ADVICE) for name, text in zip(names, texts, strict=True)],
        "probabilities": [_clipped(float(one)) for one in causes["probability"]],
        "probability": _clipped(float(causes["group_probability"].iloc[0])),
        "rms_mm": float(np.linalg.norm([part["rms_mm"] for part in parts])),
        "share": sum(part["share"] for part in parts),
    }


def _leg(legs: object) -> tuple[int, ...]:
    """The one leg of an effect's legs as a table has them, none for several."""
    return (int(legs),) if isinstance(legs, str) and legs.isdigit() else ()


def _not_tested(causes: pd.DataFrame) -> list[dict[str, str]]:
    """Effects that have no probability, with the reason, from rows of `gap_attribute`."""
    rows = causes[causes["decision"] == NOT_TESTED].to_dict("records")
    return [{"name": row["effect"], "reason": row["note"].removeprefix(f"{NOT_TESTED}: ")} for row in rows]


def _undecided(separates: str, drives: DriveWords) -> dict[str, Any] | None:
    """The two answers that no run decides between, and what to inspect instead of each cause; None where there are
    none.
    """
    if not separates:
        return None
    names = sorted(set().union(*apart(separates)))
    inspect = [{"name": name, "inspect": cause_texts(name, drives).inspect} for name in names]
    return {"separates": separates, "inspect": inspect}
