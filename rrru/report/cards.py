"""The answers on the first screen: one card per campaign, from its `verdict.json` and the facts of the campaign."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from rrru.diagnosis.number_text import is_determined, percent, readable, rounded, share_with_interval
from rrru.diagnosis.verdict import POSSIBLE
from rrru.diagnosis.verdict_facts import not_corrected
from rrru.diagnosis.verdict_text import causes_in_words, sure_in_words
from rrru.report import worth
from rrru.report.worth import Worth

# colours of the budget's parts: effects in the order of their share, then what is no effect
_EFFECTS = ("blue", "sky", "green", "pink", "yellow")
_OTHERS = {"unexplained": "vermilion", "scatter": "grey", "runs": "light"}
_WORDS = {
    "scatter": "does not repeat",
    "runs": "offsets between runs",
    "unexplained": "nothing in the library explains it",
}
_LEAST_SHARE = 0.005
# the content of a `verdict.json`, or a part of it; `rrru/pipeline/verdict.schema.yaml` has the keys
Facts: TypeAlias = Mapping[str, Any]
# no instrument resolves less
_LEAST_MM = 0.001
# said next to a corrected file where the instrument's frame was fitted to the commanded points
_REGISTERED = (
    "Its positions are in the robot's frame: transform readings of the instrument by the table registration before "
    "you compare them. These errors are those of the points that were read. Where the places of these on the platform "
    "were estimated, the tool and other points of the platform may be off by more."
)


@dataclass(frozen=True)
class Part:
    """A part of the budget: words, colour, share of the bar (%), and its share with its interval as text."""

    words: str
    colour: str
    width: float
    share: str


@dataclass(frozen=True)
class Step:
    """A bar of before and after: words, size as text, share of the longest bar (%), and its look."""

    words: str
    size: str
    width: float
    look: str


@dataclass(frozen=True)
class Advice:
    """What to inspect on the machine for one cause and what to do about it, with the source."""

    cause: str
    inspect: str
    remedy: str
    source: str


@dataclass(frozen=True)
class Card:
    """One campaign's answer: its source, the answer in a line, sizes in mm as text, the lead sentence, the others,
    Advice on each cause, the next step, notes, links to corrected files of the robot and to corrected drive values, the
    files' errors, and parts and steps of the bars.
    """

    campaign: str
    source: str
    short: str
    misses: str
    left: str
    noise: str
    lead: str
    sentences: list[str]
    advice: list[Advice]
    next: str
    notes: list[str]
    models: list[str]
    drives: str
    worth: list[str]
    parts: list[Part]
    steps: list[Step]


def card(
    facts: Facts, source: str = "", found: Worth | None = None, models: Sequence[str] = (), drives: str = ""
) -> Card:
    """The Card of facts; source: where the campaign came from; found: the Worth of its calibration, or None; models:
    links to corrected files of the robot; drives: the one to `corrected_drives`, empty without these.
    """
    lead, *others, following = facts["sentences"]
    if found is not None:
        others = [*others, *worth.sentences(found, facts["gap_rms_mm"])]
    return Card(
        facts["campaign"],
        source,
        _short(facts),
        rounded(facts["gap_rms_mm"]),
        rounded(facts["gap_after_rms_mm"]),
        rounded(facts["noise_rms_mm"]),
        lead,
        others,
        _advice(facts),
        following,
        facts["notes"],
        [] if not_corrected(facts) else list(models),
        "" if facts["no_answer"] else drives,
        _file_worth(facts, found is not None and found.registered),
        [] if facts["no_answer"] else _parts(facts["budget"]),
        _steps(facts),
    )


def _short(facts: Facts) -> str:
    """The answer in a line: causes with their shares, the probability, and the next run."""
    named = [(words, _known_share(part)) for words, part in causes_in_words(facts)]
    if facts["no_answer"]:
        return f"No cause is named: {facts['no_answer']}."
    if facts["unexplained"]:
        share = next(_known_share(part) for part in facts["budget"] if part["kind"] == "unexplained")
        named.append(("something unexplained", share))
    named.sort(key=lambda one: -(one[1] or 0.0))
    causes = ", ".join(words if share is None else f"{words} {percent(share)}" for words, share in named)
    following = f" Next: {facts['next'][0]['run']}." if facts["next"] else ""
    return f"{causes.capitalize() or 'Nothing to add'} ({sure_in_words(facts)}).{following}"


def _known_share(part: Facts) -> float | None:
    """The share of an effect, a group or a part of the budget, None where there is none or its interval says nothing.

    Groups have no interval.
    """
    known = part["share"] is not None and ("share_low" not in part or is_determined(part))
    return part["share"] if known else None


def _advice(facts: Facts) -> list[Advice]:
    """Advice on the named causes that are the library's, and on each cause of a group."""
    result = []
    for _, part in causes_in_words(facts):
        alone = "names" not in part
        for one in [part] if alone else part["causes"]:
            words = readable(one["name"]).capitalize()
            sure = alone and one["decision"] != POSSIBLE
            cause = f"{words} {one['place']}".strip() if sure else f"{words}, if it acts"
            result.append(Advice(cause, one["inspect"], one["remedy"], one["source"]))
    return [one for one in result if one.inspect]


