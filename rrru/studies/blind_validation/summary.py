"""Summary statistics of the scores of the check on withheld effects, compared with the required values.

And the two comparisons that are scored likewise: other methods on the same robots, and campaigns of another simulator
with answers from the user.
"""

import json

import numpy as np
import pandas as pd

from rrru.effects.library import NAMES
from rrru.errors import ConfigError
from rrru.studies.blind_validation import parts as on_causes
from rrru.studies.blind_validation.chunks import noise_of
from rrru.studies.blind_validation.stated import VERDICT
from rrru.studies.blind_validation.verdicts import (
    AS_ROBOTS_ARE,
    PLANTS,
    UNEXPLAINED,
    in_order,
    is_outside,
    is_right,
    scores,
)

# least strength over the noise of a cause whose statement is counted
LEAST_STRENGTH = 0.5
# bins of a probability, of equal width
BIN_EDGES = np.arange(11) / 10.0
# least distance from 0 and 1 of the probabilities in a log loss
_LEAST_PROBABILITY = 0.001

# bins of a calibration error; with fewer robots per bin, sampling error exceeds the error of a probability
_BINS, _PER_BIN = 10, 20
_NEAR = 0.05
# allowed relative error of the found size of a part
_NEAR_PART = 0.25
_WITHIN = f"found within {100 * _NEAR_PART:g} %"
_PREDICTED = f"share closed predicted within {_NEAR:g}"
_SEEN = 1.5
_STRONG = f"acts == 'one' and strength >= {_SEEN}"
_NOT_STRONG = "acts == 'one' and strength < 1.5"
_WEAK = "acts == 'one' and 0.3 <= strength <= 1.0"
_WEAK_GROUP = "one effect, gap 0.3 to 1 x noise"
_ALL_ACTS = ("none", "one", "two", "outside")


# columns that `summary` reads of withheld_limits, withheld_parts and withheld_causes
LIMITS = ["check", "robot", "weakest", "confounded_share"]
PARTS = ["check", "robot", "part", "kind", "strength", "named"]
PARTS += ["true_rms_mm", "found_rms_mm", "found_low_mm", "found_high_mm"]
CAUSES = ["check", "robot", "effect", "probability", "decision", "group", "acts", "strength"]


def wilson(hits, count):
    """95 % interval of a share from hits out of a count (E. B. Wilson, JASA 22, 1927); NaN for none."""
    if not count:
        return np.nan, np.nan
    from scipy.stats import binomtest

    return tuple(binomtest(int(hits), int(count)).proportion_ci(method="wilson"))


