"""The answer of a diagnosis for people: sentences in plain words from the facts of `rrru.diagnosis.verdict_facts`.

mm, rad; sizes are root mean squares of 3-D distances.
"""

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from rrru.diagnosis.aliases import Facts
from rrru.diagnosis.design.rival_answers import apart
from rrru.diagnosis.design.run_limits import NO_PAYLOAD, WITHIN_LIMITS
from rrru.diagnosis.number_text import (
    capitalized,
    is_determined,
    percent,
    probability,
    readable,
    rounded,
    share_with_interval,
    small_percent,
    with_interval,
)
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.result_notes import (
    MASSES_UNKNOWN,
    REPEATABILITY_UNKNOWN,
    REPEATABILITY_UNSURE,
    ROBOT_REPEATS,
    SUCCESSIVE_ALIKE,
)
from rrru.diagnosis.result_tables import is_off_zero
from rrru.diagnosis.smooth_functions import JUMP
from rrru.diagnosis.verdict import POSSIBLE
from rrru.effects.protocol import is_per_load
from rrru.estimation.noise_model import CONTRADICTED

_OUTSIDE = {"none": "that nothing acts", "unexplained": "something that the library does not hold"}
_CHECK = (
    "Next: check units, signs and order of the drives, frame and places of targets, and whether the file is of this "
    "robot: `rrru check` names what reconciles them."
)
# units of sentences for those of tables, and the factor: without rows of zeros
_READABLE = {"1": ("", 1.0), "rad/(N mm)": ("µrad/(N m)", 1e9), "mm/(N mm)": ("µm/(N m)", 1e6)}
_READABLE |= {"mm/N": ("µm/N", 1e3), "1/K": ("µm/(m K)", 1e6), "mm/s": ("µm/s", 1e3), "rad/s": ("µrad/s", 1e6)}
_LIMITED = (NO_PAYLOAD, WITHIN_LIMITS)
_UNSURE = "No cause is probable enough to be named; the most probable answer follows."
_NOT_ALL = "More acts than the named causes, and no further one is probable enough; the most probable answer follows."
_NO_SIZE = "Its size is not determined, because no masses of the links are stated."
# what looks like random error above the stated noise, by the note on repeated poses; else it does not repeat
_ABOVE_NOISE = "is random error above the stated noise. Repeatability is unknown:"
_OR_UNEXPLAINED = _ABOVE_NOISE.replace(".", ", or a part of what is unexplained.", 1)
_RANDOM = {
    # the first one that applies
    SUCCESSIVE_ALIKE: "looks like random error, but residuals of successive stops are correlated: it is an error that "
    "the model lacks, and it follows the time or the path.",
    REPEATABILITY_UNKNOWN: f"{_ABOVE_NOISE} no pose was measured twice.",
    REPEATABILITY_UNSURE: f"{_ABOVE_NOISE} too few poses were measured twice.",
    ROBOT_REPEATS: "looks like random error. Poses that were measured again agree better: it is an error that the "
    "model lacks.",
}
# the notes on what is no random error
_NOT_RANDOM = (SUCCESSIVE_ALIKE, ROBOT_REPEATS)
_DOES_NOT_REPEAT = "does not repeat from pass to pass, in the robot or in the instrument: no model can correct it."


def sentences(facts: Facts) -> list[str]:
    """What the facts say, the headline first, for readers who know the robot and no statistics."""
    if facts["no_answer"]:
        return [_no_answer(facts), _CHECK]
    file = facts["corrected_file"] or {"headline": ""}
    said = [f"{file['headline'][0].upper()}{file['headline'][1:]}."] if file["headline"] else []
    said += [_missed(facts), *_causes(facts), *_scatter(facts)]
    said += _left(facts) if facts["effects"] or facts["unnamed"] else []
    return [*said, *_open(facts), *_next(facts)]