def _file_worth(facts: Facts, registered: bool) -> list[str]:
    """Sentences on the errors of the corrected file, which are next to its link; registered: the instrument's frame."""
    if why := not_corrected(facts):
        return [f"Your robot's file was {why}."]
    if not (file := facts.get("corrected_file")):
        return []
    if file["error_mm"] is None:
        return []
    at_measured, at_fresh = (_file_error(file[key]) for key in ("error_mm", "error_fresh_mm"))
    fresh = f"{at_fresh} at 200 fresh ones" if at_fresh else "at the fresh ones it has no pose"
    said = f"It is {at_measured} rms off the diagnosed robot at the measured poses, {fresh}."
    after, both = (_file_error(size) for size in (facts["gap_after_rms_mm"], file["expected_mm"]))
    left_out = (
        f"That leaves out the error of the diagnosed robot itself, {after} at held-out points. With it {both} are to "
        "be expected at poses and loads like those measured; elsewhere the error may be larger."
    )
    result = [said, left_out, _REGISTERED] if registered else [said, left_out]
    return [*result, *([f"{file['remainder'][0].upper()}{file['remainder'][1:]}."] if file["remainder"] else [])]


def _file_error(size_mm: float | None) -> str:
    """A size in mm as text, empty where it is not known."""
    if size_mm is None:
        return ""
    return f"{rounded(size_mm) if size_mm >= _LEAST_MM else f'less than {_LEAST_MM}'} mm"


def _parts(budget: Sequence[Facts]) -> list[Part]:
    """Parts of the budget that add up, effects by share first."""
    shown = [part for part in budget if part["kind"] in ("effect", *_OTHERS) and part["share"] > _LEAST_SHARE]
    effects = sorted((p for p in shown if p["kind"] == "effect"), key=lambda part: -part["share"])
    others = [part for kind in _OTHERS for part in shown if part["kind"] == kind]
    whole = sum(part["share"] for part in shown) or 1.0
    return [
        Part(
            _WORDS.get(part["kind"], readable(part["part"])),
            _OTHERS.get(part["kind"], _EFFECTS[number % len(_EFFECTS)]),
            round(100.0 * part["share"] / whole, 2),
            share_with_interval(part) if is_determined(part) else "share not determined",
        )
        for number, part in enumerate([*effects, *others])
    ]


def _steps(facts: Facts) -> list[Step]:
    """The gap at left-out points before and after the effects are added, and the noise."""
    rows = [("calibrated", facts["gap_rms_mm"], "before")]
    if facts["effects"] or facts["unnamed"]:
        rows.append(("with the effects too", facts["gap_after_rms_mm"], "after"))
    rows.append(("measuring noise", facts["noise_rms_mm"], "noise"))
    longest = max(size for _, size, _ in rows) or 1.0
    return [Step(words, f"{rounded(size)} mm", round(100.0 * size / longest, 2), look) for words, size, look in rows]
