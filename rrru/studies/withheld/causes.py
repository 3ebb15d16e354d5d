"""Statements on single causes beside the truth, and how well their probabilities are calibrated.

A statement is counted where the cause makes half of the noise or more by itself, or does not act. Causes that act with
less are left out: no answer on them is wrong.
"""

import numpy as np
import pandas as pd

from rrru.gap.verdict import GROUPED, NAMED
from rrru.studies.withheld.stated import BETWEEN

# strength over the noise from which on a cause counts as one that acts
LEAST_STRENGTH = 0.5
# bins of equal width of a probability
BIN_EDGES = np.arange(11) / 10.0
# probabilities of a log loss are at least this far from 0 and 1
_LEAST_PROBABILITY = 0.001


def causes_of(stated, robot):
    """Frame `withheld_causes` of a robot, without the check, from its rows of `withheld_stated`.

    Errors of all axes that the robot has by itself act as any other cause.
    """
    strengths = {one.effect: one.strength for one in robot.causes if not one.outside}
    strength = stated["effect"].map(strengths).fillna(0.0).astype(float)
    return stated.assign(acts=stated["effect"].isin(list(strengths)), strength=strength)


def counted(causes):
    """The rows of `withheld_causes` whose statement is counted."""
    return causes[~causes["acts"].astype(bool) | (causes["strength"] >= LEAST_STRENGTH)]


def bins(probability):
    """Number of the bin (n,) of probabilities (n,)."""
    return np.clip(np.digitize(probability, BIN_EDGES) - 1, 0, len(BIN_EDGES) - 2)


def calibration_error(probability, acts):
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


def group_size(group):
    """Number of members (n,) of groups (n,), 0 for no group."""
    return (group.str.count(f"[{BETWEEN.strip()}]") + 1).where(group != "", 0)


def groups_of(stated):
    """Groups of causes that cannot be told apart, each a tuple of names, from rows of `withheld_stated`."""
    return [tuple(group.split(BETWEEN)) for group in stated["group"].unique() if group]


def named_lines(causes):
    """Causes and groups that verdicts name, from `withheld_causes`: a row each, with its size and whether it is there.

    A group is there where one of its members acts.
    """
    chosen = causes[causes["decision"].isin([NAMED, GROUPED])]
    line = chosen["group"].where(chosen["decision"] == GROUPED, chosen["effect"])
    lines = chosen.assign(line=line).groupby(["robot", "line"], sort=False)
    found = lines.agg(size=("effect", "size"), acts=("acts", "any")).reset_index()
    return found.assign(invented=~found["acts"].astype(bool))


def with_decisions(parts, causes):
    """Rows of `withheld_parts` with how the verdict names each: alone, or in a group of two or of any size.

    `named` holds for the first member of a group too, which stands for it in a verdict's effects.
    """
    columns = ["robot", "effect", "decision", "group"]
    about = causes[columns].rename(columns={"effect": "part"})
    joined = parts.merge(about, "left", ["robot", "part"]).set_axis(parts.index)
    size, named = group_size(joined["group"].fillna("")), joined["named"].astype(bool)
    return joined.assign(alone=joined["decision"] == NAMED, in_pair=named | (size == 2), in_group=named | (size > 1))


def empty_causes():
    """`withheld_causes` of no robot."""
    return pd.DataFrame(columns=["check", "robot", "effect", "probability", "decision", "group", "acts", "strength"])