def causes_in_words(facts: Facts) -> list[tuple[str, Facts]]:
    """Each cause of the answer in words, with its share and size: an effect, or a group as "one or another"."""
    groups = {group["names"][0]: group for group in facts["groups"]}
    parts = [groups.get(effect["name"], effect) for effect in facts["effects"]]
    return [(" or ".join(map(readable, part["names"])) if "names" in part else _name(part), part) for part in parts]


def _name(effect: Facts) -> str:
    """The name of an effect of the answer, with "possibly" where it is not probable enough for a name."""
    return f"{'possibly ' if effect['decision'] == POSSIBLE else ''}{readable(effect['name'])}"


def sure_in_words(facts: Facts) -> str:
    """The probability of the answer in words: of a group alone that one of it acts, else of exactly its causes."""
    firsts = [readable(group["names"][0]) for group in facts["groups"]]
    if firsts and len(facts["effects"]) == 1 and not facts["unexplained"]:
        return f"probability {probability(facts['groups'][0]['probability'])}"
    of = f", of exactly this answer with {' and '.join(firsts)}," if firsts else ""
    return f"probability{of} {probability(facts['probability'])}"


def _no_answer(facts: Facts) -> str:
    """Why nothing is said of causes."""
    return f"No cause is named: {facts['no_answer']}."


def _missed(facts: Facts) -> str:
    """Residual error of the calibrated robot at points that its calibration has not used."""
    gap = rounded(facts["gap_rms_mm"])
    if facts["effects"] or facts["unexplained"]:
        return f"After calibration the residual error is {gap} mm at points left out of it (noise subtracted)."
    sure = probability(facts["probability"])
    if any(note in facts["notes"] for note in _NOT_RANDOM) and _scatter(facts):
        answer = f"no cause is found (probability {sure}), but the model lacks an error"
    else:
        answer = f"these data show no systematic error (probability {sure})"
    return f"After calibration {answer}: the residual error is {gap} mm, the {_noise(facts, 'measuring ')}."


def _noise(facts: Facts, kind: str = "") -> str:
    """The noise, "noise is 0.035 mm" with its kind before it, or both noises where it contradicts the stated one."""
    found, stated = facts["noise_rms_mm"], np.sqrt(3.0) * (facts["noise_stated_mm"] or np.nan)
    if found > CONTRADICTED * stated:
        return f"noise that was found is {rounded(found)} mm (stated: {rounded(stated)} mm in space)"
    return f"{kind}noise is {rounded(found)} mm"


def _causes(facts: Facts) -> list[str]:
    """The causes of the gap with their shares and probabilities."""
    with_shares = _shares_are_determined(facts)
    groups = {group["names"][0]: group for group in facts["groups"]}
    single = [effect for effect in facts["effects"] if effect["name"] not in groups]
    small = _small(facts, groups) if with_shares else set()
    said = [_by_share(facts, groups, small)] if with_shares and len(facts["effects"]) > 1 else []
    if unsure := sum(effect["decision"] == POSSIBLE for effect in single):
        said = [_UNSURE if unsure == len(facts["effects"]) else _NOT_ALL, *said]
    single = [effect for effect in single if effect["name"] not in small]
    of_gap = [" of the gap"] + [""] * len(single)
    said += [_cause(effect, of, with_shares, facts) for effect, of in zip(single, of_gap, strict=False)]
    firsts = {effect["name"]: effect for effect in facts["effects"]}
    said += [
        _of_group(group, firsts.get(name), with_shares, facts) for name, group in groups.items() if name not in small
    ]
    if not with_shares and said:
        small = facts["gap_rms_mm"] <= facts["noise_rms_mm"]
        why = "The gap is too small relative to the noise" if small else "The effects are confounded with each other"
        said.append(f"{why}: their shares of the gap cannot be determined.")
    elif _overlap(facts):
        with_rest = " and of what is unexplained" if facts["unexplained"] else ""
        said.append(f"These shares add up to more than the gap: parts of the effects{with_rest} cancel each other.")
    elif with_shares:
        said += _common(facts)
    if facts["unexplained"]:
        share = share_with_interval(next(part for part in facts["budget"] if part["kind"] == "unexplained"))
        if said:
            another = f"Another {share.removeprefix('an ')}"
            said.append(f"{another} is systematic and like no effect of the library.")
        elif _has_vetoed(facts):
            said.append("It is systematic, and no effect of the library explains it at left-out points.")
        else:
            said.append(
                f"It is systematic, and no effect of the library explains it: {share} of it is like none of them."
            )
        said += [*_looks_like(facts["unexplained_follows"]), *_possible(facts)]
    return [*said, *_sure(facts, groups)] if said else []


