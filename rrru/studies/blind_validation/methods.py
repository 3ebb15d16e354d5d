"""Answers of the diagnosis and of other methods compared with the truth."""

import json

import numpy as np
import pandas as pd

from rrru.studies.blind_validation.summary import wilson
from rrru.studies.blind_validation.verdicts import UNEXPLAINED, is_outside, is_right

_NOTES = {
    "diagnosis": "",
    "bic": "linear signatures, up to two effects; cannot say unexplained",
    "lasso": "linear signatures, BIC, 50 resamplings of the points; cannot say unexplained",
    "spike_and_slab": "linear signatures, Gibbs sampler; cannot say unexplained",
    "gaussian_process": "of place, direction, time, speed, payload; names nothing",
}
_LEAST_PROBABILITY, _STRONG = 1e-3, 1.5


def compare(said, answers):
    """Frame `withheld_methods` from `withheld_beliefs` and `withheld_answers`."""
    joined = said.merge(answers, on="robot", validate="many_to_one")
    joined = joined.assign(**pd.DataFrame([_scored(row) for row in joined.to_dict("records")], index=joined.index))
    rows = []
    for method, answered in joined.groupby("method", sort=False):
        right = answered["right"].dropna()
        low, high = wilson(right.sum(), len(right))
        means = answered[["probability_true", "brier", "log_score", "seconds"]].mean()
        shares = {"right": right.mean(), "right_low": low, "right_high": high}
        closed = answered.loc[answered["strength"] >= _STRONG, "share_closed"].mean()
        rows.append({"method": method, "robots": len(answered), **shares, **means, "share_closed": closed})
    return pd.DataFrame(rows).assign(note=[_NOTES[row["method"]] for row in rows])


def _scored(row):
    """Scores of one method's answer on one robot; NaN where it names nothing."""
    if not row["effects"]:
        return dict.fromkeys(("right", "probability_true", "brier", "log_score"), np.nan)
    probabilities = json.loads(row["probabilities"])
    truth = UNEXPLAINED if is_outside(row["truth"]) else row["truth"]
    true = probabilities.get(truth, 0.0)
    return {
        "right": float(is_right(row["truth"], row["effects"], "label")),
        "probability_true": true,
        # G. W. Brier, Monthly Weather Review 78, 1950
        "brier": sum(p**2 for p in probabilities.values()) - 2.0 * true + 1.0,
        "log_score": np.log(max(true, _LEAST_PROBABILITY)),
    }
