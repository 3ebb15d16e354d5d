"""Whether a Claim is true: a function for every kind, from the Truth to True, False, or None where it cannot be stated.

A size that is said without an interval is true within 25 % of the truth, beside what the noise leaves open (three
standard errors) and the two digits that are printed. A number that is said with its standard error is true within three
of these; a stated 95 % interval where it holds the true number. Lengths mm, angles rad.
"""

import re

import numpy as np

from rrru.estimation.intervals import QUANTILE_95
from rrru.studies.blind_validation.sentences.claims import UNKNOWN

# of a size without an interval, of its mean square; of shares; standard errors
_NEAR, _NEAR_SHARE, _ERRORS = 0.55, 0.2, 3.0
# chi-square of a cause that nobody could see, and of one that anybody could
_HIDDEN, _SEEN = 10.0, 60.0
# gap over noise from which on a cause has to be named
STRONG = 1.5
_SURE = 0.9
# what a file's error may be of the estimate's, and a stated remainder of the true one
_AS_GOOD, _REMAINDER = 1.1, 0.1
# of a noise, and of angles that are read; how often a stated precision a place may be off
_NEAR_NOISE, _NEAR_TURN_RAD, _MOST_ERRORS = 0.15, 0.03, 3.0
# least share of the largest error about a place that is called the worst
_WORST = 0.5
# what errors of the links can make of a zero
_OF_LINKS = {"rad": 1e-3, "mm": 0.5}
# shares are printed to whole per cents
_PRINTED = 0.005
# a robot that errs by this share of the noise without a cause has errors that no model holds
_OWN = 0.3
# share of a file's rows that are no outliers
_MOST_LEFT = 0.95
_NEIGHBOURS = 10


def judge(claim, truth, facts):
    """True, False or None for a Claim on a page of facts; None, too, for a sentence of an unknown kind."""
    if claim.kind not in _JUDGES:
        return None
    found = _JUDGES[claim.kind](claim.stated, truth, facts)
    return None if found is None else bool(found)


def _sized(said, true, truth, count):
    """Whether a size is near the true one, as far as the noise of a count of points allows."""
    if not np.isfinite(true):
        return None
    spread = truth.noise_rms_mm**2 * np.sqrt(2.0 / (3.0 * count)) + 2.0 * truth.noise_rms_mm * true / np.sqrt(
        3.0 * count
    )
    return abs(float(said) ** 2 - true**2) <= _ERRORS * spread + _NEAR * true**2


def _verdict_right(facts, truth):
    """Whether the verdict names exactly what acts, None where nothing shows that does."""
    named = {one["name"] for one in facts["effects"]}
    if not named and not facts["unexplained"]:
        return _none(None, truth, facts)
    return named == set(truth.effects) and facts["unexplained"] == truth.outside


def _none(_stated, truth, _facts):
    """Nothing systematic is left that the data could show."""
    if not truth.acts or truth.chi2 < _HIDDEN:
        return True
    return False if truth.chi2 > _SEEN else None


def _verdict(_stated, truth, facts):
    """A cause of 1.5 times the noise or more is named exactly, and what the library lacks is called unexplained."""
    return _verdict_right(facts, truth) if truth.strength >= STRONG else None


def _no_false_name(stated, truth, _facts):
    """Nothing is named that does not act."""
    return set(stated["names"]) <= set(truth.effects)


def _leg(stated, truth, _facts):
    """The leg or drive that is named is the one at which the cause acts."""
    if truth.strength < STRONG or set(stated["names"]) != set(truth.effects) or not truth.effects:
        return None
    if truth.leg:
        return stated["leg"] == truth.leg
    # of causes at several drives one may make all that shows
    return None if stated["leg"] else True


def _cause(stated, truth, _facts):
    """The effect that is named acts."""
    return stated["name"].replace(" ", "_") in truth.effects


def _one_of(names, truth):
    """At least one of some names, as words, acts."""
    return any(name.replace(" ", "_") in truth.effects for name in names)


def _group(stated, truth, _facts):
    """One of the causes of a group acts."""
    return _one_of(re.findall(r"([a-z ]+?) (?:more than |less than )?[\d.]+(?:, |$)", stated["listed"]), truth)


def _by_its_share(stated, truth, _facts):
    """A cause of the line of all causes acts, or one of its group."""
    return _one_of(stated["name"].split(" or "), truth)


