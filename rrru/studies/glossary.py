"""`results/README.md`, every table and column in words; `python -m rrru.studies.glossary` writes it."""

import importlib
import pkgutil
from pathlib import Path

import yaml

import rrru

_HEAD = """# What a run writes

`report.html` is one page of everything (`make report`), `compare.html` one of two calibrations (`make compare`).
`tables/` holds the tables of the whole study, `campaigns/` each campaign's own parts of them, its answer as
`verdict.json`, and what it was calibrated as, `robot.json`; `figures/` every figure as PDF, PNG and SVG, `timings/`
wall times (the only files whose bytes differ from run to run), `logs/` one log per job, `sweep/` the parts of the
sweeps. Lengths are in mm and angles in rad unless a column's name says otherwise. This page is made from the
`schemas.py` of each package and from `rrru/pipeline/verdict.schema.yaml`.
"""
_VERDICT = Path(rrru.__file__).parent / "pipeline" / "verdict.schema.yaml"


def tables():
    """All tables by name, from every module of the package named `schemas`."""
    modules = [m.name for m in pkgutil.walk_packages(rrru.__path__, "rrru.") if m.name.endswith(".schemas")]
    return {table.name: table for name in sorted(modules) for table in importlib.import_module(name).TABLES}


def text():
    """The glossary as Markdown."""
    parts = [_HEAD]
    for table in tables().values():
        key = ", ".join(table.key)
        parts.append(f"## {table.name}\n\n`{table.path}`. {table.description} A row is named by: {key}.\n")
        parts.append(
            "\n".join(["| column | type | meaning |", "| --- | --- | --- |", *map(_row, table.columns)]) + "\n"
        )
    return "\n".join([*parts, _answer()])


def _answer():
    """The keys of verdict.json, from its schema."""
    schema = yaml.safe_load(_VERDICT.read_text())
    rows = [f"| `{name}` | {_keys(key)} | {key['description']} |" for name, key in schema["properties"].items()]
    heading = f"## verdict.json\n\n{schema['description']}. Schema: `rrru/pipeline/verdict.schema.yaml`.\n"
    return "\n".join([heading, "| key | type | meaning |", "| --- | --- | --- |", *rows, ""])


def _keys(key):
    """A key's type as text; of a list of objects their keys."""
    within = key.get("items", {}).get("properties")
    kinds = key.get("type", "string" if "enum" in key else "number")
    kinds = " or ".join(kinds) if isinstance(kinds, list) else kinds
    return f"array of {', '.join(within)}" if within else kinds


def _row(column):
    """One column as a row of Markdown."""
    kind = column.kind + (", null allowed" if column.nullable else "")
    values = f" ({', '.join(column.allowed)})" if column.allowed else ""
    return f"| `{column.name}` | {kind} | {column.description}{values} |"


if __name__ == "__main__":
    Path(rrru.__file__).parents[1].joinpath("results", "README.md").write_text(text())
