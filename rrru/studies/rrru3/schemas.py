"""Tables of the reproduction."""

from rrru.store.schema import NUMBER, Column, Table

PAPER = Column("paper", "str", "A: 3-RRRU; B: 3-PTT; C: Delta", allowed=("A", "B", "C"))

TABLES = (
    Table(
        "published",
        "tables/published.parquet",
        "Every number that the papers print, beside what this study gives.",
        (
            PAPER,
            Column("item", "str", "what the number is"),
            Column("source", "str", "table, figure, section or sentence of the paper"),
            Column("unit", "str", "unit as printed"),
            Column("published", NUMBER, "printed number"),
            Column("here", NUMBER, "this study's number; null where it has none", True),
            Column("ratio", NUMBER, "here / published; null where either is null or zero", True),
            Column(
                "here_low",
                NUMBER,
                "lower end of the middle 90 % over other draws of wobble and noise; null where nothing is drawn",
                True,
            ),
            Column("here_high", NUMBER, "upper end", True),
            Column("note", "str", "what differs, and why"),
        ),
        ("paper", "item", "source"),
    ),
    Table(
        "audit",
        "tables/audit.parquet",
        "Misprints, contradictions and claims of the papers, each recomputed, and what the scans of papers B and C have lost.",
        (
            PAPER,
            Column("where", "str", "place in the paper"),
            Column("printed", "str", "what stands there"),
            Column("right", "str", "what should"),
            Column(
                "kind",
                "str",
                "computed here, compared as printed, or lost in the scan",
                allowed=("computed", "as printed", "lost"),
            ),
            Column("check", "str", "what is computed to show it"),
            Column("unit", "str", "unit of the two values"),
            Column("value_printed", NUMBER, "what the printed form gives; null where it gives nothing", True),
            Column(
                "value_right",
                NUMBER,
                "what the right form or the independent check gives; null where it gives nothing",
                True,
            ),
            Column(
                "shown",
                "bool",
                "true where the misprint or contradiction shows; false where a claim holds, and for what is lost",
            ),
        ),
        ("paper", "where", "check"),
    ),
)
