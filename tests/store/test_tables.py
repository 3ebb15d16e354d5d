"""Result tables: typed, checked, whole or absent, and described."""

import numpy as np
import pandas as pd
import pyarrow
import pyarrow.parquet as parquet
import pytest

from rrru.errors import TableError, WriteError
from rrru.store import tables
from rrru.studies import glossary
from tests.places import ROOT
from tests.schemas import TABLES

_ROWS = pd.DataFrame(
    {
        "campaign": ["a", "a"],
        "calibration": ["x", "x"],
        "parameter_a": ["p", "p"],
        "parameter_b": ["q", "s"],
        "correlation": [0.5, np.nan],
    }
)


def test_round_trip_keeps_values_types_and_nulls(tmp_path):
    path = tmp_path / "deep" / "t.parquet"
    tables.write(TABLES["correlations"], _ROWS[list(_ROWS)[::-1]], path)
    pd.testing.assert_frame_equal(tables.read(path), _ROWS, check_dtype=False)
    schema = parquet.read_schema(path)
    assert [str(t) for t in schema.types] == ["string"] * 4 + ["double"] and schema.names == TABLES[
        "correlations"
    ].names
    assert parquet.read_table(path)["correlation"].null_count == 1


def test_same_frame_same_bytes(tmp_path):
    for name in ("a", "b"):
        tables.write(TABLES["correlations"], _ROWS, tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda f: f.drop(columns="correlation"), "correlation"),
        (lambda f: f.assign(extra=1.0), "extra"),
        (lambda f: f.assign(correlation="high"), "correlation"),
        (lambda f: f.assign(campaign=None), "campaign"),
        (lambda f: f.assign(parameter_b="q"), "parameter_b"),
    ],
)
def test_what_does_not_fit_is_refused_and_named(tmp_path, change, message):
    with pytest.raises(TableError, match=message):
        tables.write(TABLES["correlations"], change(_ROWS), tmp_path / "t.parquet")
    assert list(tmp_path.iterdir()) == []


def test_a_failed_write_leaves_the_old_table_and_nothing_else(tmp_path, monkeypatch):
    path = tmp_path / "t.parquet"
    tables.write(TABLES["correlations"], _ROWS, path)
    before = path.read_bytes()

    def broken(writer, *rows):
        raise OSError("disk full")

    monkeypatch.setattr(parquet.ParquetWriter, "write_table", broken)
    with pytest.raises(WriteError, match=r"t.parquet: cannot be written \(disk full\)"):
        tables.write(TABLES["correlations"], _ROWS.assign(correlation=0.1), path)
    assert path.read_bytes() == before and [p.name for p in tmp_path.iterdir()] == ["t.parquet"]


def _numbered(folder, counts):
    """Paths of tables of so many rows each, all rows different, and those rows."""
    rows = pd.DataFrame({"campaign": [f"c{k:03d}" for k in range(sum(counts))], "calibration": "x"})
    rows = rows.assign(parameter_a="p", parameter_b="q", correlation=np.linspace(0.0, 1.0, len(rows)))
    paths = [folder / f"{k}.parquet" for k in range(len(counts))]
    for path, first, count in zip(paths, np.cumsum([0, *counts]), counts, strict=False):
        tables.write(TABLES["correlations"], rows.iloc[first : first + count], path)
    return list(map(str, paths)), rows


def test_gathered_rows_of_one_key_are_refused(tmp_path):
    table, path = TABLES["correlations"], tmp_path / "t.parquet"
    parts = [tables.typed(table, _ROWS.iloc[[row]]) for row in (0, 1)]
    tables.gather(parts, path)
    tables.check_keys(table, path)
    tables.gather([*parts, parts[0]], path)
    with pytest.raises(TableError, match=r"correlations: .*'parameter_b': 'q'.* more than once"):
        tables.check_keys(table, path)


@pytest.mark.parametrize("counts", [[3], [3, 0, 4], [5, 5], [10, 1], [0, 0], [2] * 9, [17]])
@pytest.mark.parametrize("group", [5, 1000])
def test_gathered_parts_are_the_bytes_of_one_table(tmp_path, monkeypatch, counts, group):
    """For any parts and rows of a group, compared with pyarrow writing everything at once."""
    monkeypatch.setattr(tables, "_GROUP_ROWS", group)
    paths, rows = _numbered(tmp_path, counts)
    last = tables.typed(TABLES["correlations"], rows.head(1).assign(campaign="last"))
    tables.gather([*paths, last], tmp_path / "all.parquet")
    parts = pyarrow.concat_tables([*map(parquet.read_table, paths), last]).combine_chunks()
    parquet.write_table(parts, tmp_path / "once.parquet", row_group_size=group, compression="zstd")
    assert (tmp_path / "all.parquet").read_bytes() == (tmp_path / "once.parquet").read_bytes()


def test_reading_of_many_tables_takes_rows_and_columns_in_order(tmp_path):
    paths, rows = _numbered(tmp_path, [4, 3, 5])
    pd.testing.assert_frame_equal(tables.read(paths), rows, check_dtype=False)
    some = tables.read(paths, columns=["correlation"], rows=[("campaign", "in", ["c009", "c002"])])
    pd.testing.assert_frame_equal(some, rows.loc[[2, 9], ["correlation"]].reset_index(drop=True))


def test_the_glossary_describes_every_table_and_column():
    text = (ROOT / "results" / "README.md").read_text()
    assert text == glossary.text(), "run `python -m rrru.studies.glossary`"
    for table in TABLES.values():
        assert table.path in text and all(f"`{column.name}`" in text for column in table.columns)


def test_who_reads_a_table_while_it_is_written_anew_reads_the_old_one(tmp_path):
    path = tmp_path / "t.parquet"
    tables.write(TABLES["correlations"], _ROWS, path)
    before = path.read_bytes()
    with path.open("rb") as reader:
        tables.write(TABLES["correlations"], _ROWS.assign(correlation=0.1), path)
        assert reader.read() == before
    assert path.read_bytes() != before
