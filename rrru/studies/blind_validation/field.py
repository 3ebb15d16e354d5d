"""Campaigns of another simulator with answers from the user, scored like the check's own robots."""

import numpy as np
import pandas as pd

from rrru.effects.library import NAMES
from rrru.errors import ConfigError
from rrru.studies.blind_validation.states import VERDICT
from rrru.studies.blind_validation.verdicts import in_order, is_outside, is_right, scores


def field_verdicts(verdicts):
    """Rows of `withheld_verdicts` from those of `gap_verdicts`."""
    return verdicts[VERDICT].assign(check="field", robot=verdicts["campaign"], kind="file")


def score_field(verdicts, answers):
    """Frame `withheld_scores` from `field_verdicts` and the user's answers (campaign, effects, leg)."""
    truth = answers.assign(effects=answers["effects"].map(in_order))
    truth = truth.rename(columns={"campaign": "robot", "effects": "truth", "leg": "truth_leg"})
    strength = verdicts["gap_rms_mm"] / verdicts["noise_rms_mm"]
    joined = verdicts.assign(strength=strength, oracle_detects=False, share_closed_true=np.nan).merge(truth, on="robot")
    joined = joined.assign(file="", cause=joined["truth"], numbers=0, held=0)
    right = [is_right(*pair, "field") for pair in zip(joined["truth"], joined["effects"], strict=True)]
    return scores(joined.assign(right=right))


def read_field_answers(path):
    """The user's answers: a CSV file with the columns campaign, effects (joined by +), leg (0 for none or all)."""
    answers = pd.read_csv(path, dtype={"campaign": str, "effects": str}, keep_default_na=False)
    missing = {"campaign", "effects", "leg"} - set(answers.columns)
    if missing:
        raise ConfigError(f"withheld.field_answers: {path} lacks the columns {', '.join(sorted(missing))}")
    for row, effects in zip(answers["campaign"], answers["effects"], strict=True):
        for name in effects.split("+"):
            if name not in (*NAMES, "none") and not is_outside(name):
                known = f"none, outside, {', '.join(NAMES)}"
                raise ConfigError(f"withheld.field_answers: campaign {row} has the effect {name!r}; known: {known}")
    for row, leg in zip(answers["campaign"], answers["leg"].astype(str), strict=True):
        if leg.strip() not in ("", "0", "1", "2", "3"):
            allowed = "0 to 3, 0 or blank where no leg or all legs have it"
            raise ConfigError(f"withheld.field_answers: campaign {row} has the leg {leg!r}; allowed: {allowed}")
    return answers.assign(leg=[int(leg.strip() or 0) for leg in answers["leg"].astype(str)])
