"""The statements of a page: every sentence and number as a Claim of a kind. Lengths mm, angles rad.

Each kind of sentence has a pattern; numbers come from the facts and tables. A sentence that fits no pattern is of the
kind UNKNOWN, so that none is missed.
"""

import re
from dataclasses import dataclass, field

import numpy as np

from rrru.diagnosis.verdict import GROUPED, POSSIBLE
from rrru.diagnosis.verdict_text import causes_in_words

UNKNOWN = "unknown kind"
_NUMBER = r"-?\d+\.?\d*(?:e[+-]?\d+)?"
_X = rf"(?P<value>{_NUMBER})"
_Y = rf"(?P<other>{_NUMBER})"
# a number with its unit, and its 95 % interval
_ENDS = r" \(95 %: [^)]*\)"
_SIZED = rf"{_X}(?: [^\s(]+)?(?P<ends>{_ENDS})"
# the corrected model: the causes that are named, and others
_MODEL = r"(?:(?:it|them)(?: and )?)?(?:possible further causes \([^)]*\))?"
_SHARE = rf"(?P<share>{_NUMBER}) %(?: of the gap)?(?:{_ENDS})?"
# text about a cause after its share or size
_CAUSE = (
    r"(?P<name>[a-z ]+?)(?P<place> (?:in leg \d+(?: \([^)]*\))?|at [^,:]+?))?"
    rf"(?P<sizes>, (?:\d+ numbers|[^,]+?{_ENDS}(?:, [^,]+?{_ENDS})*))?(?:: .*)?\."
)
_P = rf"(?P<probability>more than 0\.99|less than 0\.01|{_NUMBER})"


@dataclass(frozen=True)
class Claim:
    """kind; text: as on the page; stated: its values and names, by name of the group in the pattern."""

    kind: str
    text: str
    stated: dict = field(default_factory=dict)


