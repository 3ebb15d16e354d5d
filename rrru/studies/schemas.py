"""Tables that every study of a paper has a part of."""

from rrru.store.schema import NUMBER, Column, Table

_PAPER = Column("paper", "str", "A: 3-RRRU; B: 3-PTT; C: Delta", allowed=("A", "B", "C"))
_DRAWN = "end of the middle 90 % over other draws of wobble and noise; null where nothing is drawn"
_NOTHING = "null where it gives nothing"
_SHOWN = "true where the misprint or contradiction shows; false where a claim holds, and for what is lost"
_KINDS = ("computed", "as printed", "lost")

PUBLISHED = Table(
    "published",
    "tables/published.parquet",
    "Every number that the papers print, beside what this study gives.",
    (
        _PAPER,
        Column("item", "str", "what the number is"),
        Column("source", "str", "table, figure, section or sentence of the paper"),
        Column("unit", "str", "unit as printed"),
        Column("published", NUMBER, "printed number"),
        Column("here", NUMBER, "this study's number; null where it has none", True),
        Column("ratio", NUMBER, "here / published; null where either is null or zero", True),
        Column("here_low", NUMBER, f"lower {_DRAWN}", True),
        Column("here_high", NUMBER, "upper end", True),
        Column("note", "str", "what differs, and why"),
    ),
    ("paper", "item", "source"),
)
AUDIT = Table(
    "audit",
    "tables/audit.parquet",
    "Misprints, contradictions and claims of the papers, each recomputed, "
    "and what the scans of papers B and C have lost.",
    (
        _PAPER,
        Column("where", "str", "place in the paper"),
        Column("printed", "str", "what stands there"),
        Column("right", "str", "what should"),
        Column("kind", "str", "computed here, compared as printed, or lost in the scan", allowed=_KINDS),
        Column("check", "str", "what is computed to show it"),
        Column("unit", "str", "unit of the two values"),
        Column("value_printed", NUMBER, f"what the printed form gives; {_NOTHING}", True),
        Column("value_right", NUMBER, f"what the right form or the independent check gives; {_NOTHING}", True),
        Column("shown", "bool", _SHOWN),
    ),
    ("paper", "where", "check"),
)
TABLES = (PUBLISHED, AUDIT)
