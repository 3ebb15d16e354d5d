"""What a diagnosis states about each cause that it tested: probability, decision and group, made without any answer."""

import pandas as pd

from rrru.gap.verdict import EXCLUDED, GROUPED, NAMED, POSSIBLE

# between members of a group, as in gap_verdicts
BETWEEN = " | "


def stated(robot, diagnosis):
    """Frame `withheld_stated` of a robot, one row for each tested effect, from its Diagnosis.

    The probability is that of the posterior, whatever the decision is.
    """
    attribution = diagnosis.attribution
    rows = [
        {"robot": robot, "effect": name, "probability": min(attribution.posterior.marginal(name), 1.0)}
        | decision(name, diagnosis.verdict)
        for name in attribution.case.effects
    ]
    return pd.DataFrame(rows, columns=["robot", "effect", "probability", "decision", "group"])


def decision(name, verdict):
    """Decision on an effect and its group, empty for none, from a row of `gap_verdicts`."""
    groups = [group for group in verdict["groups"].split("; ") if name in group.split(BETWEEN)]
    if groups:
        return {"decision": GROUPED, "group": groups[0]}
    if name in verdict["effects"].split("+"):
        return {"decision": NAMED, "group": ""}
    possible = name in verdict["confusable_with"].split(", ")
    return {"decision": POSSIBLE if possible else EXCLUDED, "group": ""}
