"""All verdicts and scores of the check on withheld effects, its figures and its confusion table."""

from rrru.store import tables
from rrru.store.job import run
from rrru.studies.blind_validation.schemas import TABLES
from rrru.studies.blind_validation.summary import (
    CAUSES,
    LIMITS,
    PARTS,
    confusion,
    field_verdicts,
    read_field_answers,
    score_field,
    summary,
)


def main(settings, inputs, outputs):
    """Write the tables of the check; field campaigns are included where they and their answers are given."""
    schemas, field = {table.name: table for table in TABLES}, _of_field(inputs)
    for name in (name for name in inputs if name in outputs):
        more = [tables.typed(schemas[name], field[name])] if name in field else []
        tables.gather([*inputs[name], *more], outputs[name])
        tables.check_keys(schemas[name], outputs[name])
    scores = tables.read(outputs["withheld_scores"])
    listed = {
        name: tables.read(outputs[f"withheld_{name}"], columns=columns)
        for name, columns in (("limits", LIMITS), ("parts", PARTS), ("causes", CAUSES))
    }
    frames = {
        "withheld_summary": summary(scores, **listed),
        "withheld_confusion": confusion(scores),
    }
    tables.write_all(TABLES, frames, outputs)


def _of_field(inputs):
    """Rows of field campaigns by the name of their table."""
    if not inputs["field"]:
        return {}
    field = field_verdicts(tables.read(inputs["field"]))
    if not inputs["field_answers"]:
        return {"withheld_verdicts": field}
    scores = score_field(field, read_field_answers(inputs["field_answers"]))
    return {"withheld_verdicts": field, "withheld_scores": scores}


if __name__ == "__main__":
    run(main, snakemake)
