"""The cells of files with typed numbers: Excel workbooks and parquet."""

import io
import re
import warnings
from xml.etree.ElementTree import ParseError
from zipfile import BadZipFile
from zlib import error as ZlibError

from rrru.campaign.ingest.cells import Cells, looks_like, table

_BROKEN = (BadZipFile, ParseError, ZlibError, OSError, EOFError)
# what openpyxl raises where a part of a workbook is not what another part says
_INCONSISTENT = (KeyError, ValueError, TypeError, AttributeError, IndexError, AssertionError, NotImplementedError)


def parquet_cells(data, problems):
    """Cells of a parquet file's bytes; the columns that pandas adds for its index are left out."""
    import pyarrow
    import pyarrow.parquet

    if not data.startswith(b"PAR1"):
        seen = looks_like(data) or (f"text or other data ({data[:30]!r})" if data else "an empty file")
        problems.refuse_now(value=seen, allowed="a parquet file; comma-separated text has the extension .csv")
    try:
        frame = pyarrow.parquet.ParquetFile(pyarrow.BufferReader(data)).read()
        names = [name for name in frame.column_names if not re.fullmatch(r"__index_level_\d+__", name)]
        columns = zip(frame.column_names, frame.columns, strict=True)
        cells = {name: column.to_pylist() for name, column in columns if name in names}
    except (pyarrow.ArrowException, OSError, ValueError) as error:
        cause = str(error).strip().splitlines()[0]
        value = f"a damaged or truncated parquet file of {len(data)} bytes ({cause})"
        problems.refuse_now(value=value, allowed="a whole parquet file")
    if not frame.num_rows:
        problems.refuse_now(value=f"columns ({', '.join(names)}) and no row", allowed="one row per measured point")
    return Cells(names, list(range(1, frame.num_rows + 1)), cells)


def xlsx_cells(data, problems, sheet=None):
    """Cells of a workbook's bytes: those of the named sheet, or of the only one that holds anything."""
    from openpyxl import load_workbook
    from openpyxl.utils.exceptions import InvalidFileException

    if not data.startswith(b"PK\x03\x04"):
        seen = looks_like(data) or (f"text or other data ({data[:30]!r})" if data else "an empty file")
        problems.refuse_now(value=seen, allowed="an .xlsx workbook")
    try:
        with warnings.catch_warnings(action="ignore"):
            book = load_workbook(io.BytesIO(data), data_only=True)
            filled = {one.title: _rows(one) for one in book.worksheets}
    except (*_BROKEN, *_INCONSISTENT, InvalidFileException) as error:
        value = f"a damaged workbook of {len(data)} bytes ({type(error).__name__}: {error})"
        problems.refuse_now(value=value, allowed="a whole .xlsx workbook; save it again")
    filled = {title: rows for title, rows in filled.items() if rows or title == sheet}
    if sheet is None and len(filled) == 1:
        sheet = next(iter(filled))
    if sheet not in filled:
        value = f"the sheets {', '.join(map(repr, filled))}" if filled else "a workbook without any cell"
        allowed = "one sheet: format: {kind: xlsx, sheet: " + (next(iter(filled), "its name")) + "}"
        problems.refuse_now(value=value if sheet is None else f"{value}, no {sheet!r}", allowed=allowed)
    if not filled[sheet]:
        problems.refuse_now(value=f"the sheet {sheet!r}, which is empty", allowed="a header and one row per point")
    names, *rows = filled[sheet]
    first = 2 + next(i for i, row in enumerate(book[sheet].iter_rows(values_only=True)) if any(map(_filled, row)))
    names = ["" if name is None else str(name).strip() for name in names]
    return table(names, rows, range(first, first + len(rows)), problems)


def _rows(sheet):
    """Rows of a sheet's cells from its first row that holds any, without empty columns at its right end."""
    rows = [list(row) for row in sheet.iter_rows(values_only=True)]
    rows = rows[next((i for i, row in enumerate(rows) if any(_filled(cell) for cell in row)), len(rows)) :]
    last = max((k + 1 for row in rows for k, cell in enumerate(row) if _filled(cell)), default=0)
    return [row[:last] for row in rows]


def _filled(cell):
    """Whether a cell is not empty."""
    return cell is not None and str(cell).strip() != ""
