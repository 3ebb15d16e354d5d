"""Whether a Claim is true: a function for every kind, from the Truth to True, False, or None where that is undecided.

A size without an interval is true if its square differs from the true one by at most 55 % (the size by -33 % to +24 %)
and three standard errors of the noise. The true size is that of a sample of fresh stops: a claim that it contradicts by
less than three of its own standard errors is undecided. A number with a standard error is true within three standard
errors. A 95 % interval is true where it contains the true number. Lengths mm, angles rad.
"""

import re

import numpy as np

from rrru.diagnosis.verdict import POSSIBLE
from rrru.estimation.intervals import QUANTILE_95
from rrru.studies.blind_validation.sentences.claims import PATTERNS, UNKNOWN

# relative tolerance of the square of a size; tolerance of a share; number of standard errors
_SQUARE_TOLERANCE, _SHARE_TOLERANCE, _STANDARD_ERRORS = 0.55, 0.2, 3.0
# chi-square below which a cause is not detectable, and above which it is always detectable
_UNDETECTABLE_CHI2, _DETECTABLE_CHI2 = 10.0, 60.0
# least gap over noise of a cause that has to be named
STRONG = 1.5
_MIN_SURE_PROBABILITY = 0.9
# largest error of a corrected file relative to that of the estimate; relative tolerance of a stated rms
_MAX_FILE_ERROR_RATIO, _RMS_TOLERANCE = 1.1, 0.1
# relative tolerance of a noise, tolerance of measured angles; largest error of a place over its stated precision
_NOISE_TOLERANCE, _ANGLE_TOLERANCE_RAD, _MAX_PLACE_ERRORS = 0.15, 0.03, 3.0
# least error about the stated worst place, over the largest local error
_MIN_WORST_RATIO = 0.5
# apparent zero offsets from errors of the links
_LINK_TOLERANCE = {"rad": 1e-3, "mm": 0.5}
# rounding of shares that are printed to whole per cents
_PRINTED_ROUNDING = 0.005
# residual over noise, without a cause, from which a robot has errors outside every model
_MIN_OUTSIDE_PER_NOISE = 0.3
# least share of a file's rows that are not outliers
_MIN_INLIER_SHARE = 0.95
_NEIGHBOURS = 10


def judge(claim, truth, facts):
    """True, False or None for a Claim on a page of facts; None where the truth neither confirms nor contradicts it."""
    if claim.kind in _OF_EVERY_FILE:
        return _OF_EVERY_FILE[claim.kind]
    if claim.kind not in _JUDGES:
        return None
    found = _JUDGES[claim.kind](claim.stated, truth, facts)
    return None if found is None else bool(found)


def _sized(claimed, true, truth, count, error_mm2=0.0):
    """Whether a size agrees with the true one within the tolerance for a count of points.

    error_mm2: standard error of the true mean square; None where that could make it agree.
    """
    if not np.isfinite(true):
        return None
    spread = truth.noise_rms_mm**2 * np.sqrt(2.0 / (3.0 * count)) + 2.0 * truth.noise_rms_mm * true / np.sqrt(
        3.0 * count
    )
    off = abs(float(claimed) ** 2 - true**2) - _STANDARD_ERRORS * spread - _SQUARE_TOLERANCE * true**2
    return True if off <= 0.0 else None if off <= _STANDARD_ERRORS * error_mm2 else False


def _verdict_right(facts, truth):
    """Whether the verdict names exactly the acting causes, None where a verdict none is undecided."""
    named = {one["name"] for one in facts["effects"]}
    if not named and not facts["unexplained"]:
        return _none(None, truth, facts)
    return named == set(truth.effects) and facts["unexplained"] == truth.outside


def _none(_stated, truth, _facts):
    """No systematic error is detectable in the data."""
    if not truth.acts or truth.chi2 < _UNDETECTABLE_CHI2:
        return True
    return False if truth.chi2 > _DETECTABLE_CHI2 else None


def _verdict(_stated, truth, facts):
    """A cause of 1.5 times the noise or more is named exactly, or called unexplained outside the library."""
    return _verdict_right(facts, truth) if truth.strength >= STRONG else None


def _leg(stated, truth, _facts):
    """The named leg or drive is the one at which the cause acts."""
    if truth.strength < STRONG or set(stated["names"]) != set(truth.effects) or not truth.effects:
        return None
    if truth.leg:
        return stated["leg"] == truth.leg
    # of causes at several drives, one may dominate
    return None if stated["leg"] else True


def _cause(stated, truth, _facts):
    """The named effect acts."""
    return stated["name"].replace(" ", "_") in truth.effects


