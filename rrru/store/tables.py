"""Result tables on disk: parquet with a schema that is checked on writing; a table is either whole or absent."""

from collections.abc import Iterable, Mapping
from pathlib import Path

import pandas as pd
import pyarrow as arrow
import pyarrow.parquet as parquet

from rrru.errors import TableError
from rrru.store.schema import Column, Table
from rrru.store.whole import whole

_ARROW = {"int64": arrow.int64(), "float64": arrow.float64(), "str": arrow.string(), "bool": arrow.bool_()}


def check(table: Table, frame: pd.DataFrame) -> pd.DataFrame:
    """The frame with its columns in the order of a `Table`; raises TableError naming what does not fit."""
    if _fits(table, frame):
        return frame[table.names].reset_index(drop=True)
    # it makes what can be made to fit so, and names what cannot; loading it takes longer than most tables
    import pandera.errors

    try:
        checked = table.pandera().validate(frame, lazy=True)
    except (pandera.errors.SchemaErrors, pandera.errors.SchemaError) as error:
        cases = getattr(error, "failure_cases", error)
        raise TableError(f"table {table.name} does not fit its schema:\n{cases}") from None
    return checked[table.names].reset_index(drop=True)


def _fits(table: Table, frame: pd.DataFrame) -> bool:
    """Whether a frame is what its schema asks for as it stands."""
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
    frame = check(table, frame)
    schema = arrow.schema([arrow.field(c.name, _ARROW[c.kind], c.nullable) for c in table.columns])
    data = arrow.Table.from_pandas(frame, schema=schema, preserve_index=False, safe=True).replace_schema_metadata(None)
    _write(data, path)


def write_all(tables: Iterable[Table], frames: Mapping[str, pd.DataFrame], paths: Mapping[str, str]) -> None:
    """Write frames by table name, each to paths[name], as the ones of the `tables` with these names."""
    known = {table.name: table for table in tables}
    for name, frame in frames.items():
        write(known[name], frame, paths[name])


def read(path: str | Path) -> pd.DataFrame:
    """The table at a path as a frame."""
    return parquet.read_table(path).to_pandas()


def gather(paths: Iterable[str | Path], path: str | Path) -> None:
    """Write the tables of one schema at paths as one table, one below the other."""
    _write(arrow.concat_tables([parquet.read_table(part) for part in paths]).combine_chunks(), path)


def _write(data: arrow.Table, path: str | Path) -> None:
    """Write an Arrow table so that the file is there as a whole or not at all."""
    with whole(path) as (partial,):
        parquet.write_table(data, partial, compression="zstd")