def _probability_of_cause(stated, truth, _facts):
    """A cause that is said to be as good as certain acts; a smaller probability claims nothing."""
    sure = stated["probability"].startswith("more") or float(stated["probability"].split()[-1]) >= _SURE
    return _one_of([stated["name"]], truth) if sure else None


def _place(stated, truth, facts):
    """It acts where the sentence says."""
    name = stated["name"].replace(" ", "_")
    if name not in truth.effects or not truth.leg:
        return False if name not in truth.effects else None
    sites = [*truth.zeros]
    return stated["place"].strip() in (f"at {sites[truth.leg - 1]}", f"in leg {truth.leg}")


def _share_of_cause(stated, truth, _facts):
    """The effect makes that share of the gap at points that were left out."""
    if stated["name"].replace(" ", "_") not in truth.effects:
        return False
    return abs(float(stated["share"]) / 100.0 - truth.share) <= _NEAR_SHARE


def _size_of_cause(stated, truth, _facts):
    """A number of a cause: within three standard errors by the width of its interval."""
    true = truth.numbers.get(stated["effect"].replace(" ", "_"), {}).get(stated["parameter"])
    if true is None:
        return False if stated["effect"].replace(" ", "_") not in truth.effects else None
    off = float(stated["value"]) - true
    if stated["parameter"].startswith("phase"):
        off = (off + np.pi) % (2.0 * np.pi) - np.pi
    return abs(off) <= _ERRORS * _error(stated["low_95"], stated["high_95"])


def _error(low, high):
    """The standard error of a normal distribution with an interval of 95 %."""
    return (float(high) - float(low)) / (2.0 * QUANTILE_95)


def _misfit(_stated, _truth, _facts):
    """These files and robots belong together."""
    return False


def _shares_undetermined(_stated, truth, _facts):
    """The gap is small beside the noise."""
    return truth.before_mm < truth.noise_rms_mm


def _unexplained(_stated, truth, _facts):
    """Something acts that the library does not hold."""
    return truth.outside


def _probability(_stated, truth, facts):
    """A probability of 0.9 or more stands by a right answer; a smaller one claims nothing."""
    return _verdict_right(facts, truth) if facts["probability"] >= _SURE else None


def _scatter(stated, _truth, _facts):
    """These robots repeat, so that nothing does not."""
    return stated.get("share") == "0"


def _rival(stated, truth, _facts):
    """What cannot be ruled out acts; that nothing does can be where the gap is plain."""
    if stated["name"].replace(" ", "_") in truth.effects or (stated["name"].startswith("something") and truth.outside):
        return True
    if stated["name"] == "that nothing acts":
        return truth.chi2 <= _SEEN
    return None


def _next_nothing(_stated, truth, facts):
    """No more is needed where the answer is right."""
    return _verdict_right(facts, truth)


def _zero(stated, truth, _facts):
    """The zero of a drive, or with it the part that it moves, is off by that."""
    if stated["site"] not in truth.zeros:
        return None
    scale = np.degrees(1.0) if stated["unit"] == "degrees" else 1.0
    true = truth.zeros[stated["site"]], truth.geometry.get(f"d{stated['site']}", np.inf)
    off = min(abs(float(stated["value"]) - scale * one) for one in true)
    links = scale * _OF_LINKS[{"degrees": "rad"}.get(stated["unit"], "mm")]
    return off <= _ERRORS * _error(stated["low"], stated["high"]) + links


def _zeros_lost(stated, truth, _facts):
    """The largest zero that reading the file found, before anything was fitted: within half of it."""
    if stated["site"] not in truth.zeros:
        return None
    scale = np.degrees(1.0) if stated["unit"] == "degrees" else 1.0
    true = scale * truth.zeros[stated["site"]]
    return abs(float(stated["value"]) - true) <= 0.5 * abs(true)


def _weight(_stated, _truth, _facts):
    """These robots stand upright and carry what the file says."""
    return False


def _points(stated, truth, _facts):
    """The file has so many rows."""
    return int(stated["rows"]) in (truth.rows, truth.stops) and int(stated["used"]) <= int(stated["rows"])


def _few(stated, truth, _facts):
    """So many numbers were read: three of a position, six of a pose."""
    return int(stated["numbers"]) <= truth.rows * (6 if truth.turned else 3)


