"""All verdicts and scores of the check on withheld effects, its figures and its confusion table."""

import pandas as pd

from rrru.store import tables
from rrru.store.job import run
from rrru.studies.withheld.field import field_verdicts, read_field_answers, score_field
from rrru.studies.withheld.schemas import TABLES
from rrru.studies.withheld.summary import confusion, summary


def main(settings, inputs, outputs):
    """Write the tables of the check; field campaigns join it where they and their answers are given."""
    parts = {name: [tables.read(path) for path in inputs[name]] for name in inputs if name.startswith("withheld_")}
    if inputs["field"]:
        field = field_verdicts(pd.concat([tables.read(path) for path in inputs["field"]], ignore_index=True))
        parts["withheld_verdicts"].append(field)
        if inputs["field_answers"]:
            parts["withheld_scores"].append(score_field(field, read_field_answers(inputs["field_answers"])))
    frames = {name: pd.concat([f for f in part if len(f)], ignore_index=True) for name, part in parts.items()}
    scores = frames["withheld_scores"]
    frames["withheld_summary"] = summary(scores, frames["withheld_limits"], frames["withheld_parts"])
    frames["withheld_confusion"] = confusion(scores)
    tables.write_all(TABLES, frames, outputs)


if __name__ == "__main__":
    run(main, snakemake)
