"""Statements of a diagnosis on each tested cause: probability, decision and group, made without the truth."""

import pandas as pd

# between members of a group, as in gap_verdicts
BETWEEN = " | "


def stated(robot, diagnosis):
    """Frame `withheld_stated` of a robot, one row for each tested effect, from its Diagnosis.

    The probability is the posterior probability, whatever the decision is.
    """
    inference, verdict = diagnosis.inference, diagnosis.decided
    rows = []
    for name in inference.case.effects:
        group = verdict.group_of(name)
        probability = min(inference.posterior.marginal(name), 1.0)
        rows.append((robot, name, probability, verdict.decision(name), BETWEEN.join(group.names) if group else ""))
    return pd.DataFrame(rows, columns=["robot", "effect", "probability", "decision", "group"])
