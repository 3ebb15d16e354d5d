"""Statements on single causes compared with the truth: acting causes, and causes and groups that verdicts name."""

import pandas as pd

from rrru.diagnosis.verdict import GROUPED, NAMED
from rrru.studies.blind_validation.stated import BETWEEN


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
