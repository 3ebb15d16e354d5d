"""What a diagnosis states about each cause that it tested: probability, decision and group, made without any answer."""

import pandas as pd

# between members of a group, as in gap_verdicts
BETWEEN = " | "


def stated(robot, diagnosis):
    """Frame `withheld_stated` of a robot, one row for each tested effect, from its Diagnosis.

    The probability is that of the posterior, whatever the decision is.
    """
    inference, verdict = diagnosis.inference, diagnosis.decided
    rows = []
    for name in inference.case.effects:
        group = verdict.group_of(name)
        probability = min(inference.posterior.marginal(name), 1.0)
        rows.append((robot, name, probability, verdict.decision(name), BETWEEN.join(group.names) if group else ""))
    return pd.DataFrame(rows, columns=["robot", "effect", "probability", "decision", "group"])