def _has_vetoed(facts: Facts) -> bool:
    """Whether an effect has a probability of a name and a part of the gap, and neither name nor place in the model.

    Cross-validation has ruled it out. What the readings leave with it is no share of what is unexplained without it.
    """
    return any(
        part["kind"] == "effect"
        and part["part"] not in facts["unnamed"]
        and part["probability"] >= OPTIONS.min_named_probability
        and part["share"] >= OPTIONS.min_mentioned_share
        for part in facts["budget"]
    )


def _possible(facts: Facts) -> list[str]:
    """The effects of the corrected model that are not named, where their shares are worth a sentence."""
    parts = {part["part"]: part for part in facts["budget"] if part["kind"] == "effect"}
    why = "It is not named, since it may make up for a part of what is unexplained."
    return [
        f"{share_with_interval(parts[name])} is possibly {readable(name)} (probability that it acts: "
        f"{probability(parts[name]['probability'])}). {why}"
        for name in facts["unnamed"]
        if name in parts and parts[name]["share"] >= OPTIONS.min_mentioned_share and is_determined(parts[name])
    ]


def _looks_like(rows: Sequence[Facts]) -> list[str]:
    """What the unexplained part follows, from rows of `gap_remainder`, the best first."""
    if not rows:
        return []
    best = rows[0]
    share = percent(best["explained"])
    how = _function_of(best)
    if best["explained"] < OPTIONS.min_followed_share:
        nearest = f"{best['follows']} comes next: {how} {share} at left-out points"
        return [f"The unexplained part follows no single variable that was tried: {nearest}."]
    predicted = f"{how} {share} of it at left-out points ({rounded(best['rms_mm'])} mm rms)"
    return [f"The unexplained part follows {best['follows']}: {predicted}."]


def _function_of(best: Facts) -> str:
    """What predicts the unexplained part, of a row of `gap_remainder`, with its verb."""
    scale, unit = best["scale"], best["unit"]
    if best["follows"].startswith(JUMP):
        return "it predicts"
    if not np.isfinite(scale or np.nan):
        return "steps with it predict"
    if unit == "rad":
        scale, unit = np.degrees(scale), "degrees"
    return f"a smooth function of it, which changes over about {rounded(scale)} {unit}, predicts"


def _small(facts: Facts, groups: Mapping[str, Facts]) -> set[str]:
    """Effects, of a group the first, whose part of the gap is too small for a sentence; none where all are."""
    parts = {effect["name"]: groups.get(effect["name"], effect) for effect in facts["effects"]}
    least_mm = OPTIONS.min_cause_per_noise * facts["noise_rms_mm"]
    small = {
        name
        for name, part in parts.items()
        if part["share"] is not None and (part["rms_mm"] < least_mm or part["share"] < OPTIONS.min_cause_share)
    }
    return small if len(small) < len(parts) else set()


def _by_share(facts: Facts, groups: Mapping[str, Facts], small: Collection[str]) -> str:
    """All causes in a line, each with its share, the small ones counted."""
    listed = []
    for effect in facts["effects"]:
        if effect["name"] in small:
            continue
        if group := groups.get(effect["name"]):
            listed.append((group["share"], " or ".join(map(readable, group["names"]))))
        else:
            known = effect["share"] is None or is_determined(effect)
            name = _name(effect)
            listed.append((effect["share"] or 0.0, name if known else f"{name} (share not determined)"))
    words = [
        name if name.endswith(")") else f"{name} {small_percent(share)}"
        for share, name in sorted(listed, key=lambda one: (-one[0], one[1]))
    ]
    words += [f"{len(small)} small one{'s' if len(small) > 1 else ''}"] * bool(small)
    return f"Causes by their share of the gap: {', '.join(words)}."


