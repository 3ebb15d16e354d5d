"""Tables read from rows of text."""

from rrru.store.schema import Column, Table, read_tables

_TEXT = """
run          int    number of the pass,
    from 1
{xyz}_mm     float? place
theta{12}    float  angle of drive {12}
note_{ab}    str    see note

## paths | tables/paths.parquet | run point
What was driven,
point by point.
--
run {xyz}_mm theta{12} note_{ab}
point        int    number
state        str    what became of it {ok, lost}

## flags | flags.parquet | run
Which were seen.
--
run
seen         bool   whether {curly} words stay words here
"""


def test_rows_of_text_are_the_tables_that_they_say():
    run = Column("run", "int64", "number of the pass, from 1")
    place = tuple(Column(f"{axis}_mm", "float64", f"place, {axis}", True) for axis in "xyz")
    drives = tuple(Column(f"theta{k}", "float64", f"angle of drive {k}") for k in (1, 2))
    notes = tuple(Column(f"note_{letter}", "str", "see note") for letter in "ab")
    state = Column("state", "str", "what became of it", allowed=("ok", "lost"))
    number, seen = Column("point", "int64", "number"), Column("seen", "bool", "whether {curly} words stay words here")
    assert read_tables(_TEXT) == (
        Table(
            "paths",
            "tables/paths.parquet",
            "What was driven, point by point.",
            (run, *place, *drives, *notes, number, state),
            ("run", "point"),
        ),
        Table("flags", "flags.parquet", "Which were seen.", (run, seen), ("run",)),
    )
