"""The papers' numbers compared with the studies', and the audit of their misprints."""

import importlib

import pandas as pd

from rrru.store import tables
from rrru.store.job import run
from rrru.studies.schemas import TABLES


def main(settings, inputs, outputs):
    """Write both tables, concatenated over the papers; settings: {letter: its study's package, tables and settings}."""
    published, audit = [], []
    for paper in settings.values():
        numbers, findings = (importlib.import_module(f"{paper['study']}.{name}") for name in ("published", "audit"))
        own = (tables.read(inputs[name]) for name in paper["tables"])
        published.append(numbers.published_rows(paper["settings"], *own))
        audit.append(findings.audit_rows())
    frames = {"published": pd.concat(published, ignore_index=True), "audit": pd.concat(audit, ignore_index=True)}
    tables.write_all(TABLES, frames, outputs)


if __name__ == "__main__":
    run(main, snakemake)