_NOISE = rf"noise(?: that was found)? is {_Y} mm(?: \(stated: {_NUMBER} mm in space\))?"
# kinds of sentences of the answer
_SENTENCES = {
    "the robot still misses by": rf"After calibration the residual error is {_X} mm at points left out of it .*",
    "nothing systematic is left": rf"After calibration these data show no systematic error \(probability {_P}\): "
    rf"the residual error is {_X} mm, the (?:measuring )?{_NOISE}\.",
    "no cause is found but an error": rf"After calibration no cause is found \(probability {_P}\), but the model "
    rf"lacks an error: the residual error is {_X} mm, the {_NOISE}\.",
    "no cause is named": r"No cause is named: .*\.",
    "what to check": r"Next: check units, signs and order of the drives, .*",
    "the corrected file is worse": r"The corrected file has a residual error of .*",
    "a possible cause": rf"{_NUMBER} %{_ENDS} is possibly (?P<name>[a-z ]+) "
    rf"\(probability that it acts: (?P<acts>[^)]*)\)\. .*",
    "a possible cause of the answer": r"(?:.* is|Also there is) possibly .*",
    "a cause with a share": rf"{_SHARE} is {_CAUSE}",
    "a cause with a size": rf"{_X} mm is {_CAUSE}",
    "a cause without a share": rf"(?:Also there is|An undetermined share(?: of the gap)? is) {_CAUSE}",
    "shares are not determined": r"The gap is too small relative to the noise: their shares .*",
    "the effects are confounded": r"The effects are confounded with each other: their shares .*",
    "a common share": rf"Another {_NUMBER} % of the gap is made by (?P<first>[a-z ]+?) and (?P<second>[a-z ]+) "
    r"together, .*",
    "shares overlap": r"These shares add up to more than the gap.*",
    "something is unexplained": rf"(?:Another|It is systematic, and no effect .*:) "
    rf"(?:(?P<share>{_NUMBER}) %|(?:an )?undetermined share) .*"
    r"|It is systematic, and no effect of the library explains it at left-out points\.",
    "no cause is sure": r"No cause is probable enough to be named; .*",
    "more acts": r"More acts than the named causes, .*",
    "the unexplained follows": r"The unexplained part follows .*",
    "causes by share": r"Causes by their share of the gap: (?P<listed>.*)\.",
    "a group of causes": r"One of these acts, and these data cannot tell which: (?P<listed>.*) "
    rf"\(probability that one does: {_P}\).*",
    "probability of this answer": rf"(?:Probability that it acts: (?P<each>.*)\. )?Probability of (?:exactly )?"
    rf"(?:this answer|the causes of the corrected model)(?:, alone or with further causes)?: {_P}\.",
    "it does not repeat": rf"(?:{_SHARE}|An undetermined share|Some of it) does not repeat from pass to pass.*",
    "it is random error or unexplained": rf"(?:{_SHARE}|An undetermined share|Some of it) is random error above the "
    r"stated noise, or a part of what is unexplained\..*",
    "it is random error": rf"(?:{_SHARE}|An undetermined share|Some of it) is random error above the stated noise.*",
    "it looks random and is correlated": rf"(?:{_SHARE}|An undetermined share|Some of it) looks like random error, "
    "but .*",
    "it looks random and repeats": rf"(?:{_SHARE}|An undetermined share|Some of it) looks like random error\..*",
    "what is left with it": rf"With {_MODEL} in the simulator the residual error at left-out points is {_X} mm; "
    rf"the {_NOISE}\.",
    "that it shrinks cannot be seen": r"That it shrinks cannot be seen at these points: .*",
    "it does not shrink": r"At these points it is no smaller than without .*: another cause may act\.",
    "these data cannot rule out": r"(?:These data cannot rule out|Parts of the unexplained share could be): "
    r"(?P<names>.*)\.",
    "next, a run": r"Next: (?:drive|measure) (?P<run>.*)\. That (?:decides|would help to decide) "
    r"(?P<contest>.*)\.",
    "next, none is advised": r"Next: no run is advised.*",
    "next, nothing more": r"Next: nothing more needs to be measured for this answer\.",
    "next, nothing would decide": r"Next: nothing that can be simulated(?: within the limits)? would decide "
    r"(?P<contest>[^;]*); inspection would\. .*",
    "next, nothing would settle it": r"Next: no further run that was tried in computation would settle it\.",
}
# kinds of notes of the diagnosis and on what a corrected file cannot hold
_NOTES = {
    "a zero is off": rf"(?P<site>[^:]+): zero, or the part that it moves, is off by {_X} (?P<unit>degrees|mm) "
    rf"\(95 %: (?P<low>{_NUMBER}) to (?P<high>{_NUMBER})\)",
    "a zero is confounded": r"(?P<site>[^:]+): zero and .* are not separately identifiable, .*",
    "a zero is not determined": r"(?P<site>[^:]+): zero is not determined by the readings, .*",
    "without it a number would be off": rf"without (?P<name>\w+) (?P<parameter>\S+) would be off by {_X} .*",
    "the payload is at a bound": r"the fitted error of the (?:mass|tilt) .* is at its bound, .*",
    "the mass is not as stated": rf"the platform carries {_X} kg{_ENDS} more than stated, if .*",
    "the base is tilted": rf"the base is tilted by {_X} rad{_ENDS} about \w, the configuration assumes 0",
    "a weight is confounded": r"(?:a mass at the platform|a tilt of the base about \w) and a compliance are not .*",
    "the fit did not converge": r"the fit of .* did not converge.*",
    "points used": r"(?P<used>\d+) of (?P<rows>\d+) points used(?:, .*)?",
    "outliers are named": r"outliers to the diagnosis: .*",
    "few readings": r"few readings: (?P<numbers>\d+) numbers for (?P<parameters>\d+) parameters .*",
    "fitted without some points": r"(?P<names>[\w, ]+) fitted without (?P<lacking>\d+) of (?P<used>\d+) points, .*",
    "the noise is larger": rf"noise stated {_X} mm per axis, found {_Y}: the (?:robot|instrument is worse).*",
    "the noise is smaller": rf"noise stated {_X} mm per axis, found {_Y}: the instrument is better",
    "a noise of zero was stated": rf"noise_mm is 0, which no instrument reaches: the noise is estimated, {_X} mm .*",
    "repeatability is unknown": r"repeatability is unknown: no pose was measured twice",
    "repeatability is unsure": r"repeatability is unknown: too few poses were measured twice",
    "successive residuals are correlated": r"residuals of successive stops are correlated, so that .*",
    "the robot repeats": r"poses that were measured again agree better than the noise that was found",
    "masses are unknown": r"no masses of the links are stated: .*",
    "the mounting is assumed": r"gravity is assumed along -z of the robot's base: .*",
    "an effect needs what is not there": r"(?P<name>\w+) not tested: needs (?P<needs>[\w, ]+), which the columns .*",
    "an effect needs different values": r"(?P<name>\w+) not tested: needs (?P<needs>[\w, ]+) of more than one value",
    "an effect is a calibration's number": r"(?P<name>\w+) not tested: the calibration's own parameters absorb it",
    "an effect is absorbed": r"(?P<name>\w+) not tested: cannot be separated from the geometric .*",
    "an effect is not tested": r"(?P<name>\w+) not tested: .*",
    "runs are limited": r"no run with a payload is proposed, .*|runs are proposed within the limits .*",
    "the file leaves": rf"the corrected file leaves {_X} mm rms at the readings, the diagnosis {_Y} mm",
    "the file would be worse": rf"not corrected: its residual error would be {_X} mm rms, that of the file as it "
    rf"came is {_Y} mm",
    "the file is not corrected": r"not corrected: .*",
    "how the file was driven": r"corrected model not driven, but .*",
    "a part of a sentence": r"allowed: .*|corrected_drives holds all .*"
    r"|an effect is found .*|the others are .*",
    "the file cannot hold play": r"backlash of (?P<names>.*)",
    "the file cannot hold compliance": r"compliance of (?P<names>.*)",
    "the file cannot hold an effect": r"(?P<name>[a-z]+(?:_[a-z]+)*)",
}
# kinds of notes from reading the file
_READ = {
    "no commanded positions": r"no commanded positions: computed from .*",
    "no such column": r"no column (?P<column>\w+): .*",
    "registered": r"measured positions registered to the commanded ones at (?P<points>\d+) points: .*",
    "a reflector was found": r"reflector (?P<name>\w+) found at \((?P<place>[^)]*)\) mm on the platform, "
    r"to about (?P<about>\S+) mm(, its place along .* never turns)?",
    "a reflector is assumed": r"reflector (?P<name>\w+) assumed at \((?P<place>[^)]*)\) mm on the platform, "
    r"(the mean of all at the tool|the place that fits best with the robot's errors): "
    r"a platform that never turns does not determine it, state it in `targets`, .*",
    "orientations are turned": rf"orientations are read turned by {_X} degrees from the platform's",
    "zeros are lost": r"(zeros of|the zero of) (?P<count>\d+) drives? (are|is) lost, "
    rf"by {_X} (?P<unit>degrees|mm) at (?P<site>[^:]+): .*",
    "far from ordinary errors": rf"the nominal robot has an error of {_X} mm rms, {_Y} % of the robot's size of .*",
    "points are outliers": r"(?P<count>\d+) points? marked as outliers?, .*",
    "jumps are frequent": r"at least (?P<count>\d+) points jump off their neighbours, .*",
    "rows without a pose": r"left out, since the nominal robot has no pose .*",
    "stale readings": r"(?P<count>\d+) stale readings, .*",
    "undeclared columns": r"undeclared columns left out: (?P<names>.*)",
    "beyond a range": r"(?P<count>\d+) of (?P<rows>\d+) points are outside of the range of .*",
    "rows may be shifted": r".*: the rows may be shifted",
    "far from the commands": r"measured positions are .* from the commanded ones in the median: .*",
    "not this reflector": r"run \S+ point \S+: .*",
}
PATTERNS = _SENTENCES | _NOTES | _READ


