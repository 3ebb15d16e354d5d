"""Scoring verdicts of the gap diagnosis against the truth that was withheld from it. The only code that sees both.
Lengths mm, angles rad.
"""

import numpy as np
import pandas as pd

from rrru.effects.library import EFFECTS
from rrru.errors import ConfigError
from rrru.gap.case import State, make_case
from rrru.robots.dynamics import Masses
from rrru.studies.withheld.draw import fresh
from rrru.studies.withheld.oracle import limits, with_truth
from rrru.studies.withheld.outside import PREFIX
from rrru.studies.withheld.robots import NOISE_MM, Robot, simulate
from rrru.studies.withheld.states import state_of

UNEXPLAINED = "unexplained"


def is_right(truth, verdict, check):
    """Whether a verdict names the truth; where the library does not hold it, whether it says so."""
    said = set(verdict.split("+"))
    if check == "effect" or truth.startswith((PREFIX, UNEXPLAINED)):
        return UNEXPLAINED in said
    return said == set(truth.split("+"))


def true_share(robot, seed, calibrated, state, mechanism, library):
    """Share of the true gap that the corrected sim closes on runs that were never driven; NaN where there is none or a
    pose is lost.
    """
    driven = simulate(fresh(robot, seed, mechanism), mechanism, 0.0, np.random.default_rng(0)) if robot.acting else None
    if driven is None:
        return np.nan
    case = make_case(driven[0], mechanism, Masses(), NOISE_MM, library)
    before = case.measured_mm - case.model(State(calibrated, {}))
    after = case.measured_mm - case.model(state)
    return float(1.0 - np.sqrt((after**2).sum() / (before**2).sum()))


def score_chunk(check, seed, answers, measurements, verdicts, states, mechanism, library=EFFECTS):
    """Frames `withheld_scores` and `withheld_limits` of the robots of a chunk from the four frames about them.

    library: effects by name that the diagnosis knew.
    """
    verdicts, states = verdicts.set_index("robot"), states.set_index("robot")
    points = dict(list(measurements.groupby("robot", sort=False)))
    scores, yardsticks = [], []
    for answer in answers.to_dict("records"):
        name = answer["robot"]
        robot, verdict = Robot.from_json(answer["drawn"]), verdicts.loc[name]
        calibrated, state = state_of(states.loc[name])
        known = with_truth(library, robot.acting)
        case = make_case(points[name].reset_index(drop=True), mechanism, Masses(), NOISE_MM, known)
        names = [effect for effect in library if not (check == "effect" and effect == answer["truth"])]
        limit = limits(case, calibrated, robot.acting, names)
        share = true_share(robot, seed, calibrated, state, mechanism, library)
        scores.append(
            _score_row(check, answer, verdict) | {"oracle_detects": limit.detects, "share_closed_true": share}
        )
        yardsticks.append(
            {
                "check": check,
                "robot": name,
                "weakest": answer["weakest"],
                "oracle_chi2": limit.gain,
                "oracle_freedom": limit.freedom,
                "oracle_detects": limit.detects,
                "rival": limit.rival,
                "rival_chi2": limit.rival_chi2,
                "imitated_share": limit.imitated_share,
            }
        )
    return pd.DataFrame(scores), pd.DataFrame(yardsticks)


def score_field(verdicts, answers):
    """Frame `withheld_scores` of field campaigns: their rows of `gap_verdicts`, and the user's answers (campaign,
    effects, leg).
    """
    known = answers.set_index("campaign")
    rows = []
    for verdict in verdicts.to_dict("records"):
        if verdict["campaign"] not in known.index:
            continue
        answer = known.loc[verdict["campaign"]]
        strength = verdict["gap_rms_mm"] / verdict["noise_rms_mm"]
        told = {
            "robot": verdict["campaign"],
            "kind": "file",
            "truth": _in_order(answer["effects"]),
            "leg": int(answer["leg"]),
            "strength": strength,
        }
        rows.append(_score_row("field", told, verdict) | {"oracle_detects": False, "share_closed_true": np.nan})
    return pd.DataFrame(rows)


def read_field_answers(path):
    """The user's answers: a CSV file with the columns campaign, effects (joined by +), leg (0 for none or all)."""
    answers = pd.read_csv(path, dtype={"campaign": str, "effects": str}, keep_default_na=False)
    missing = {"campaign", "effects", "leg"} - set(answers.columns)
    if missing:
        raise ConfigError(f"withheld.field_answers: {path} lacks the columns {', '.join(sorted(missing))}")
    for row, effects in zip(answers["campaign"], answers["effects"], strict=True):
        for name in effects.split("+"):
            if name not in EFFECTS and name != "none" and not name.startswith((PREFIX, UNEXPLAINED)):
                raise ConfigError(
                    f"withheld.field_answers: campaign {row} has the effect {name!r}; known: none, outside, {', '.join(EFFECTS)}"
                )
    return answers.assign(leg=pd.to_numeric(answers["leg"], errors="coerce").fillna(0).astype(int))


def field_verdicts(verdicts):
    """Rows of `withheld_verdicts` from those of `gap_verdicts`."""
    columns = ["effects", "probability", "leg", "gap_rms_mm", "noise_rms_mm", "share_closed"]
    return verdicts[columns].assign(check="field", robot=verdicts["campaign"], kind="file")


def confusion(scores):
    """Frame `withheld_confusion`: robots by truth and verdict, most frequent truth's rows together."""
    counts = scores.assign(verdict=scores["verdict"].map(_in_order)).groupby(["check", "truth", "verdict"]).size()
    return counts.rename("robots").reset_index()


def _score_row(check, answer, verdict):
    """A verdict beside the truth, what is computed from the robot apart."""
    share = verdict["share_closed"]
    return {
        "check": check,
        "robot": answer["robot"],
        "kind": answer["kind"],
        "truth": answer["truth"],
        "truth_leg": int(answer["leg"]),
        "strength": float(answer["strength"]),
        "verdict": verdict["effects"],
        "right": is_right(answer["truth"], verdict["effects"], check),
        # a library without the effect cannot name its leg
        "leg_right": float(int(verdict["leg"]) == int(answer["leg"]))
        if answer["leg"] and check != "effect"
        else np.nan,
        "probability": float(verdict["probability"]),
        "share_closed": np.nan if verdict["effects"] in ("none", UNEXPLAINED) else float(share),
    }


def _in_order(effects):
    """Names joined by + in alphabetical order."""
    return "+".join(sorted(effects.split("+")))
