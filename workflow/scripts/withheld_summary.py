"""All verdicts and scores of the check on withheld effects, its figures and its confusion table."""

import pandas as pd

from rrru.store import tables
from rrru.store.job import job
from rrru.studies.withheld import score
from rrru.studies.withheld.summary import summary


def _together(paths):
    """Frames at paths, one below the other."""
    return [tables.read(path) for path in paths]


def main(inputs, outputs):
    """Write the tables of the check; field campaigns join it where they and their answers are given."""
    verdicts, scores = _together(inputs["verdicts"]), _together(inputs["scores"])
    if inputs["field"]:
        field = pd.concat(_together(inputs["field"]), ignore_index=True)
        verdicts.append(score.field_verdicts(field))
        if inputs["field_answers"]:
            scores.append(score.score_field(field, score.read_field_answers(inputs["field_answers"])))
    scores = pd.concat([frame for frame in scores if len(frame)], ignore_index=True)
    limits = pd.concat(_together(inputs["limits"]), ignore_index=True)
    frames = {
        "withheld_verdicts": pd.concat(verdicts, ignore_index=True),
        "withheld_scores": scores,
        "withheld_limits": limits,
        "withheld_summary": summary(scores, limits),
        "withheld_confusion": score.confusion(scores),
    }
    for name, frame in frames.items():
        tables.write(name, frame, outputs[name])


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(dict(snakemake.input.items()), snakemake.output)