def _of_group(group: Facts, first: Facts | None, with_shares: bool, facts: Facts) -> str:
    """Confounded causes of which one acts; first: of them, as the corrected model has it, None where it has not."""
    names = [readable(name) for name in group["names"]]
    listed = ", ".join(f"{name} {probability(p)}" for name, p in zip(names, group["probabilities"], strict=True))
    share = f"; together they make {small_percent(group['share'])} of the gap" if with_shares else ""
    corrected = f" The corrected model has {_name_and_sizes(first, facts)[0]}." if first else ""
    return (
        f"One of these acts, and these data cannot tell which: {listed} (probability that one does: "
        f"{probability(group['probability'])}){share}.{corrected}"
    )


def _sure(facts: Facts, groups: Mapping[str, Facts]) -> list[str]:
    """How probable each cause is, and the answer as a whole."""
    single = [effect for effect in facts["effects"] if effect["name"] not in groups]
    sure = probability(facts["probability"])
    # `rrru.diagnosis.verdict.decide` counts sets of more causes, too, where something is unexplained, and of a group
    # those with its first cause
    answer = "the causes of the corrected model" if groups else "this answer"
    answer = f"{answer}, alone or with further causes" if facts["unexplained"] else f"exactly {answer}"
    listed = ", ".join(f"{readable(one['name'])} {probability(one['probability'])}" for one in single)
    each = f"Probability that it acts: {listed}. " if single else ""
    return [f"{each}Probability of {answer}: {sure}."]


def _shares_are_determined(facts: Facts) -> bool:
    """Whether the parts of the gap are shares of it, and not larger than the whole because of the noise."""
    shares = [effect["share"] or 0.0 for effect in facts["effects"]]
    shares.append(sum(part["share"] for part in _scatter_parts(facts)))
    return facts["gap_rms_mm"] > 0.0 and max(shares) <= OPTIONS.max_mentioned_share


def _cause(effect: Facts, follow: str, with_shares: bool, facts: Facts) -> str:
    """One effect: its share, or its size where shares are not determined, name, leg, sizes and meaning."""
    share = "Also there is"
    if effect["share"] is not None:
        share = f"{capitalized(share_with_interval(effect, follow))} is"
        share = share if with_shares else f"{rounded(effect['rms_mm'])} mm is"
    name, unsized = _name_and_sizes(effect, facts)
    meaning = f": {effect['meaning']}" if effect["meaning"] else ""
    said = f"{share} {name}{meaning}.{_worst(effect['worst_places'])}"
    return f"{said} {_NO_SIZE}" if unsized else said


def _name_and_sizes(effect: Facts, facts: Facts) -> tuple[str, bool]:
    """Name, leg and sizes of an effect, and whether no size is determined for want of masses."""
    # several have their numbers in the table
    place = f" {effect['place']}" if effect["legs"].isdigit() else ""
    parameters = effect["parameters"]
    per_load = [number for number in parameters if is_per_load(number["unit"])]
    massless = MASSES_UNKNOWN in facts["notes"] and bool(per_load)
    if massless:
        # only where the weight of the links has parameters of its own is a compliance not a multiple of it
        parameters = per_load if len(per_load) < len(parameters) else []
    sizes = _sizes(parameters)
    many = len(sizes) > OPTIONS.max_listed_numbers
    # the coefficients of a function say less than its largest value, which follows
    listed = [] if many and effect["worst_places"] else [f"{len(sizes)} numbers"] if many else sizes
    return "".join([_name(effect), place, *(f", {one}" for one in listed)]), massless and not sizes