def _one_of(names, truth):
    """At least one of some names, as words, acts."""
    return any(name.replace(" ", "_") in truth.effects for name in names)


def _group(stated, truth, _facts):
    """One of the causes of a group acts."""
    return _one_of(re.findall(r"([a-z ]+?) (?:more than |less than )?[\d.]+(?:, |$)", stated["listed"]), truth)


def _more(_stated, truth, facts):
    """Something else acts than the named causes and groups."""
    named = {one["name"] for one in facts["effects"] if one["decision"] != POSSIBLE}
    named |= {name for group in facts["groups"] for name in group["names"]}
    return truth.outside or not set(truth.effects) <= named


def _probability_of_cause(stated, truth, _facts):
    """A cause with a probability of 0.9 or more acts; a smaller probability is undecided."""
    sure = stated["probability"].startswith("more") or float(stated["probability"].split()[-1]) >= _MIN_SURE_PROBABILITY
    return _one_of([stated["name"]], truth) if sure else None


def _does_not_shrink(_stated, truth, facts):
    """The corrected model misses by as much as the calibration; undecided under an answer that is wrong itself."""
    if truth.after_mm >= truth.before_mm:
        return True
    return False if _verdict_right(facts, truth) else None


def _place(stated, truth, facts):
    """The cause acts at the stated place."""
    name = stated["name"].replace(" ", "_")
    if name not in truth.effects or not truth.leg:
        return False if name not in truth.effects else None
    sites = [*truth.zeros]
    # the name of its drive follows a leg where that has another number
    place = re.sub(r" \([^)]*\)$", "", stated["place"].strip())
    return place in (f"at {sites[truth.leg - 1]}", f"in leg {truth.leg}")


def _share_of_cause(stated, truth, _facts):
    """The effect has the stated share of the held-out gap."""
    if stated["name"].replace(" ", "_") not in truth.effects:
        return False
    return abs(float(stated["share"]) / 100.0 - truth.share) <= _SHARE_TOLERANCE


def _size_of_cause(stated, truth, _facts):
    """A number of a cause: within three standard errors by the width of its interval."""
    true = truth.numbers.get(stated["effect"].replace(" ", "_"), {}).get(stated["parameter"])
    if true is None:
        return False if stated["effect"].replace(" ", "_") not in truth.effects else None
    off = float(stated["value"]) - true
    if stated["parameter"].startswith("phase"):
        off = (off + np.pi) % (2.0 * np.pi) - np.pi
    return abs(off) <= _STANDARD_ERRORS * _error(stated["low_95"], stated["high_95"])


def _error(low, high):
    """The standard error of a normal distribution from its 95 % interval."""
    return (float(high) - float(low)) / (2.0 * QUANTILE_95)


def _unexplained(_stated, truth, _facts):
    """A cause outside the library acts."""
    return truth.outside


def _probability(_stated, truth, facts):
    """An answer with a probability of 0.9 or more is correct; a smaller probability is undecided."""
    return _verdict_right(facts, truth) if facts["probability"] >= _MIN_SURE_PROBABILITY else None


def _scatter(stated, _truth, _facts):
    """These robots repeat exactly, so that the stated share has to be zero."""
    return stated.get("share") == "0"


def _rival(stated, truth, _facts):
    """A cause that cannot be ruled out acts; no cause at all can be ruled out where the gap is clear."""
    if stated["name"].replace(" ", "_") in truth.effects or (stated["name"].startswith("something") and truth.outside):
        return True
    if stated["name"] == "that nothing acts":
        return truth.chi2 <= _DETECTABLE_CHI2
    return None


def _zero(stated, truth, _facts):
    """The stated zero offset of a drive, alone or together with the part that it moves."""
    if stated["site"] not in truth.zeros:
        return None
    scale = np.degrees(1.0) if stated["unit"] == "degrees" else 1.0
    true = truth.zeros[stated["site"]], truth.geometry.get(f"d{stated['site']}", np.inf)
    off = min(abs(float(stated["value"]) - scale * zero) for zero in true)
    links = scale * _LINK_TOLERANCE[{"degrees": "rad"}.get(stated["unit"], "mm")]
    return off <= _STANDARD_ERRORS * _error(stated["low"], stated["high"]) + links


def _zeros_lost(stated, truth, _facts):
    """The largest zero offset found from the file, before any fit: within half of the true value."""
    if stated["site"] not in truth.zeros:
        return None
    scale = np.degrees(1.0) if stated["unit"] == "degrees" else 1.0
    true = scale * truth.zeros[stated["site"]]
    return abs(float(stated["value"]) - true) <= 0.5 * abs(true)


