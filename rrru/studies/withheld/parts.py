"""What the diagnosis makes of each part of a robot's gap, beside its true size. Lengths mm.

A cause's true part is the gap that it leaves alone after its own calibration; parts of several need not add up.
"""

import numpy as np
import pandas as pd

from rrru.studies.withheld.noise import NoiseLaw
from rrru.studies.withheld.verdicts import CAUSES, NONE, UNEXPLAINED

_NOISES = ("scatter", "runs")
_LISTED = ("effect", *_NOISES, UNEXPLAINED)
# of many causes those have to be named that make this share of the gap's rms, or are from outside and so strong
_LEAST_SHARE, _CLEAR = 0.3, 2.0
_HALF = 0.5


def parts(robot, effects, budget, noise_rms_mm, taken_out=""):
    """Frame `withheld_parts` of a Robot without check and robot, from the effects of its verdict and its budget's rows.

    taken_out: the effect that the diagnosis had to do without.
    """
    said, true = set(effects.split("+")), _true(robot, taken_out)
    found = budget[budget["kind"].isin(_LISTED)].set_index("part")[["rms_mm", "probability"]]
    more = (said | set(found.index)) - {part for part, *_ in true} - {NONE}
    rows = [*true, *((name, "effect", 0.0) for name in sorted(more))]
    frame = pd.DataFrame(rows, columns=["part", "kind", "strength"]).join(found, on="part")
    outside = frame["kind"] == "outside"
    # what no budget lists is nothing; a cause from outside has no part of its own there
    frame[["rms_mm", "probability"]] = frame[["rms_mm", "probability"]].fillna(0.0).mask(outside)
    named = frame["part"].mask(outside, UNEXPLAINED).isin(said)
    repeats_not = frame["kind"].isin(_NOISES) & (frame["probability"] > _HALF)
    return frame.rename(columns={"rms_mm": "found_rms_mm"}).assign(
        true_rms_mm=noise_rms_mm * frame["strength"], named=named | repeats_not
    )


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


def is_enough(listed, strength):
    """Whether a verdict on many causes names all that matter and nothing that is not there.

    listed: rows of `withheld_parts` of the robot; strength: of its whole gap.
    """
    cause, kind = listed["kind"].isin(CAUSES), listed["kind"]
    matter = (kind == "effect") & (listed["strength"] >= _LEAST_SHARE * strength)
    matter |= (kind == UNEXPLAINED) & (listed["strength"] >= _CLEAR)
    invented = listed["named"] & cause & (listed["strength"] == 0.0)
    return bool(listed.loc[matter, "named"].all() and not invented.any())