def _worst(places: Sequence[Facts]) -> str:
    """Where the drive error is largest, of drives with the unit of the first place; empty without places."""
    if not places:
        return ""
    worst = max(places, key=lambda place: (place["unit"] == places[0]["unit"], abs(place["error"])))
    turning = worst["unit"] == "rad"
    at = f"{np.degrees(worst['drive_value']):.1f} degrees" if turning else f"{worst['drive_value']:.1f} mm"
    size = with_interval(worst["error"], worst["low_95"], worst["high_95"], worst["unit"])
    return f" It is largest for {worst['name']} at {at}: {size} off its mean over the measured range."


def _sizes(parameters: Sequence[Facts]) -> list[str]:
    """Fitted values with their 95 % intervals; parameters with the same value have one entry."""
    by_size: dict[str, list[str]] = {}
    for row in parameters:
        # a compliance that may be zero is not found: its part has little load, or none that varies
        found = not is_per_load(row["unit"]) or is_off_zero(row)
        if found and np.isfinite(row["standard_error"] or np.nan):
            unit, factor = _READABLE.get(row["unit"], (row["unit"], 1.0))
            value, least_95, most_95 = (factor * row[key] for key in ("value", "low_95", "high_95"))
            size = with_interval(value, least_95, most_95, unit)
            by_size.setdefault(size, []).append(row["parameter"])
    return [f"{' = '.join(names)} = {size}" for size, names in by_size.items()]


def _scatter(facts: Facts) -> list[str]:
    """The share that does not repeat, where it acts and matters."""
    parts = _scatter_parts(facts, OPTIONS.min_scatter_probability)
    share = sum(part["share"] for part in parts)
    if share < OPTIONS.min_mentioned_share:
        return []
    how = next((text for note, text in _RANDOM.items() if note in facts["notes"]), _DOES_NOT_REPEAT)
    if facts["unexplained"]:
        # a step, as of a target that slips once, is no smooth discrepancy and passes in part for noise
        how = how.replace(_ABOVE_NOISE, _OR_UNEXPLAINED)
    if not _shares_are_determined(facts):
        return [f"Some of it {how}"]
    # the interval of a sum is not known
    acting = [part for part in parts if part["share"]]
    size = capitalized(share_with_interval(acting[0])) if len(acting) == 1 else percent(share)
    return [f"{size} {how}"]


def _scatter_parts(facts: Facts, least: float = 0.0) -> list[Facts]:
    """Parts of the gap that do not repeat and act with a least probability."""
    parts = (part for part in facts["budget"] if part["kind"] in ("scatter", "runs"))
    return [part for part in parts if not part["probability"] < least]


def _left(facts: Facts) -> list[str]:
    """Residual error with the effects in the simulator, and whether left-out points show that it is smaller."""
    named = {0: "", 1: "it"}.get(len(facts["effects"]), "them")
    further = f"possible further causes ({', '.join(map(readable, facts['unnamed']))})" if facts["unnamed"] else ""
    what = " and ".join(filter(None, (named, further)))
    size = f"{rounded(facts['gap_after_rms_mm'])} mm; the {_noise(facts)}"
    said = [f"With {what} in the simulator the residual error at left-out points is {size}."]
    if facts["gap_rms_mm"] > facts["gap_after_rms_mm"]:
        return said
    if facts["gap_rms_mm"] < facts["noise_rms_mm"]:
        said.append("That it shrinks cannot be seen at these points: it is too small relative to the noise.")
    else:
        said.append(f"At these points it is no smaller than without {what}: another cause may act.")
    return said


def _open(facts: Facts) -> list[str]:
    """What else may act: the named rivals, and what the advised runs would decide."""
    named = [effect["name"] for effect in facts["effects"]]
    pairs = [apart(run["separates"]) for run in facts["next"]]
    asked = dict.fromkeys(name for sides in pairs for name in sorted(set().union(*sides)))
    # groups have a sentence of their own
    grouped = [name for group in facts["groups"] for name in group["names"]]
    others = dict.fromkeys(name for name in [*facts["confounded_with"], *asked] if name not in [*named, *grouped])
    listed = [_OUTSIDE.get(name, readable(name)) for name in others]
    uncertain = {name for sides in pairs if not all(sides) for name in set().union(*sides)}
    listed += [f"that {readable(name)} does not act" for name in named if name in uncertain]
    if not listed:
        return []
    first = "Parts of the unexplained share could be" if facts["unexplained"] else "These data cannot rule out"
    return [f"{first}: {', '.join(listed)}."]