def claims(page):
    """Every Claim of a Page."""
    facts, result = page.facts, []
    for text in facts["sentences"]:
        result += [*_of_text(text, _SENTENCES), *_sizes_in(text, facts)]
    for text in [*facts["notes"], *page.not_in_model]:
        result += _of_text(text, _NOTES)
    for text in page.read:
        result += _of_text(text, _READ)
    return [*result, *_of_facts(facts), *_of_tables(page.tables)]


def _of_text(text, patterns):
    """Claims of a sentence: the sentence itself, and one for every further number or name in it."""
    for kind, pattern in patterns.items():
        if found := re.fullmatch(pattern, text, re.DOTALL):
            stated = {name: value for name, value in found.groupdict().items() if value is not None}
            return [Claim(kind, text, stated), *_inside(text, stated)]
    return [Claim(UNKNOWN, text)]


def _inside(text, stated):
    """Claims of the numbers and names inside a sentence."""
    result = []
    if "place" in stated and "name" in stated and "," not in stated["place"]:
        result.append(Claim("place of a cause", text, stated))
    if "share" in stated and "name" in stated:
        result.append(Claim("share of a cause", text, stated))
    for match in re.finditer(rf"(?:^|, )(?P<name>[a-z ]+?) {_P}(?=,|$)", stated.get("each", "")):
        result.append(Claim("probability of a cause", text, match.groupdict()))
    if "listed" in stated and "share" in text.split(":")[0]:
        names = (
            re.sub(r"( less than)? \d+ %$| \(share not determined\)$", "", one) for one in stated["listed"].split(", ")
        )
        sure = [name for name in names if not (name[0].isdigit() or name.startswith("possibly "))]
        result += [Claim("a cause by its share", text, {"name": name}) for name in sure]
    if "probability" in stated:
        result.append(Claim("probability", text, stated))
    if "names" in stated and text.startswith(("These data", "Parts of")):
        result += [Claim("a rival", text, {"name": name}) for name in stated["names"].split(", ")]
    if "other" in stated and "noise is" in text:
        result.append(Claim("the measuring noise", text, {"value": stated["other"]}))
    return result