def _points(stated, truth, _facts):
    """The file has the stated number of rows."""
    return int(stated["rows"]) in (truth.rows, truth.stops) and int(stated["used"]) <= int(stated["rows"])


def _few(stated, truth, _facts):
    """The stated number of readings: three for a position, six for a pose."""
    return int(stated["numbers"]) <= truth.rows * (6 if truth.turned else 3)


def _needs(stated, _truth, _facts):
    """The file has times, payloads and actuator positions, and neither speeds nor temperatures."""
    return not {"time_s", "payload_kg", "drive_load"} & set(stated["needs"].split(", "))


def _needs_different(stated, truth, _facts):
    """Payloads are all equal; times and actuator positions differ."""
    needs = set(stated["needs"].split(", "))
    return False if "time_s" in needs else truth.payloads == 1 if "payload_kg" in needs else None


def _within(claimed, true_mm):
    """Whether an rms agrees with the true one within a tenth."""
    return abs(float(claimed) / true_mm - 1.0) <= _RMS_TOLERANCE if np.isfinite(true_mm) else None


def _lost(stated, _truth, facts):
    """The effect that the file cannot represent is part of the verdict."""
    names = {one["name"] for one in facts["effects"]} | ({"unexplained"} if facts["unexplained"] else set())
    return stated["name"] in names


def _lost_kind(name):
    """A judge of whether an effect of the drives that the file cannot represent is part of the verdict."""
    return lambda _stated, _truth, facts: name in {one["name"] for one in facts["effects"]}


def _noise(stated, truth, _facts):
    """The measurement noise."""
    return abs(float(stated["value"]) / truth.noise_rms_mm - 1.0) <= _NOISE_TOLERANCE + 1.5 / np.sqrt(truth.rows)


def _worst(stated, truth, _facts):
    """The errors about the stated place are among the largest, where there is a gap."""
    if truth.seen_mm < truth.noise_rms_mm:
        return None
    squares = (truth.error_mm**2).sum(axis=1)

    def local_mean_square(point):
        near = np.argsort(np.linalg.norm(truth.position_mm - point, axis=1))[:_NEIGHBOURS]
        return squares[near].mean()

    largest = max(local_mean_square(point) for point in truth.position_mm)
    return local_mean_square(np.array(stated["at"])) >= _MIN_WORST_RATIO * largest


def _holds(ends, true, digit=0.0):
    """Whether an interval contains a number, with its ends rounded to a digit."""
    return None if true is None or not np.isfinite(true) else ends[0] - digit <= true <= ends[1] + digit


def _closed(stated, truth, _facts):
    """Interval of the fraction of the gap at fresh stops that the verdict's effects explain."""
    return (
        _holds(stated["ends"], 1.0 - (truth.after_mm / truth.before_mm) ** 2, _PRINTED_ROUNDING)
        if truth.before_mm
        else None
    )


def _budget(stated, truth, _facts):
    """Interval of a part's share of the gap; a part that does not act has the share zero."""
    part = stated["part"]
    if stated["kind"] == "effect":
        if part not in truth.effects:
            return stated["ends"][0] <= _PRINTED_ROUNDING
        return _holds(stated["ends"], truth.share, _PRINTED_ROUNDING)
    if stated["kind"] == "unexplained":
        return stated["ends"][1] > 0.0 if truth.outside else stated["ends"][0] <= _PRINTED_ROUNDING
    return stated["ends"][0] <= _PRINTED_ROUNDING


def _number(stated, truth, _facts):
    """Interval of a parameter of the calibration, of a cause, or of payload and tilt."""
    if stated["effect"] == "calibration":
        return _holds(stated["ends"], truth.geometry.get(stated["parameter"]))
    if stated["effect"] == "weight":
        return _holds(stated["ends"], 0.0)
    if stated["effect"] not in truth.effects:
        # that the effect does not act is counted with its name
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
        return _holds(stated["ends"], squares[:, "xyz".index(stated["level"])].sum() / squares.sum(), _PRINTED_ROUNDING)
    chosen = truth.payload_kg == float(stated["level"].removesuffix(" kg"))
    return _holds(stated["ends"], squares[chosen].sum() / squares.sum(), _PRINTED_ROUNDING)


def _as_good(_stated, truth, facts):
    """The error of the corrected file is at most a tenth above that of the estimate, or the page states it."""
    if not np.isfinite(truth.file_mm):
        return None
    if truth.file_mm <= _MAX_FILE_ERROR_RATIO * truth.after_mm:
        return True
    file = facts["corrected_file"]
    return bool(file and (file["remainder"] or file["headline"]))