def calibration_error(probability, right):
    """Expected calibration error of stated probabilities (n,) of correct answers (n,), in bins of equal counts."""
    if not len(right):
        return np.nan
    order = np.argsort(np.asarray(probability, dtype=float), kind="stable")
    stated, held = np.asarray(probability, dtype=float)[order], np.asarray(right, dtype=float)[order]
    bins = np.array_split(np.arange(len(order)), min(_BINS, max(len(order) // _PER_BIN, 1)))
    return float(sum(len(b) * abs(stated[b].mean() - held[b].mean()) for b in bins) / len(order))


_CALIBRATED = ("all", "expected calibration error", "", None, 0.05)
_HELD = ("numbers of causes named", "95 % intervals hold the true one", "numbers > 0 and right", "held", 0.9)
# per check: group, figure, query of its robots (all where empty), column of hits, required share or None
_LABEL = (
    ("one effect, gap >= 1.5 x noise", "named exactly", _STRONG, "right", 0.98),
    ("nothing acts", "false alarms", "acts == 'none'", "wrong", 0.01),
    ("outside the library, gap >= 2 x noise", "unexplained", "acts == 'outside' and strength >= 2", "right", 0.95),
    ("two effects", "both named exactly", "acts == 'two'", "right", 0.85),
    ("two effects, each >= 1 x noise", "both named exactly", "acts == 'two' and weakest >= 1", "right", None),
    ("two effects", "at least one named, nothing wrong", "acts == 'two'", "nothing_wrong", None),
    ("one leg at fault, gap >= 1.5 x noise", "leg named", f"{_STRONG} and truth_leg > 0", "leg_right", 0.95),
    (f"{_WEAK_GROUP}, oracle detects it", "named exactly", f"{_WEAK} and oracle_detects", "right", 0.9),
    (_WEAK_GROUP, "oracle detects it", _WEAK, "oracle_detects", None),
    (_WEAK_GROUP, "named exactly", _WEAK, "right", None),
    _CALIBRATED,
    ("one effect named, gap >= 1.5 x noise", _PREDICTED, f"{_STRONG} and right", "predicted", 0.9),
    _HELD,
)
_EFFECT = (
    ("all", "unexplained", "", "right", 0.95),
    ("others are confounded with less than 0.8 of the gap", "unexplained", "confounded_share < 0.8", "right", None),
    ("others are confounded with 0.8 of the gap or more", "unexplained", "not confounded_share < 0.8", "right", None),
    _CALIBRATED,
)
_NOISE = (
    ("nothing acts, any noise", "named or unexplained", "acts == 'none'", "wrong", 0.05),
    ("one effect, any noise", "named exactly", "acts == 'one'", "right", 0.92),
    _CALIBRATED,
)
_BACKGROUND = (
    ("nothing acts but axis errors", "answered none or joint_axis_error", "acts == 'none'", "right", 0.95),
    ("one effect and axis errors", "named exactly, with or without joint_axis_error", "acts == 'one'", "right", 0.92),
    _CALIBRATED,
)
_OUTSIDE = "acts == 'outside' and strength >= 2"
_FILE = (
    ("one cause, gap >= 1.5 x noise", "named exactly", _STRONG, "right", 0.95),
    ("nothing shows", "false alarms", "acts == 'none'", "wrong", 0.02),
    ("outside the library, gap >= 2 x noise", "unexplained", _OUTSIDE, "right", None),
    ("outside the library, gap >= 2 x noise", f"unexplained, or its part {_WITHIN}", _OUTSIDE, "sized", 0.9),
    ("one place at fault, gap >= 1.5 x noise", "place named", f"{_STRONG} and truth_leg > 0", "leg_right", None),
    ("one cause, gap below 1.5 x noise", "named exactly", _NOT_STRONG, "right", None),
    ("one cause, gap below 1.5 x noise", "oracle detects it", _NOT_STRONG, "oracle_detects", None),
    _CALIBRATED,
    ("one cause named, gap >= 1.5 x noise", _PREDICTED, f"{_STRONG} and right", "predicted", 0.9),
    _HELD,
)
_MANY = (("all", "what matters named, nothing that is not there", "", "right", None), _CALIBRATED)


def counted(causes):
    """The rows of `withheld_causes` whose statement is counted.

    The cause alone makes half of the noise or more, or does not act. No statement on a weaker acting cause is wrong.
    """
    return causes[~causes["acts"].astype(bool) | (causes["strength"] >= LEAST_STRENGTH)]


def bins(probability):
    """Number of the bin (n,) of probabilities (n,)."""
    return np.clip(np.digitize(probability, BIN_EDGES) - 1, 0, len(BIN_EDGES) - 2)


def causes_calibration_error(probability, acts):
    """Expected calibration error of probabilities (n,) of what acts (n,), NaN for no statement.

    It is the sum over bins of equal width of

        (n_b / n) |mean probability in the bin - share in the bin that acts|

    (M. Naeini, G. Cooper and M. Hauskrecht, AAAI 2015).
    """
    probability, acts = np.asarray(probability, dtype=float), np.asarray(acts, dtype=float)
    if not len(acts):
        return np.nan
    off = np.bincount(bins(probability), weights=probability - acts, minlength=len(BIN_EDGES) - 1)
    return float(np.abs(off).sum() / len(acts))


def brier_score(probability, acts):
    """Mean square difference of probabilities (n,) from 1 for what acts (n,) and 0 for what does not."""
    probability, acts = np.asarray(probability, dtype=float), np.asarray(acts, dtype=float)
    return float(((probability - acts) ** 2).mean()) if len(acts) else np.nan


def log_loss(probability, acts):
    """Mean negative natural logarithm of the probability (n,) of what is true, clipped to 0.001 to 0.999."""
    probability, acts = np.asarray(probability, dtype=float), np.asarray(acts, dtype=bool)
    clipped = np.clip(probability, _LEAST_PROBABILITY, 1.0 - _LEAST_PROBABILITY)
    return float(-np.log(np.where(acts, clipped, 1.0 - clipped)).mean()) if len(acts) else np.nan


# statements on single causes: figure, its function of probabilities and acting causes, required value of every check
_STATEMENTS = (
    ("expected calibration error", causes_calibration_error, 0.03),
    ("Brier score", brier_score, None),
    ("log loss", log_loss, None),
)
_COUNTED = f"causes of {LEAST_STRENGTH:g} x noise or more, or that do not act"
_LINES = "causes and groups named"
# how a cause is named: figure and column; `named`: among a verdict's effects, which hold the first member of a group
_NAMED, _IN_PAIR = ("named", "named"), ("named, or in a group of two", "in_pair")
_NAMES = (_NAMED, _IN_PAIR, ("named, or in a group", "in_group"), ("named alone, no group", "alone"))
_MAJOR = "causes in the library, 0.3 of the gap or more"
_LARGEST = "largest cause, where in the library"
_SIZED = "kind != 'outside' and strength >= 2"
_COVERED = f"{_WITHIN} or in its 95 % interval"
# on the parts of the robots' gaps
_PARTS = (
    *((_MAJOR, figure, "kind == 'effect' and share >= 0.3", column) for figure, column in _NAMES),
    *((_LARGEST, figure, "kind == 'effect' and largest", column) for figure, column in _NAMES),
    ("parts >= 2 x noise", _WITHIN, _SIZED, "near"),
    ("parts >= 2 x noise", _COVERED, _SIZED, "covered"),
    ("parts >= 2 x noise, nothing from outside", _WITHIN, f"{_SIZED} and not joined", "near"),
    ("parts >= 2 x noise, nothing from outside", _COVERED, f"{_SIZED} and not joined", "covered"),
    ("parts >= 2 x noise, a cause from outside", _WITHIN, f"{_SIZED} and joined", "near"),
    ("parts >= 2 x noise, a cause from outside", _COVERED, f"{_SIZED} and joined", "covered"),
    ("a cause from outside >= 2 x noise", "unexplained", "kind == 'unexplained' and strength >= 2", "named"),
    ("nothing from outside", "unexplained", "kind == 'unexplained' and strength == 0", "named"),
)
# required values of the check many, by group and figure
_ASKED_OF_MANY = {
    (_MAJOR, _NAMED[0]): 0.92,
    (_MAJOR, _IN_PAIR[0]): 0.96,
    (_LARGEST, _IN_PAIR[0]): 0.97,
    (_LINES, "not there"): 0.02,
    ("parts >= 2 x noise", _COVERED): 0.95,
    ("a cause from outside >= 2 x noise", "unexplained"): 0.92,
    ("nothing from outside", "unexplained"): 0.05,
}
_FIELD = (
    ("all", "named exactly", "", "right", None),
    ("one leg at fault", "leg named", "truth_leg > 0", "leg_right", None),
    *((f"truth: {acts}", "named exactly", f"acts == '{acts}'", "right", None) for acts in _ALL_ACTS),
    (*_CALIBRATED[:-1], None),
)
_CHECKS = {
    "label": _LABEL,
    "effect": _EFFECT,
    "noise": _NOISE,
    "many": _MANY,
    "background": _BACKGROUND,
    AS_ROBOTS_ARE: _MANY,
    **dict.fromkeys(PLANTS, _FILE),
    "field": _FIELD,
}


def summary(scores, limits, parts, causes):
    """Frame `withheld_summary` from `withheld_scores`, `withheld_limits`, `withheld_parts` and `withheld_causes`."""
    scores = scores.merge(limits[LIMITS], "left", ["check", "robot"])
    off = (scores["share_closed"] - scores["share_closed_true"]).abs()
    # robots whose unexplained part is found with a size near the true one
    sized = parts.loc[(parts["kind"] == "unexplained") & (parts["strength"] > 0.0) & _near(parts), "robot"]
    pairs = zip(scores["truth"], scores["verdict"], strict=True)
    scores = scores.assign(
        acts=scores["truth"].map(_acts),
        wrong=~scores["right"].astype(bool),
        nothing_wrong=[set(verdict.split("+")) <= set(truth.split("+")) for truth, verdict in pairs],
        predicted=(off <= _NEAR).astype(float).where(off.notna()),
        noise=scores["robot"].map(noise_of),
        sized=scores["right"] | scores["robot"].isin(sized),
    )
    rows = []
    for check, entries in _CHECKS.items():
        robots, listed, stated = (frame[frame["check"] == check] for frame in (scores, parts, causes))
        found = [_row(robots, *entry) for entry in (*entries, *_each(check, robots))] if len(robots) else []
        if len(robots) and len(listed):
            seen, asked = _seen(listed, robots, stated), _ASKED_OF_MANY if check == "many" else {}
            found += [_row(seen, *entry, asked.get(entry[:2])) for entry in _PARTS]
            found += _on_causes(stated, asked)
        rows += [row | {"check": check} for row in found]
    return pd.DataFrame(rows)


def _on_causes(causes, asked):
    """Rows on statements about single causes and on named causes and groups; asked: required values."""
    some, lines = counted(causes), on_causes.named_lines(causes)
    figures = [(name, score(some["probability"], some["acts"]), wanted) for name, score, wanted in _STATEMENTS]
    groups = lines[lines["size"] > 1]
    return [
        *(_plain(_COUNTED, name, len(some), value, wanted) for name, value, wanted in figures),
        _row(lines, _LINES, "not there", "", "invented", asked.get((_LINES, "not there"))),
        _plain("groups named", "mean number of members", len(groups), groups["size"].mean()),
    ]


def _near(parts):
    """Which parts are found with a size near the true one."""
    return (parts["found_rms_mm"] - parts["true_rms_mm"]).abs() <= _NEAR_PART * parts["true_rms_mm"]


def _each(check, robots):
    """The rows for single effects, noises, causes and files, see `_LABEL`."""
    if check == AS_ROBOTS_ARE:
        for file in sorted(robots["file"].unique()):
            yield file or "3-RRRU", _MANY[0][1], f"file == '{file}'", "right", None
    if check in PLANTS:
        for cause, with_cause in robots.groupby("cause"):
            which = f"cause == '{cause}'"
            yield cause, "right", which, "right", None
            if (with_cause["strength"] >= _SEEN).any():
                yield f"{cause}, gap >= 1.5 x noise", "right", f"{which} and strength >= {_SEEN}", "right", None
        for file in sorted(robots["file"].unique()):
            yield file, "right", f"file == '{file}'", "right", None
    if check == "label":
        for effect in sorted(robots.query("acts == 'one'")["truth"].unique()):
            which = f"truth == '{effect}'"
            yield f"{effect} alone, gap >= 1.5 x noise", "named exactly", f"{_STRONG} and {which}", "right", None
            yield f"{effect} alone", "named exactly", which, "right", None
    if check == "effect":
        for effect in sorted(robots["truth"].unique()):
            yield effect, "unexplained", f"truth == '{effect}'", "right", None
    if check == "noise":
        for noise in robots["noise"].unique():
            which = f"noise == '{noise}'"
            nothing, one = (f"acts == '{acts}' and {which}" for acts in ("none", "one"))
            yield f"nothing acts, {noise}", "named or unexplained", nothing, "wrong", 0.05
            yield f"one effect, {noise}", "named exactly", one, "right", 0.92


def _seen(parts, robots, causes):
    """Parts of robots' gaps with the columns that the summary counts."""
    parts = on_causes.with_decisions(parts, causes)
    whole = parts["robot"].map(robots.set_index("robot")["strength"])
    acting = parts[parts["kind"].isin(["effect", "outside"]) & (parts["strength"] > 0.0)]
    outside, near = parts.loc[parts["kind"] == "outside", "robot"], _near(parts)
    return parts.assign(
        share=parts["strength"] / whole,
        largest=parts.index.isin(acting.groupby("robot")["strength"].idxmax()),
        joined=parts["robot"].isin(outside),
        near=near,
        covered=near | parts["true_rms_mm"].between(parts["found_low_mm"], parts["found_high_mm"]),
    )


def _row(robots, group, counted, which, column, asked):
    """One row: the share of hits with its interval, or without a column the calibration error."""
    if which:
        robots = robots.query(which)
    if column is None:
        return _plain(group, counted, len(robots), calibration_error(robots["probability"], robots["right"]), asked)
    hits = robots[column].dropna().astype(float)
    # a robot has several numbers
    count = int(robots["numbers"].sum()) if column == "held" else len(hits)
    low, high = wilson(hits.sum(), count)
    return _plain(group, counted, count, hits.sum() / count if count else np.nan, asked) | {"low": low, "high": high}


def _plain(group, counted, count, value, asked=None):
    """One row of a figure that is not a share."""
    asked = np.nan if asked is None else asked
    row = {"group": group, "figure": counted, "robots": count, "value": float(value)}
    return row | {"low": np.nan, "high": np.nan, "asked": asked}


def _acts(truth):
    """Class of the truth: none, one, two or outside."""
    if is_outside(truth):
        return "outside"
    return "none" if truth == "none" else "two" if "+" in truth else "one"


def confusion(scores):
    """Frame `withheld_confusion`: robots by truth and verdict."""
    ordered = scores.assign(verdict=scores["verdict"].map(in_order))
    return ordered.groupby(["check", "truth", "verdict"]).size().rename("robots").reset_index()


_NOTES = {
    "diagnosis": "",
    "bic": "linear signatures, up to two effects; cannot say unexplained",
    "lasso": "linear signatures, BIC, 50 resamplings of the points; cannot say unexplained",
    "spike_and_slab": "linear signatures, Gibbs sampler; cannot say unexplained",
    "gaussian_process": "of place, direction, time, speed, payload; names nothing",
}


def compare_methods(said, answers):
    """Frame `withheld_methods` from `withheld_beliefs` and `withheld_answers`."""
    joined = said.merge(answers, on="robot", validate="many_to_one")
    joined = joined.assign(**pd.DataFrame([_scored(row) for row in joined.to_dict("records")], index=joined.index))
    rows = []
    for method, answered in joined.groupby("method", sort=False):
        right = answered["right"].dropna()
        low, high = wilson(right.sum(), len(right))
        means = answered[["probability_true", "brier", "log_score", "seconds"]].mean()
        shares = {"right": right.mean(), "right_low": low, "right_high": high}
        closed = answered.loc[answered["strength"] >= _SEEN, "share_closed"].mean()
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
