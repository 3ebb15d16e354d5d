"""Tables of the reproduction."""

from rrru.report.schemas.base import NUMBER, Column, Table

TABLES = (
    Table(
        "published",
        "tables/published.parquet",
        "Every number that paper A prints, beside what this study gives.",
        (
            Column("item", "str", "what the number is"),
            Column("source", "str", "table, figure, section or sentence of the paper"),
            Column("unit", "str", "unit as printed"),
            Column("published", NUMBER, "printed number"),
            Column("here", NUMBER, "this study's number; null where it has none", True),
            Column("ratio", NUMBER, "here / published; null where either is null or zero", True),
            Column(
                "here_low", NUMBER, "lower end of the middle 90 % over other draws of wobble and noise; null where nothing is drawn", True
            ),
            Column("here_high", NUMBER, "upper end", True),
            Column("note", "str", "what differs, and why"),
        ),
        ("item", "source"),
    ),
    Table(
        "audit",
        "tables/audit.parquet",
        "Misprints and contradictions of paper A, each recomputed.",
        (
            Column("where", "str", "place in the paper"),
            Column("printed", "str", "what stands there"),
            Column("right", "str", "what should"),
            Column("kind", "str", "computed here, or compared as printed", allowed=("computed", "as printed")),
            Column("check", "str", "what is computed to show it"),
            Column("unit", "str", "unit of the two values"),
            Column("value_printed", NUMBER, "what the printed form gives; null where it gives nothing", True),
            Column("value_right", NUMBER, "what the right form or the independent check gives; null where it gives nothing", True),
            Column("shown", "bool", "true where the numbers show the misprint or contradiction"),
        ),
        ("where", "check"),
    ),
)