def _noise_larger(_stated, truth, _facts):
    """The noise is as stated: only what no model holds, as of MuJoCo's servos, makes it look larger."""
    return truth.outside or truth.still_mm > _OWN * truth.noise_rms_mm


def _unmeasured_again(_stated, truth, _facts):
    """No pose was measured twice."""
    return not truth.again


def _needs(stated, _truth, _facts):
    """The file has times, payloads and drive values, and neither speeds nor temperatures."""
    return not {"time_s", "payload_kg", "drive_load"} & set(stated["needs"].split(", "))


def _needs_different(stated, truth, _facts):
    """Payloads are all alike; times and drive values differ."""
    needs = set(stated["needs"].split(", "))
    return False if "time_s" in needs else truth.payloads == 1 if "payload_kg" in needs else None


def _absorbed(stated, truth, _facts):
    """The calibration takes up an effect entirely: it is not the one that acts and shows."""
    return not (stated["name"] in truth.effects and truth.chi2 > _SEEN)


def _file_leaves(stated, truth, _facts):
    """The corrected file's error at the readings within a tenth."""
    return _within(stated["value"], truth.file_read_mm)


def _within(said, true_mm):
    """Whether an rms is the true one within a tenth."""
    return abs(float(said) / true_mm - 1.0) <= _REMAINDER if np.isfinite(true_mm) else None


def _file_worse(stated, truth, _facts):
    """What the given file misses by."""
    return _within(stated["other"], truth.given_read_mm)


def _lost(stated, _truth, facts):
    """What the file cannot hold has been found at all."""
    names = {one["name"] for one in facts["effects"]} | ({"unexplained"} if facts["unexplained"] else set())
    return stated["name"] in names


def _lost_kind(name):
    """Whether a found effect is what the file cannot hold of drives."""
    return lambda _stated, _truth, facts: name in {one["name"] for one in facts["effects"]}


def _noise(stated, truth, _facts):
    """The measuring noise."""
    return abs(float(stated["value"]) / truth.noise_rms_mm - 1.0) <= _NEAR_NOISE + 1.5 / np.sqrt(truth.rows)


def _worst(stated, truth, _facts):
    """The errors about the place are among the largest, where there is a gap."""
    if truth.seen_mm < truth.noise_rms_mm:
        return None
    squares = (truth.error_mm**2).sum(axis=1)

    def about(point):
        near = np.argsort(np.linalg.norm(truth.position_mm - point, axis=1))[:_NEIGHBOURS]
        return squares[near].mean()

    return about(np.array(stated["at"])) >= _WORST * max(about(point) for point in truth.position_mm)


def _holds(ends, true, digit=0.0):
    """Whether an interval holds a number, its ends good to a digit."""
    return None if true is None or not np.isfinite(true) else ends[0] - digit <= true <= ends[1] + digit


def _closed(stated, truth, _facts):
    """Interval of the share that the verdict's effects close of the gap at fresh stops."""
    return _holds(stated["ends"], 1.0 - truth.after_mm / truth.before_mm, _PRINTED) if truth.before_mm else None


def _budget(stated, truth, _facts):
    """Interval of a part's share of the gap: what does not act has none."""
    part = stated["part"]
    if stated["kind"] == "effect":
        if part not in truth.effects:
            return stated["ends"][0] <= _PRINTED
        return _holds(stated["ends"], truth.share, _PRINTED)
    if stated["kind"] == "unexplained":
        return stated["ends"][1] > 0.0 if truth.outside else stated["ends"][0] <= _PRINTED
    return stated["ends"][0] <= _PRINTED


def _number(stated, truth, _facts):
    """Interval of a number of the calibration, of a cause or of the weight."""
    if stated["effect"] == "calibration":
        return _holds(stated["ends"], truth.geometry.get(stated["parameter"]))
    if stated["effect"] == "weight":
        return _holds(stated["ends"], 0.0)
    if stated["effect"] not in truth.effects:
        # that it does not act is counted with its name
        return None
    true = truth.numbers[stated["effect"]].get(stated["parameter"])
    if true is not None and stated["parameter"].startswith("phase"):
        middle = 0.5 * sum(stated["ends"])
        true = middle + (true - middle + np.pi) % (2.0 * np.pi) - np.pi
    return _holds(stated["ends"], true)


