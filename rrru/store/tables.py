"""Result tables on disk: parquet with a schema that is checked on writing; a table is either whole or absent."""

from pathlib import Path

import pyarrow as arrow
import pyarrow.parquet as parquet

from rrru.errors import TableError

_ARROW = {"int64": arrow.int64(), "float64": arrow.float64(), "str": arrow.string(), "bool": arrow.bool_()}


def check(table, frame):
    """The frame with its columns in the order of a `Table`; raises TableError naming what does not fit."""
    import pandera.errors

    try:
        checked = table.pandera().validate(frame, lazy=True)
    except (pandera.errors.SchemaErrors, pandera.errors.SchemaError) as error:
        cases = getattr(error, "failure_cases", error)
        raise TableError(f"table {table.name} does not fit its schema:\n{cases}") from None
    return checked[table.names].reset_index(drop=True)


def write(table, frame, path):
    """Write a frame as a `Table`: checked, typed, to a temporary file first and then moved into place."""
    frame = check(table, frame)
    schema = arrow.schema([arrow.field(c.name, _ARROW[c.kind], c.nullable) for c in table.columns])
    data = arrow.Table.from_pandas(frame, schema=schema, preserve_index=False, safe=True).replace_schema_metadata(None)
    _write(data, path)


def write_all(tables, frames, paths):
    """Write frames by table name, each to paths[name], as the ones of the `tables` with these names."""
    known = {table.name: table for table in tables}
    for name, frame in frames.items():
        write(known[name], frame, paths[name])


def read(path):
    """The table at a path as a frame."""
    return parquet.read_table(path).to_pandas()


def gather(paths, path):
    """Write the tables of one schema at paths as one table, one below the other."""
    _write(arrow.concat_tables([parquet.read_table(part) for part in paths]).combine_chunks(), path)


def _write(data, path):
    """Write an Arrow table so that the file is there as a whole or not at all."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.parent / f".{path.name}.partial"
    try:
        parquet.write_table(data, partial, compression="zstd")
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
