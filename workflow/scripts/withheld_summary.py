"""All verdicts and scores of the check on withheld effects, its figures and its confusion table."""

import pandas as pd

from rrru.store import tables
from rrru.store.job import run
from rrru.studies.withheld import score
from rrru.studies.withheld.schemas import TABLES
from rrru.studies.withheld.summary import summary


def main(settings, inputs, outputs):
    """Write the tables of the check; field campaigns join it where they and their answers are given."""
    verdicts, scores, limits = (
        [tables.read(path) for path in inputs[f"withheld_{name}"]] for name in ("verdicts", "scores", "limits")
    )
    if inputs["field"]:
        field = pd.concat([tables.read(path) for path in inputs["field"]], ignore_index=True)
        verdicts.append(score.field_verdicts(field))
        if inputs["field_answers"]:
            scores.append(score.score_field(field, score.read_field_answers(inputs["field_answers"])))
    scores = pd.concat([frame for frame in scores if len(frame)], ignore_index=True)
    limits = pd.concat(limits, ignore_index=True)
    frames = {
        "withheld_verdicts": pd.concat(verdicts, ignore_index=True),
        "withheld_scores": scores,
        "withheld_limits": limits,
        "withheld_summary": summary(scores, limits),
        "withheld_confusion": score.confusion(scores),
    }
    tables.write_all(TABLES, frames, outputs)


if __name__ == "__main__":
    run(main, snakemake)