def _by_factor(stated, truth, _facts):
    """Interval of a direction's or a payload's share of the exact errors' mean square, where there is a gap."""
    if truth.seen_mm < truth.noise_rms_mm:
        return None
    squares = truth.error_mm**2
    if stated["factor"] == "direction":
        return _holds(stated["ends"], squares[:, "xyz".index(stated["level"])].sum() / squares.sum(), _PRINTED)
    chosen = truth.payload_kg == float(stated["level"].removesuffix(" kg"))
    return _holds(stated["ends"], squares[chosen].sum() / squares.sum(), _PRINTED)


def _as_good(_stated, truth, facts):
    """The corrected file misses by no more than a tenth beyond the estimate, or the page states what it misses by."""
    if not np.isfinite(truth.file_mm):
        return None
    if truth.file_mm <= _AS_GOOD * truth.after_mm:
        return True
    file = facts["corrected_file"]
    return bool(file and (file["remainder"] or file["headline"]))


def _not_worse(_stated, truth, _facts):
    """The corrected file misses by no more than the file as it came."""
    known = np.isfinite(truth.file_mm) and np.isfinite(truth.given_mm)
    return truth.file_mm <= truth.given_mm if known else None


def _drives(_stated, truth, _facts):
    """The robot stands where corrected_drives sends it, as near as the estimate is."""
    return _sized(truth.drives_mm, truth.after_mm, truth, truth.stops) if np.isfinite(truth.drives_mm) else None


def _detectable(stated, truth, facts):
    """An effect that is so much larger than what can be detected is named."""
    if stated["effect"] not in truth.effects or truth.strength * truth.noise_rms_mm < STRONG * stated["value"]:
        return None
    return stated["effect"] in {one["name"] for one in facts["effects"]}


def _reflector(stated, truth, _facts):
    """A reflector's place, as far as it is stated, within three times what it may be off by."""
    if stated["name"] not in truth.places:
        return None
    place = np.array(stated["place"].replace("?", "nan").split(", "), dtype=float)
    off = np.nan_to_num(place - truth.places[stated["name"]])
    return np.linalg.norm(off) <= _MOST_ERRORS * float(stated["about"])


def _outliers(_stated, _truth, _facts):
    """No reading of these files is spoilt."""
    return False


def _missing(stated, _truth, _facts):
    """The files have no such column."""
    return stated["column"] in ("run", "point", "speed_mm_s", "temperature_c")


def _registered(stated, truth, _facts):
    """So many points were read, but for a few outliers."""
    return _MOST_LEFT * truth.rows <= int(stated["points"]) <= truth.rows


def _overlap(_stated, _truth, facts):
    """The shares of the effects are more than the whole."""
    return sum(one["share"] or 0.0 for one in facts["effects"]) > 1.0


def _next_run(stated, truth, _facts):
    """The run that is advised is one of the campaign's path, or of poses; whether it decides is not tried here."""
    return stated["run"].startswith(("stops", "poses")) or bool(re.match(r"\d+ poses", stated["run"]))


def _next_inspection(stated, truth, _facts):
    """What acts is one of the causes that no run would decide between; nothing shows where it could not be seen."""
    words = re.sub(r"^(?:between|whether) | acts$", "", stated["contest"])
    if _one_of(re.split(r" and | \+ ", words), truth):
        return True
    return False if truth.outside or truth.chi2 > _SEEN else None


def _turned(stated, _truth, _facts):
    """The instrument's orientations are those of the platform, but for the robot's own errors."""
    return float(stated["value"]) <= _NEAR_TURN_RAD


def _undecided(_stated, _truth, _facts):
    """Says nothing that the truth could contradict."""
    return None


def _true(_stated, _truth, _facts):
    """So it is in every file here."""
    return True


