"""The cells of a CSV or parquet file; every fault of the file itself shows before a number is looked at."""

import csv
import io
import re
from collections.abc import Sequence
from pathlib import Path

from rrru.campaign.ingest.problems import Problems

_SEPARATORS = {";": "semicolons", "\t": "tabs", "|": "bars", " ": "spaces"}
_SIGNATURES = (
    (b"PAR1", "a parquet file, whose extension is .parquet"),
    (b"PK\x03\x04", "a zip archive, which .xlsx and .ods files are"),
    (b"\xd0\xcf\x11\xe0", "an old Excel file (.xls)"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"\x89HDF", "an HDF5 file"),
    (b"%PDF", "a PDF"),
)
_UTF16 = (b"\xff\xfe", b"\xfe\xff")
_COMMA_SEPARATED = "comma-separated text in UTF-8 with decimal points and one header line"
_OTHER_ENCODING = f"{_COMMA_SEPARATED}; save the file again with the encoding UTF-8"
_TWO_FIELDS = "; a decimal comma makes two fields of one number"


def read_cells(path: Path, problems: Problems) -> tuple[list[str], list[int], dict[str, Sequence]]:
    """Names of the file's columns, numbers of its rows, and {name: cells (n,)}."""
    suffix = path.suffix.lower()
    try:
        if not path.exists():
            problems.refuse_now(value="no such file", allowed="an existing .csv or .parquet file")
        if not path.is_file():
            value = "a directory" if path.is_dir() else "no regular file"
            problems.refuse_now(value=value, allowed="a .csv or .parquet file")
        if suffix not in (".csv", ".parquet"):
            allowed = ".csv or .parquet; a spreadsheet can be saved as .csv"
            problems.refuse_now(value=f"the extension {path.suffix!r}", allowed=allowed)
        data = path.read_bytes()
    except OSError as error:
        problems.refuse_now(value=error.strerror or str(error), allowed="a file that can be read")
    if suffix == ".parquet":
        return _parquet_cells(data, problems)
    names, rows, cells = _text_cells(data, problems)
    return names, rows, dict(zip(names, zip(*cells, strict=True), strict=True))


def _parquet_cells(data: bytes, problems: Problems) -> tuple[list[str], list[int], dict[str, Sequence]]:
    """As `read_cells` for a parquet file's bytes; the columns that pandas adds for its index are left out."""
    import pyarrow
    import pyarrow.parquet

    if not data.startswith(b"PAR1"):
        seen = _looks_like(data) or (f"text or other data ({data[:30]!r})" if data else "an empty file")
        problems.refuse_now(value=seen, allowed="a parquet file; comma-separated text has the extension .csv")
    try:
        table = pyarrow.parquet.ParquetFile(pyarrow.BufferReader(data)).read()
        names = [name for name in table.column_names if not re.fullmatch(r"__index_level_\d+__", name)]
        columns = zip(table.column_names, table.columns, strict=True)
        cells = {name: column.to_pylist() for name, column in columns if name in names}
    except (pyarrow.ArrowException, OSError, ValueError) as error:
        cause = str(error).strip().splitlines()[0]
        value = f"a damaged or truncated parquet file of {len(data)} bytes ({cause})"
        problems.refuse_now(value=value, allowed="a whole parquet file")
    if not table.num_rows:
        problems.refuse_now(value=f"columns ({', '.join(names)}) and no row", allowed="one row per measured point")
    return names, list(range(1, table.num_rows + 1)), cells


def _looks_like(data):
    """Name of the file format that the first bytes give away, or None."""
    return next((name for signature, name in _SIGNATURES if data.startswith(signature)), None)


def _text_cells(data, problems):
    """Names of the columns, numbers of the data rows and their cells (lists of text) of a CSV file's bytes.

    Rows with another number of fields than the header are noted and left out, as are empty lines at the end. Raises
    IngestError for anything but UTF-8 text with commas, a header line and at least one row.
    """
    text = _decode(data, problems)
    if not text.strip():
        problems.refuse_now(value="an empty file", allowed=_COMMA_SEPARATED)
    reader = csv.reader(io.StringIO(text.lstrip("\r\n"), newline=""), strict=True)
    try:
        names, *rows = ([cell.strip() for cell in row] for row in reader)
    except csv.Error as error:
        allowed = 'fields without quotes, or each quote closed: "line 1"'
        problems.refuse_now(value=f"line {reader.line_num}: {error}", allowed=allowed)
    _require_header(names, [len(row) for row in rows if row], problems)
    while rows and not any(rows[-1]):
        rows.pop()
    if not rows:
        value = f"a header ({', '.join(names)}) and no row"
        problems.refuse_now(value=value, allowed="one row per measured point below the header")
    whole = [number for number, row in enumerate(rows, start=1) if _is_whole(number, row, len(names), problems)]
    if not whole:
        problems.refuse()
    return names, whole, [rows[number - 1] for number in whole]


def _decode(data, problems):
    """Text of the bytes; a UTF-8 byte-order mark is accepted."""
    if known := _looks_like(data):
        problems.refuse_now(value=known, allowed=_COMMA_SEPARATED)
    head = data[:4096]
    if data.startswith(_UTF16) or b"\0" in head:
        wide = data.startswith(_UTF16) or head.count(b"\0") > len(head) // 4
        value = "UTF-16 or UTF-32" if wide else "binary data (a byte 0)"
        problems.refuse_now(value=value, allowed=_OTHER_ENCODING)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        value = f"byte 0x{data[error.start]:02x} in line {line}, which is not UTF-8"
        problems.refuse_now(value=value, allowed=_OTHER_ENCODING)
    before, zero, _ = text.partition("\0")
    if zero:
        problems.refuse_now(value=f"byte 0 in line {before.count(chr(10)) + 1}", allowed=_COMMA_SEPARATED)
    return text


def _require_header(names, widths, problems):
    """Refuse a first line that is no header or has another separator; `widths`: numbers of fields of the rows below."""
    for separator, word in _SEPARATORS.items():
        often = sum(name.count(separator) for name in names) >= len(names)
        if often and (separator != " " or {len(names), *widths} == {1}):
            remedy = f"pandas.read_csv(file, sep={separator!r}, decimal=',').to_csv(new_file, index=False)"
            allowed = f"commas between the fields and points as decimal marks; {remedy} writes such a file"
            problems.refuse_now(value=f"{word} between the fields", allowed=allowed)
    allowed = "a first line with the names of all columns, and nothing above it"
    if sum(map(_is_number, names)) > len(names) // 2:
        problems.refuse_now(value=f"a first line of values ({', '.join(names)})", allowed=allowed)
    if len(set(widths)) == 1 and widths[0] != len(names):
        value = f"a first line of {len(names)} fields ({', '.join(names[:5])}, ...) above rows of {widths[0]} fields"
        problems.refuse_now(value=value, allowed=allowed + _TWO_FIELDS)


def _is_number(text):
    """Whether a text reads as a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def _is_whole(number, row, width, problems):
    """Whether a row has as many fields as the header; others, and empty ones, are noted."""
    if not any(row):
        allowed = "one row per measured point: drop the row"
        problems.add("empty row", row=number, value="an empty row", allowed=allowed)
    elif len(row) != width:
        allowed = f"{width} fields as in the header{_TWO_FIELDS if len(row) > width else ''}"
        problems.add("ragged row", row=number, value=f"{len(row)} fields ({', '.join(row[:4])}, ...)", allowed=allowed)
    return any(row) and len(row) == width
