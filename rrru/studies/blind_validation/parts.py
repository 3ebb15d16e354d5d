"""Each part of a robot's gap, and each cause, as the diagnosis states it, compared with the truth. Lengths mm.

The true part of a cause is its gap when it acts alone, after its own calibration. Parts of several causes need not add
up.
"""

import numpy as np
import pandas as pd

from rrru.diagnosis.verdict import GROUPED, NAMED
from rrru.studies.blind_validation.noise import NoiseModel
from rrru.studies.blind_validation.stated import BETWEEN
from rrru.studies.blind_validation.verdicts import CAUSES, NONE, UNEXPLAINED

_NOISES = ("scatter", "runs")
_LISTED = ("effect", *_NOISES, UNEXPLAINED)
# fraction of the gap's rms from which a cause has to be named; strength from which one outside the library has to
_LEAST_SHARE, _CLEAR = 0.3, 2.0
_MIN_PROBABILITY = 0.5
# columns of a budget
_FOUND = ["rms_mm", "found_low_mm", "found_high_mm", "probability"]


def parts(robot, effects, budget, noise_rms_mm, taken_out=""):
    """Frame `withheld_parts` of a Robot without check and robot, from the effects of its verdict and its budget's rows.

    taken_out: the effect that was removed from the library of the diagnosis.
    """
    said, true = set(effects.split("+")), _true(robot, taken_out)
    found = _with_interval(budget[budget["kind"].isin(_LISTED)]).set_index("part")[_FOUND]
    more = (said | set(found.index)) - {part for part, *_ in true} - {NONE}
    rows = [*true, *((name, "effect", 0.0) for name in sorted(more))]
    frame = pd.DataFrame(rows, columns=["part", "kind", "strength"]).join(found, on="part")
    outside = frame["kind"] == "outside"
    # a part that no budget lists is zero; a cause from outside the library has no part there
    frame[_FOUND] = frame[_FOUND].fillna(0.0).mask(outside)
    named = frame["part"].mask(outside, UNEXPLAINED).isin(said)
    repeats_not = frame["kind"].isin(_NOISES) & (frame["probability"] > _MIN_PROBABILITY)
    return frame.rename(columns={"rms_mm": "found_rms_mm"}).assign(
        true_rms_mm=noise_rms_mm * frame["strength"], named=named | repeats_not
    )


def _with_interval(budget):
    """Rows of a budget with the ends of their 95 % intervals as rms in mm; shares are of the gap's mean square.

    A part without share has no interval.
    """
    share, square = budget["share"], budget["rms_mm"] ** 2
    whole = (square / share.abs()).where(share != 0.0)
    ends = {f"found_{end}_mm": np.sqrt((budget[f"share_{end}"] * whole).clip(lower=0.0)) for end in ("low", "high")}
    return budget.assign(**{name: rms_mm.fillna(budget["rms_mm"]) for name, rms_mm in ends.items()})


def _true(robot, taken_out):
    """All parts of a robot: name, kind, strength (rms over that of the stated noise)."""
    acting = [one for one in robot.acting if one.effect]
    outside = {one.effect for one in acting if one.outside or one.effect == taken_out}
    rows = [(one.effect, "outside" if one.effect in outside else "effect", one.strength) for one in acting]
    rows += [(one.effect, "background", one.strength) for one in robot.background]
    noise = NoiseModel(**robot.noise)
    rows += [("scatter", "scatter", noise.beyond), ("runs", "runs", noise.runs)]
    unknown = [one.strength for one in acting if one.effect in outside]
    return [*rows, (UNEXPLAINED, UNEXPLAINED, float(np.linalg.norm(unknown)))]


def is_enough(listed, strength, groups=()):
    """Whether a verdict on many causes names all important causes and no cause that does not act.

    listed: rows of `withheld_parts` of the robot; strength: of its whole gap; groups: of causes that are confounded in
    the verdict, each a tuple of names. A group with an acting member counts as naming its acting members only.
    """
    cause, kind = listed["kind"].isin(CAUSES), listed["kind"]
    acting = set(listed.loc[listed["strength"] > 0.0, "part"])
    in_group = listed["part"].isin([name for group in groups if acting & set(group) for name in group])
    matter = (kind == "effect") & (listed["strength"] >= _LEAST_SHARE * strength)
    matter |= (kind == UNEXPLAINED) & (listed["strength"] >= _CLEAR)
    invented = listed["named"] & cause & (listed["strength"] == 0.0) & ~in_group
    return bool((listed["named"] | in_group)[matter].all() and not invented.any())


def causes_of(stated, robot):
    """Frame `withheld_causes` of a robot, without the check, from its rows of `withheld_stated`.

    The axis errors of the background count as an acting cause.
    """
    strengths = {one.effect: one.strength for one in robot.causes if not one.outside}
    strength = stated["effect"].map(strengths).fillna(0.0).astype(float)
    return stated.assign(acts=stated["effect"].isin(list(strengths)), strength=strength)


def group_size(group):
    """Number of members (n,) of groups (n,), 0 for no group."""
    return (group.str.count(f"[{BETWEEN.strip()}]") + 1).where(group != "", 0)


def groups_of(stated):
    """Groups of confounded causes, each a tuple of names, from rows of `withheld_stated`."""
    return [tuple(group.split(BETWEEN)) for group in stated["group"].unique() if group]


def named_lines(causes):
    """Causes and groups that verdicts name, from `withheld_causes`, one row each, with its size and whether it acts.

    A group acts where one of its members acts.
    """
    chosen = causes[causes["decision"].isin([NAMED, GROUPED])]
    line = chosen["group"].where(chosen["decision"] == GROUPED, chosen["effect"])
    lines = chosen.assign(line=line).groupby(["robot", "line"], sort=False)
    found = lines.agg(size=("effect", "size"), acts=("acts", "any")).reset_index()
    return found.assign(invented=~found["acts"].astype(bool))


def with_decisions(parts, causes):
    """Rows of `withheld_parts` with how the verdict names each: alone, or in a group of two or of any size.

    `named` holds for the first member of a group too: it represents the group in a verdict's effects.
    """
    columns = ["robot", "effect", "decision", "group"]
    about = causes[columns].rename(columns={"effect": "part"})
    joined = parts.merge(about, "left", ["robot", "part"]).set_axis(parts.index)
    size, named = group_size(joined["group"].fillna("")), joined["named"].astype(bool)
    return joined.assign(alone=joined["decision"] == NAMED, in_pair=named | (size == 2), in_group=named | (size > 1))


def empty_causes():
    """`withheld_causes` of no robot."""
    return pd.DataFrame(columns=["check", "robot", "effect", "probability", "decision", "group", "acts", "strength"])