_JUDGES = {
    "the robot still misses by": lambda stated, t, _: _sized(stated["value"], t.before_mm, t, t.rows),
    "nothing systematic is left": _none,
    "a cause with a share": _cause,
    "a cause with a size": _cause,
    "a cause without a share": _cause,
    "no cause is named": _misfit,
    "what to check": _misfit,
    "the corrected file is worse": lambda stated, t, _: t.file_mm > _AS_GOOD * t.after_mm,
    "shares are not determined": _shares_undetermined,
    "the effects are confounded": _undecided,
    "shares overlap": _overlap,
    "something is unexplained": _unexplained,
    "no cause is sure": _undecided,
    "the unexplained follows": _unexplained,
    "causes by share": _undecided,
    "a cause by its share": _by_its_share,
    "a group of causes": _group,
    "probability of a cause": _probability_of_cause,
    "probability of this answer": _probability,
    "it does not repeat": _scatter,
    "it is random error": _scatter,
    "what is left with it": lambda stated, t, _: _sized(stated["value"], t.after_mm, t, t.rows),
    "these data cannot rule out": _undecided,
    "next, a run": _next_run,
    "next, none is advised": _unexplained,
    "next, nothing more": _next_nothing,
    "next, nothing would decide": _next_inspection,
    "next, nothing would settle it": _undecided,
    "a zero is off": _zero,
    "a zero is confounded": _undecided,
    "a zero is not determined": _undecided,
    "a weight is confounded": _undecided,
    "without it a number would be off": lambda stated, t, _: stated["name"] in t.effects,
    "the mass is not as stated": _weight,
    "the base is tilted": _weight,
    "the fit did not converge": _undecided,
    "points used": _points,
    "few readings": _few,
    "fitted without some points": lambda stated, t, _: int(stated["lacking"]) < int(stated["used"]) <= t.rows,
    "the noise is larger": _noise_larger,
    "the noise is smaller": lambda *_: False,
    "repeatability is unknown": _unmeasured_again,
    "an effect needs what is not there": _needs,
    "an effect needs different values": _needs_different,
    "an effect is a calibration's number": lambda stated, t, _: stated["name"] not in t.effects,
    "an effect is absorbed": _absorbed,
    "an effect is not tested": _undecided,
    "runs are limited": _undecided,
    "the file leaves": _file_leaves,
    "the file would be worse": _file_worse,
    "the file is not corrected": _undecided,
    "how the file was driven": _undecided,
    "a part of a sentence": _undecided,
    "the file cannot hold play": _lost_kind("backlash"),
    "the file cannot hold compliance": _lost_kind("drive_compliance"),
    "the file cannot hold an effect": _lost,
    "no commanded positions": _true,
    "no such column": _missing,
    "registered": _registered,
    "a reflector was found": _reflector,
    "a reflector is assumed": _undecided,
    "orientations are turned": _turned,
    "zeros are lost": _zeros_lost,
    "far from ordinary errors": _outliers,
    "points are outliers": _outliers,
    "stale readings": _outliers,
    "undeclared columns": _outliers,
    "beyond a range": _outliers,
    "rows may be shifted": _outliers,
    "far from the commands": _outliers,
    "not this reflector": _outliers,
    "place of a cause": _place,
    "size of a cause": _size_of_cause,
    "share of a cause": _share_of_cause,
    "probability": _probability,
    "a rival": _rival,
    "the measuring noise": _noise,
    "verdict": _verdict,
    "names in the verdict": _no_false_name,
    "leg of the verdict": _leg,
    "gap_rms_mm": lambda stated, t, _: _sized(stated["value"], t.before_mm, t, t.rows),
    "noise_rms_mm": _noise,
    "worst place": _worst,
    "gap_after_rms_mm": lambda stated, t, _: _sized(stated["value"], t.after_mm, t, t.rows),
    "interval of share_closed": _closed,
    **{f"interval of a share: {kind}": _budget for kind in ("effect", "unexplained", "scatter", "runs")},
    **{f"interval of a share: {kind}": _undecided for kind in ("covariance", "sampling", "calibration")},
    "interval of a share: by direction": _by_factor,
    "interval of a share: by payload": _by_factor,
    **{f"interval of a number: {kind}": _number for kind in ("calibration", "cause", "weight")},
    "rms of the given_model": lambda stated, t, _: _within(stated["value"], t.given_read_mm),
    "rms of the corrected_model": lambda stated, t, _: _within(stated["value"], t.file_read_mm),
    "the corrected file is as good as the estimate": _as_good,
    "the corrected file is not worse than the given one": _not_worse,
    "corrected_drives bring it there": _drives,
    "detectable_mm": _detectable,
}
KINDS = (*_JUDGES, UNKNOWN)