def _sizes_in(text, facts):
    """Claims of the parameter values of a cause in a sentence, taken from the facts because their units differ."""
    result = []
    for effect in facts["effects"]:
        if f" is {effect['name'].replace('_', ' ')}" not in text:
            continue
        for parameter in effect["parameters"]:
            if re.search(rf"\b{re.escape(parameter['parameter'])} = ", text):
                stated = {key: parameter[key] for key in ("parameter", "value", "low_95", "high_95")}
                result.append(Claim("size of a cause", text, stated | {"effect": effect["name"]}))
    return result


def _of_facts(facts):
    """Claims of the numbers of the verdict."""
    named = [one["name"] for one in facts["effects"]]
    # a group, of which the first is among the effects, is no name: its sentence is a claim of its own
    alone = [one["name"] for one in facts["effects"] if one["decision"] not in (GROUPED, POSSIBLE)]
    result = [
        Claim("verdict", _listed(facts), {"names": named, "unexplained": facts["unexplained"]}),
        Claim("names in the verdict", _listed(facts), {"names": alone}),
        Claim("leg of the verdict", f"leg {facts['leg']}: {_listed(facts)}", {"leg": facts["leg"], "names": named}),
        Claim("gap_rms_mm", f"{facts['gap_rms_mm']:.4g} mm", {"value": facts["gap_rms_mm"]}),
        Claim("noise_rms_mm", f"{facts['noise_rms_mm']:.4g} mm", {"value": facts["noise_rms_mm"]}),
        Claim("worst place", str(np.round(facts["worst_mm"], 1).tolist()), {"at": facts["worst_mm"]}),
    ]
    if named:
        after = facts["gap_after_rms_mm"]
        result.append(Claim("gap_after_rms_mm", f"{after:.4g} mm", {"value": after}))
        ends = facts["share_closed_low"], facts["share_closed_high"]
        result.append(Claim("interval of share_closed", f"{ends[0]:.3f} to {ends[1]:.3f}", {"ends": ends}))
    if (expected := (facts["corrected_file"] or {}).get("expected_mm")) is not None:
        result.append(Claim("error to expect of the corrected file", f"{expected:.4g} mm", {"value": expected}))
    for part in facts["budget"]:
        ends = part["share_low"], part["share_high"]
        stated = {"part": part["part"], "kind": part["kind"], "ends": ends}
        result.append(
            Claim(f"interval of a share: {part['kind']}", f"{part['part']}: {ends[0]:.3f} to {ends[1]:.3f}", stated)
        )
    return result


def _listed(facts):
    """The verdict in one line."""
    names = [words for words, _ in causes_in_words(facts)] + ["unexplained"] * facts["unexplained"]
    return f"{'+'.join(names).replace(' ', '_') or 'none'} ({facts['probability']:.3f})"


def _of_tables(tables):
    """Claims of the numbers in the tables."""
    result = []
    for row in tables["gap_parameters"].to_dict("records"):
        kind = {"calibration": "calibration", "weight": "weight"}.get(row["effect"], "cause")
        if np.isfinite(row["low_95"]) and np.isfinite(row["standard_error"] or np.nan):
            text = f"{row['effect']} {row['parameter']}: {row['low_95']:.6g} to {row['high_95']:.6g} {row['unit']}"
            stated = {"effect": row["effect"], "parameter": row["parameter"], "ends": (row["low_95"], row["high_95"])}
            result.append(Claim(f"interval of a number: {kind}", text, stated))
    for row in tables["gap_locate"].to_dict("records") if "gap_locate" in tables else ():
        if row["factor"] in ("direction", "payload"):
            text = f"{row['factor']} {row['level']}: {row['share_low']:.3f} to {row['share_high']:.3f}"
            stated = {"factor": row["factor"], "level": row["level"], "ends": (row["share_low"], row["share_high"])}
            result.append(Claim(f"interval of a share: by {row['factor']}", text, stated))
    for row in tables["gap_identifiability"].to_dict("records") if "gap_identifiability" in tables else ():
        if np.isfinite(row["detectable_mm"]):
            stated = {"effect": row["effect"], "value": row["detectable_mm"]}
            result.append(Claim("detectable_mm", f"{row['effect']}: {row['detectable_mm']:.4g} mm", stated))
    shrink = tables["gap_shrink"]
    for kind in ("given_model", "corrected_model"):
        overall = shrink[(shrink["kind"] == kind) & (shrink["trajectory"] == "*")]
        result += [Claim(f"rms of the {kind}", f"{value:.4g} mm", {"value": value}) for value in overall["rms_mm"]]
    if (shrink["kind"] == "corrected_model").any():
        result.append(Claim("the corrected file is as good as the estimate", "corrected file"))
        result.append(Claim("the corrected file is not worse than the given one", "corrected file"))
    if len(tables.get("corrected_drives", ())):
        result.append(Claim("corrected_drives bring it there", "corrected_drives"))
    return result