def _common(facts: Facts) -> list[str]:
    """What two causes make together in addition to what each makes alone, where that is worth a sentence."""
    names = {effect["name"] for effect in facts["effects"]}
    parts = [part for part in facts["budget"] if part["kind"] == "covariance"]
    return [
        f"Another {percent(part['share'])} of the gap is made by {' and '.join(map(readable, pair))} together, "
        "since their parts resemble each other."
        for part in parts
        if part["share"] >= OPTIONS.min_mentioned_share and names.issuperset(pair := part["part"].split(" and "))
    ]


def _overlap(facts: Facts) -> bool:
    """Whether shares of several parts that are stated add up to more than the whole by more than is mentioned."""
    parts = [effect for effect in facts["effects"] if effect["share"] is not None]
    parts += [part for part in facts["budget"] if part["kind"] == "unexplained" and facts["unexplained"]]
    shares = [part["share"] for part in parts if is_determined(part)]
    return len(shares) > 1 and sum(shares) > 1.0 + OPTIONS.min_mentioned_share


def _next(facts: Facts) -> list[str]:
    """What to measure next, and what would decide where nothing that can be simulated does."""
    said = [_undecidable(facts)] if facts["undecided"] else []
    if facts["next"]:
        best = facts["next"][0]
        what = (
            f"measure {best['run']} (see the table gap_next_poses)"
            if best["kind"] == "poses"
            else f"drive {best['run']}"
        )
        sure = best["gain_nats"] >= OPTIONS.decisive_gain_nats
        verb = "decides" if sure else "would help to decide"
        return [*said, f"Next: {what}. That {verb} {_contest(best['separates'])}."]
    if said:
        return said
    if facts["unexplained"]:
        jumps = [row for row in facts["unexplained_follows"][:1] if row["follows"].startswith(JUMP)]
        if jumps and jumps[0]["explained"] >= OPTIONS.min_followed_share:
            moment = jumps[0]["follows"].removeprefix(JUMP).split(",")[0].strip()
            do = "calibrate the readings before and after it separately, or measure again"
            return [f"Next: no run is advised, since something changed at {moment}: {do}."]
        where = "the table gap_locate says where the gap is largest"
        return [f"Next: no run is advised, since no effect model fits the unexplained part; {where}."]
    decided = not (facts["groups"] or facts["confounded_with"])
    least = min((effect["probability"] for effect in facts["effects"]), default=facts["probability"])
    if max(least if decided else 0.0, facts["probability"]) >= OPTIONS.min_sure_probability:
        return ["Next: nothing more needs to be measured for this answer."]
    return ["Next: no further run that was tried in computation would settle it."]


def _undecidable(facts: Facts) -> str:
    """What would decide between two answers where nothing that can be simulated does: inspection of their causes."""
    undecided = facts["undecided"]
    limited = " within the limits" if any(note.startswith(_LIMITED) for note in facts["notes"]) else ""
    would = " ".join(
        f"{capitalized(readable(one['name']))}: {one['inspect'] or 'add a sensor at the part itself.'}"
        for one in undecided["inspect"]
    )
    first = f"Next: nothing that can be simulated{limited} would decide {_contest(undecided['separates'])}"
    return f"{first}; inspection would. {would}"


def _contest(separates: str) -> str:
    """The difference between two answers "a+b / a+c", in words."""
    sides = [" + ".join(map(readable, sorted(side))) for side in apart(separates)]
    return f"between {sides[0]} and {sides[1]}" if all(sides) else f"whether {''.join(sides)} acts"