def _expected(stated, truth, _facts):
    """The error of the corrected file at fresh stops."""
    return _sized(stated["value"], truth.file_mm, truth, truth.stops)


def _not_worse(_stated, truth, _facts):
    """The error of the corrected file is at most that of the given file."""
    known = np.isfinite(truth.file_mm) and np.isfinite(truth.given_mm)
    return truth.file_mm <= truth.given_mm if known else None


def _drives(_stated, truth, _facts):
    """The robot reaches the targets of corrected_drives with at most the error of the estimate."""
    if not np.isfinite(truth.drives_mm):
        return None
    return truth.drives_mm <= truth.after_mm or _sized(
        truth.drives_mm, truth.after_mm, truth, truth.stops, truth.after_error_mm2
    )


def _detectable(stated, truth, facts):
    """An effect of 1.5 times the detectable size or more is named."""
    if stated["effect"] not in truth.effects or truth.strength * truth.noise_rms_mm < STRONG * stated["value"]:
        return None
    return stated["effect"] in {one["name"] for one in facts["effects"]}


def _reflector(stated, truth, _facts):
    """A reflector's place, in the stated coordinates, within three times its stated precision."""
    if stated["name"] not in truth.places:
        return None
    place = np.array(stated["place"].replace("?", "nan").split(", "), dtype=float)
    off = np.nan_to_num(place - truth.places[stated["name"]])
    return np.linalg.norm(off) <= _MAX_PLACE_ERRORS * float(stated["about"])


def _missing(stated, _truth, _facts):
    """The files have no such column."""
    return stated["column"] in ("run", "point", "speed_mm_s", "temperature_c")


def _overlap(_stated, _truth, facts):
    """The shares of the effects sum to more than the whole."""
    return sum(one["share"] or 0.0 for one in facts["effects"]) > 1.0


def _next_run(stated, truth, _facts):
    """The advised run is on the campaign's path, or of poses; whether it decides is not tested here."""
    return stated["run"].startswith(("stops", "poses")) or bool(re.match(r"\d+ poses", stated["run"]))


def _next_inspection(stated, truth, facts):
    """An acting cause is among those that no run would decide between, or one of the two answers is the true one.

    Undecided where the cause is not detectable. The sentence has only what distinguishes the answers: "whether a acts"
    is open between b alone and a with b.
    """
    answers = [set(side.split("+")) - {"none"} for side in facts["undecided"]["separates"].split(" / ")]
    if truth.effects | ({"unexplained"} if truth.outside else set()) in answers:
        return True
    words = re.sub(r"^(?:between|whether) | acts$", "", stated["contest"])
    if _one_of(re.split(r" and | \+ ", words), truth):
        return True
    return False if truth.outside or truth.chi2 > _DETECTABLE_CHI2 else None


def _errors_outside_models(_stated, truth, _facts):
    """The robot has errors outside every model, such as those of MuJoCo's servos: only these make noise look larger."""
    return truth.outside or truth.still_mm > _MIN_OUTSIDE_PER_NOISE * truth.noise_rms_mm


def _turned(stated, _truth, _facts):
    """The instrument's orientations are those of the platform, except the robot's own errors."""
    return bool(np.radians(float(stated["value"])) <= _ANGLE_TOLERANCE_RAD)


