"""Result tables on disk: parquet with a schema that is checked on writing; a table is either complete or absent."""

from collections.abc import Iterable, Iterator, Mapping
from itertools import chain
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as arrow
import pyarrow.parquet as parquet

from rrru.errors import TableError
from rrru.store.atomic_write import whole
from rrru.store.schema import Column, Table

_ARROW = {"int64": arrow.int64(), "float64": arrow.float64(), "str": arrow.string(), "bool": arrow.bool_()}
# of one row group of a file, Parquet's own default
_GROUP_ROWS = 1024 * 1024


def check(table: Table, frame: pd.DataFrame) -> pd.DataFrame:
    """The frame with its columns in the order of a `Table`; raises TableError naming what does not fit."""
    if _fits(table, frame):
        return frame[table.names].reset_index(drop=True)
    # pandera converts values where possible and names those that do not fit; loading it takes longer than most tables
    import pandera.errors

    try:
        checked = table.pandera().validate(frame, lazy=True)
    except (pandera.errors.SchemaErrors, pandera.errors.SchemaError) as error:
        cases = getattr(error, "failure_cases", error)
        raise TableError(f"table {table.name} does not fit its schema:\n{cases}") from None
    return checked[table.names].reset_index(drop=True)


def _fits(table: Table, frame: pd.DataFrame) -> bool:
    """Whether a frame fits its schema without any conversion."""
    if sorted(frame.columns) != sorted(table.names) or not all(_typed(c, frame[c.name]) for c in table.columns):
        return False
    return not (table.key and frame.duplicated(list(table.key)).any())


def _typed(column: Column, values: pd.Series) -> bool:
    """Whether values have their column's type and are among those that it allows; a text that is null counts as not."""
    if values.empty:
        return True
    is_text = column.kind == "str"
    if is_text and pd.api.types.infer_dtype(values, skipna=False) != "string":
        return False
    if not is_text and values.dtype != column.kind:
        return False
    if not column.nullable and values.isna().any():
        return False
    return not column.allowed or bool(values.dropna().isin(column.allowed).all())


def write(table: Table, frame: pd.DataFrame, path: str | Path) -> None:
    """Write a frame as a `Table`: checked, typed, to a temporary file first and then moved into place."""
    gather([typed(table, frame)], path)


def typed(table: Table, frame: pd.DataFrame) -> arrow.Table:
    """A frame as the Arrow table of a `Table`'s file, checked."""
    frame = check(table, frame)
    schema = arrow.schema([arrow.field(c.name, _ARROW[c.kind], c.nullable) for c in table.columns])
    return arrow.Table.from_pandas(frame, schema=schema, preserve_index=False, safe=True).replace_schema_metadata(None)


def check_keys(table: Table, path: str | Path) -> None:
    """Raise TableError where two rows of a gathered `Table` at a path have the same key; only that is loaded."""
    keys = read(path, columns=list(table.key))
    if (again := keys.duplicated()).any():
        raise TableError(f"table {table.name}: {keys[again].iloc[0].to_dict()} is there more than once")


def write_all(tables: Iterable[Table], frames: Mapping[str, pd.DataFrame], paths: Mapping[str, str]) -> None:
    """Write frames by table name, each to paths[name], as the ones of the `tables` with these names."""
    known = {table.name: table for table in tables}
    for name, frame in frames.items():
        write(known[name], frame, paths[name])


def read(
    paths: str | Path | list[str], columns: list[str] | None = None, rows: list[Any] | None = None
) -> pd.DataFrame:
    """The table at a path as a frame, or those of one schema at paths, one below the other.

    columns: these alone; rows: (column, operator, value) that all have to hold, or lists of them of which one has to.
    Other columns and rows are hardly loaded at all.
    """
    return parquet.read_table(paths, columns=columns, filters=rows).to_pandas()


def gather(parts: Iterable[str | Path | arrow.Table], path: str | Path) -> None:
    """Write tables of one schema, at paths or as `typed` gives them, as one table, one below the other.

    However many they are, no more than a group of rows and one of them are loaded at a time.
    """
    loaded = (part if isinstance(part, arrow.Table) else parquet.read_table(part) for part in parts)
    first = next(loaded)
    with whole(path) as (partial,), parquet.ParquetWriter(partial, first.schema, compression="zstd") as writer:
        for group in _groups(chain([first], loaded)):
            writer.write_table(group, _GROUP_ROWS)


def _groups(parts: Iterable[arrow.Table]) -> Iterator[arrow.Table]:
    """Tables one below the other, cut into groups of rows; the last one has the remaining rows, or none."""
    held: list[arrow.Table] = []
    count = 0
    for part in parts:
        held.append(part)
        count += part.num_rows
        while count > _GROUP_ROWS:
            joined = arrow.concat_tables(held)
            yield joined.slice(0, _GROUP_ROWS).combine_chunks()
            held, count = [joined.slice(_GROUP_ROWS)], count - _GROUP_ROWS
    yield arrow.concat_tables(held).combine_chunks()
