"""Result tables on disk: parquet with a schema that is checked on writing; a table is either whole or absent."""

from pathlib import Path

import pandera.errors
import pyarrow as arrow
import pyarrow.parquet as parquet

from rrru.errors import TableError
from rrru.store.schemas import TABLES

_ARROW = {"int64": arrow.int64(), "float64": arrow.float64(), "str": arrow.string(), "bool": arrow.bool_()}


def columns(name):
    """Names of a table's columns in order."""
    return [column.name for column in TABLES[name].columns]


def check(name, frame):
    """The frame with its columns in the schema's order; raises TableError naming the columns and values that do not
    fit.
    """
    table = TABLES[name]
    try:
        checked = table.pandera().validate(frame, lazy=True)
    except (pandera.errors.SchemaErrors, pandera.errors.SchemaError) as error:
        cases = getattr(error, "failure_cases", error)
        raise TableError(f"table {name} does not fit its schema:\n{cases}") from None
    return checked[[column.name for column in table.columns]].reset_index(drop=True)


def write(name, frame, path):
    """Write a frame as the named table: checked, typed, to a temporary file first and then moved into place."""
    table = TABLES[name]
    frame = check(name, frame)
    schema = arrow.schema([arrow.field(c.name, _ARROW[c.kind], c.nullable) for c in table.columns])
    data = arrow.Table.from_pandas(frame, schema=schema, preserve_index=False, safe=True).replace_schema_metadata(None)
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.parent / f".{path.name}.partial"
    try:
        parquet.write_table(data, partial, compression="zstd")
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def read(path):
    """The table at a path as a frame."""
    return parquet.read_table(path).to_pandas()