_JUDGES = {
    "the robot still misses by": lambda stated, t, _: _sized(
        stated["value"], t.before_mm, t, t.rows, t.before_error_mm2
    ),
    "nothing systematic is left": _none,
    "a cause with a share": _cause,
    "a cause with a size": _cause,
    "a cause without a share": _cause,
    "the corrected file is worse": lambda stated, t, _: t.file_mm > _MAX_FILE_ERROR_RATIO * t.after_mm,
    "shares are not determined": lambda _, t, __: t.before_mm < t.noise_rms_mm,
    "a common share": lambda stated, t, _: all(_one_of([stated[name]], t) for name in ("first", "second")),
    "shares overlap": _overlap,
    "something is unexplained": _unexplained,
    "the unexplained follows": _unexplained,
    "a cause by its share": lambda stated, t, _: _one_of(stated["name"].split(" or "), t),
    "a group of causes": _group,
    "probability of a cause": _probability_of_cause,
    "a possible cause": lambda stated, t, f: _probability_of_cause(stated | {"probability": stated["acts"]}, t, f),
    "more acts": _more,
    "probability of this answer": _probability,
    "it does not repeat": _scatter,
    "it is random error or unexplained": lambda stated, t, facts: t.outside or _scatter(stated, t, facts),
    "it is random error": _scatter,
    "what is left with it": lambda stated, t, _: _sized(stated["value"], t.after_mm, t, t.rows, t.after_error_mm2),
    "that it shrinks cannot be seen": lambda _, t, __: t.before_mm < t.noise_rms_mm,
    "it does not shrink": _does_not_shrink,
    "next, a run": _next_run,
    "next, none is advised": _unexplained,
    "next, nothing more": lambda _, t, facts: _verdict_right(facts, t),
    "next, nothing would decide": _next_inspection,
    "a zero is off": _zero,
    "without it a number would be off": lambda stated, t, _: stated["name"] in t.effects,
    "points used": _points,
    "few readings": _few,
    "fitted without some points": lambda stated, t, _: int(stated["lacking"]) < int(stated["used"]) <= t.rows,
    "the noise is larger": _errors_outside_models,
    "no cause is found but an error": _errors_outside_models,
    "it looks random and repeats": _errors_outside_models,
    "it looks random and is correlated": _errors_outside_models,
    "successive residuals are correlated": _errors_outside_models,
    "repeatability is unknown": lambda _, t, __: not t.again,
    "repeatability is unsure": lambda _, t, __: t.again,
    "an effect needs what is not there": _needs,
    "an effect needs different values": _needs_different,
    "an effect is a calibration's number": lambda stated, t, _: stated["name"] not in t.effects,
    "an effect is absorbed": lambda stated, t, _: not (stated["name"] in t.effects and t.chi2 > _DETECTABLE_CHI2),
    "the file leaves": lambda stated, t, _: _within(stated["value"], t.file_read_mm),
    "the file would be worse": lambda stated, t, _: _within(stated["other"], t.given_read_mm),
    "the file cannot hold play": _lost_kind("backlash"),
    "the file cannot hold compliance": _lost_kind("drive_compliance"),
    "the file cannot hold an effect": _lost,
    "no such column": _missing,
    "registered": lambda stated, t, _: _MIN_INLIER_SHARE * t.rows <= int(stated["points"]) <= t.rows,
    "a reflector was found": _reflector,
    "orientations are turned": _turned,
    "zeros are lost": _zeros_lost,
    "place of a cause": _place,
    "size of a cause": _size_of_cause,
    "share of a cause": _share_of_cause,
    "probability": _probability,
    "a rival": _rival,
    "the measuring noise": _noise,
    "verdict": _verdict,
    "names in the verdict": lambda stated, t, _: set(stated["names"]) <= set(t.effects),
    "leg of the verdict": _leg,
    "gap_rms_mm": lambda stated, t, _: _sized(stated["value"], t.before_mm, t, t.rows, t.before_error_mm2),
    "noise_rms_mm": _noise,
    "worst place": _worst,
    "gap_after_rms_mm": lambda stated, t, _: _sized(stated["value"], t.after_mm, t, t.rows, t.after_error_mm2),
    "interval of share_closed": _closed,
    **{f"interval of a share: {kind}": _budget for kind in ("effect", "unexplained", "scatter", "runs")},
    "interval of a share: by direction": _by_factor,
    "interval of a share: by payload": _by_factor,
    **{f"interval of a number: {kind}": _number for kind in ("calibration", "cause", "weight")},
    "rms of the given_model": lambda stated, t, _: _within(stated["value"], t.given_read_mm),
    "rms of the corrected_model": lambda stated, t, _: _within(stated["value"], t.file_read_mm),
    "the corrected file is as good as the estimate": _as_good,
    "the corrected file is not worse than the given one": _not_worse,
    "error to expect of the corrected file": _expected,
    "corrected_drives bring it there": _drives,
    "detectable_mm": _detectable,
}
# what is true, or false, of every file here: readings are sound, and robots are upright and carry the stated mass
_OF_EVERY_FILE = {"no commanded positions": True, "the robot repeats": True} | dict.fromkeys(
    (
        "no cause is named",
        "what to check",
        "the payload is at a bound",
        "the mass is not as stated",
        "the base is tilted",
        "the noise is smaller",
        "a noise of zero was stated",
        "far from ordinary errors",
        "outliers are named",
        "points are outliers",
        "stale readings",
        "undeclared columns",
        "beyond a range",
        "rows may be shifted",
        "far from the commands",
        "not this reflector",
    ),
    False,
)
# parts of the budget whose shares the truth does not have
_NO_TRUE_SHARE = ("covariance", "sampling", "calibration")
KINDS = {*PATTERNS, *_JUDGES, *(f"interval of a share: {kind}" for kind in _NO_TRUE_SHARE), UNKNOWN}
