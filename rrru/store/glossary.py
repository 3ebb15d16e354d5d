"""`results/README.md`: every table and column in words. `python -m rrru.store.glossary` writes it from the schemas."""

from pathlib import Path

from rrru.store.schemas import TABLES

_HEAD = """# What a run writes

`tables/` holds the tables of the whole study, `campaigns/` each campaign's own parts of them, `figures/` every figure as PDF and PNG,
`timings/` wall times (the only files whose bytes differ from run to run), `logs/` one log per job, `sweep/` the parts of the sweeps.
Lengths are in mm and angles in rad unless a column's name says otherwise. This page is made from the schemas beside each package.
"""


def text():
    """The glossary as Markdown."""
    parts = [_HEAD]
    for table in TABLES.values():
        parts.append(
            f"## {table.name}\n\n`{table.path}`. {table.description} A row is named by: {', '.join(table.key)}.\n"
        )
        lines = ["| column | type | meaning |", "| --- | --- | --- |"]
        for column in table.columns:
            kind = column.kind + (", null allowed" if column.nullable else "")
            values = f" ({', '.join(column.allowed)})" if column.allowed else ""
            lines.append(f"| `{column.name}` | {kind} | {column.description}{values} |".replace("||", "|"))
        parts.append("\n".join(lines) + "\n")
    return "\n".join(parts)


if __name__ == "__main__":
    (Path(__file__).resolve().parents[2] / "results" / "README.md").write_text(text())
