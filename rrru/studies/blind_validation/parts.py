"""What the diagnosis makes of each part of a robot's gap, beside its true size. Lengths mm.

A cause's true part is the gap that it leaves alone after its own calibration; parts of several need not add up.
"""

import numpy as np
import pandas as pd

from rrru.studies.blind_validation.noise import NoiseLaw
from rrru.studies.blind_validation.verdicts import CAUSES, NONE, UNEXPLAINED

_NOISES = ("scatter", "runs")
_LISTED = ("effect", *_NOISES, UNEXPLAINED)
# of many causes those have to be named that make this share of the gap's rms, or are from outside and so strong
_LEAST_SHARE, _CLEAR = 0.3, 2.0
_HALF = 0.5
# of a budget's rows
_FOUND = ["rms_mm", "found_low_mm", "found_high_mm", "probability"]


def parts(robot, effects, budget, noise_rms_mm, taken_out=""):
    """Frame `withheld_parts` of a Robot without check and robot, from the effects of its verdict and its budget's rows.

    taken_out: the effect that the diagnosis had to do without.
    """
    said, true = set(effects.split("+")), _true(robot, taken_out)
    found = _with_interval(budget[budget["kind"].isin(_LISTED)]).set_index("part")[_FOUND]
    more = (said | set(found.index)) - {part for part, *_ in true} - {NONE}
    rows = [*true, *((name, "effect", 0.0) for name in sorted(more))]
    frame = pd.DataFrame(rows, columns=["part", "kind", "strength"]).join(found, on="part")
    outside = frame["kind"] == "outside"
    # what no budget lists is nothing; a cause from outside has no part of its own there
    frame[_FOUND] = frame[_FOUND].fillna(0.0).mask(outside)
    named = frame["part"].mask(outside, UNEXPLAINED).isin(said)
    repeats_not = frame["kind"].isin(_NOISES) & (frame["probability"] > _HALF)
    return frame.rename(columns={"rms_mm": "found_rms_mm"}).assign(
        true_rms_mm=noise_rms_mm * frame["strength"], named=named | repeats_not
    )


def _with_interval(budget):
    """Rows of a budget with the ends of their 95 % intervals as rms in mm: shares are of the gap's mean square.

    A part of no share has no interval.
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
    law = NoiseLaw(**robot.noise)
    rows += [("scatter", "scatter", law.beyond), ("runs", "runs", law.runs)]
    unknown = [one.strength for one in acting if one.effect in outside]
    return [*rows, (UNEXPLAINED, UNEXPLAINED, float(np.linalg.norm(unknown)))]


def is_enough(listed, strength, groups=()):
    """Whether a verdict on many causes names all that matter and nothing that is not there.

    listed: rows of `withheld_parts` of the robot; strength: of its whole gap; groups: of causes that the verdict cannot
    tell apart, each a tuple of names. A group one of whose members acts names those that act, and nothing else.
    """
    cause, kind = listed["kind"].isin(CAUSES), listed["kind"]
    acting = set(listed.loc[listed["strength"] > 0.0, "part"])
    in_group = listed["part"].isin([name for group in groups if acting & set(group) for name in group])
    matter = (kind == "effect") & (listed["strength"] >= _LEAST_SHARE * strength)
    matter |= (kind == UNEXPLAINED) & (listed["strength"] >= _CLEAR)
    invented = listed["named"] & cause & (listed["strength"] == 0.0) & ~in_group
    return bool((listed["named"] | in_group)[matter].all() and not invented.any())
