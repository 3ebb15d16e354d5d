"""The cells of a file: text, an Excel workbook or parquet. Every fault of the file itself shows before its numbers."""

import csv
import io
import json
import re
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date, time
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias
from xml.etree.ElementTree import ParseError
from zipfile import BadZipFile
from zlib import error as ZlibError

from rrru.campaign.ingest.problems import Problems

if TYPE_CHECKING:
    from openpyxl.worksheet.worksheet import Worksheet

_SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "bars", " ": "spaces"}
_SIGNATURES = (
    (b"PAR1", "a parquet file, whose extension is .parquet"),
    (b"PK\x03\x04", "a zip archive, which .xlsx and .ods files are"),
    (b"\xd0\xcf\x11\xe0", "an old Excel file (.xls)"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"\x89HDF", "an HDF5 file"),
    (b"%PDF", "a PDF"),
)
_UTF16 = (b"\xff\xfe", b"\xfe\xff")
_TEXT = "comma-separated text in UTF-8 with decimal points and one header line"
_OTHER_ENCODING = f"{_TEXT}; save the file again with the encoding UTF-8"
_DECIMAL_COMMA_HINT = "; a decimal comma makes two fields of one number"

_BROKEN = (BadZipFile, ParseError, ZlibError, OSError, EOFError)
# what openpyxl raises where parts of a workbook contradict each other
_INCONSISTENT = (KeyError, ValueError, TypeError, AttributeError, IndexError, AssertionError, NotImplementedError)


# a cell as its file's format gives it, None where it is blank
Cell: TypeAlias = str | float | int | bool | Decimal | date | time | None


@dataclass(frozen=True)
class Cells:
    """Cells of a file: names of its columns, numbers of its n rows as an editor shows them, {name: cells (n,)}.

    means: our name to the file's name of the columns that the format defines; factors: by column from the unit that the
    file states to mm; spreads: by column from expanded uncertainty to standard deviation; commas: columns with decimal
    commas; unused: columns that the format defines and nothing needs; added: columns that the file does not have;
    notes: what the user should know.
    """

    names: list[str]
    rows: list[int]
    cells: Mapping[str, Sequence[Cell]]
    means: Mapping[str, str] = field(default_factory=dict)
    factors: Mapping[str, float] = field(default_factory=dict)
    spreads: Mapping[str, float] = field(default_factory=dict)
    commas: frozenset[str] = frozenset()
    unused: tuple[str, ...] = ()
    added: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def read_bytes(path: Path, problems: Problems) -> bytes:
    """The bytes of a file; raises IngestError where it cannot be read."""
    try:
        if not path.exists():
            problems.refuse_now(value="no such file", allowed="an existing file of measurements")
        if not path.is_file():
            value = "a directory" if path.is_dir() else "no regular file"
            problems.refuse_now(value=value, allowed="a file of measurements")
        return path.read_bytes()
    except OSError as error:
        problems.refuse_now(value=error.strerror or str(error), allowed="a file that can be read")


def looks_like(data: bytes) -> str | None:
    """Name of the file format that the first bytes identify, or None."""
    return next((name for signature, name in _SIGNATURES if data.startswith(signature)), None)


def _actual_format(data: bytes) -> str:
    """What a file holds that is not of the expected format, in words."""
    return looks_like(data) or (f"text or other data ({data[:30]!r})" if data else "an empty file")


def text_cells(data: bytes, problems: Problems, separator: str | None = None, decimal: str = ".") -> Cells:
    """Cells of a CSV file's bytes.

    Rows with another number of fields than the header are noted and left out, as are empty lines at the end. Raises
    IngestError for anything but UTF-8 text with the separator, a header line and at least one row.
    """
    (names, *rows), (_, *lines) = fields(decode(data, problems), separator or ",", problems)
    _require_header(names, rows, separator or ",", problems)
    return table(names, rows, lines, problems, decimal)


def fields(text: str, separator: str, problems: Problems) -> tuple[list[list[str]], list[int]]:
    """Stripped fields of each row of a text, and the number of the line in which each begins."""
    body = text.lstrip("\r\n")
    reader = csv.reader(io.StringIO(body, newline=""), strict=True, delimiter=separator)
    above = len(text[: len(text) - len(body)].splitlines())
    rows, lines, line = [], [], above + 1
    try:
        for row in reader:
            rows.append([cell.strip() for cell in row])
            lines.append(line)
            line = above + reader.line_num + 1
    except csv.Error as error:
        allowed = 'fields without quotes, or each quote closed: "line 1"'
        problems.refuse_now(value=f"line {above + reader.line_num}: {error}", allowed=allowed)
    return rows, lines


def table(
    names: list[str],
    rows: Sequence[Sequence[Cell]],
    numbers: Iterable[int],
    problems: Problems,
    decimal: str = ".",
) -> Cells:
    """Cells of rows of fields below the names of the columns; numbers: of the rows, as an editor shows them."""
    while rows and not any(map(_filled, rows[-1])):
        rows = rows[:-1]
    if not rows:
        value = f"a header ({', '.join(names)}) and no row"
        problems.refuse_now(value=value, allowed="one row per measured point below the header")
    numbered = zip(numbers, rows, strict=False)
    complete = [(number, row) for number, row in numbered if _is_complete(number, row, len(names), problems)]
    if not complete:
        problems.refuse()
    columns = zip(*(row for _, row in complete), strict=True)
    commas = frozenset(names if decimal == "," else ())
    return Cells(names, [number for number, _ in complete], dict(zip(names, columns, strict=True)), commas=commas)


def decode(data: bytes, problems: Problems, allowed: str = _TEXT, others: Sequence[str] = ()) -> str:
    """Text of the bytes; a UTF-8 byte-order mark is accepted. others: encodings that are tried besides UTF-8."""
    if known := looks_like(data):
        problems.refuse_now(value=known, allowed=allowed)
    wide = data.startswith(_UTF16)
    if not (wide and "utf-16" in others) and (wide or b"\0" in data[:4096]):
        head = data[:4096]
        value = "UTF-16 or UTF-32" if wide or head.count(b"\0") > len(head) // 4 else "binary data (a byte 0)"
        problems.refuse_now(value=value, allowed=_OTHER_ENCODING)
    encodings = ["utf-16"] if wide else ["utf-8-sig", *(one for one in others if one != "utf-16")]
    for encoding in encodings:
        try:
            text = data.decode(encoding)
            break
        except UnicodeDecodeError as error:
            line = data.count(b"\n", 0, error.start) + 1
            value = f"byte 0x{data[error.start]:02x} in line {line}, which is not UTF-{16 if wide else 8}"
    else:
        problems.refuse_now(value=value, allowed=_OTHER_ENCODING)
    # a byte-order mark may be all that a file holds
    if not text.strip():
        problems.refuse_now(value="an empty file", allowed=allowed)
    before, zero, _ = text.partition("\0")
    if zero:
        problems.refuse_now(value=f"byte 0 in line {before.count(chr(10)) + 1}", allowed=allowed)
    return text


def separator_of(lines: Sequence[str], decimal: str = ".") -> str:
    """The separator that the first of some lines has, " " where it has none of the usual ones."""
    first = lines[0] if lines else ""
    return next((one for one in ";\t,|" if one in first and one != decimal), " ")


def declared(separator: str, text: str) -> str:
    """The line of the configuration that states a separator other than a comma."""
    decimal = ', decimal: ","' if separator != "," and re.search(r"\d,\d", text) else ""
    return f"format: {{kind: csv, separator: {json.dumps(separator)}{decimal}}}"


def _require_header(names: list[str], rows: Sequence[Sequence[str]], separator: str, problems: Problems) -> None:
    """Refuse a first line that is no header or has another separator."""
    widths = [len(row) for row in rows if row]
    for other, word in _SEPARATORS.items():
        often = sum(name.count(other) for name in names) >= len(names)
        if other != separator and often and (other != " " or {len(names), *widths} == {1}):
            advice = declared(other, ";".join(separator.join(row) for row in rows[:20]))
            allowed = f"{_SEPARATORS.get(separator, repr(separator))} between the fields, or stated: {advice}"
            problems.refuse_now(value=f"{word} between the fields", allowed=allowed)
    allowed = "a first line with the names of all columns, and nothing above it"
    if sum(map(_is_number, names)) > len(names) // 2:
        problems.refuse_now(value=f"a first line of values ({', '.join(names)})", allowed=allowed)
    if len(set(widths)) == 1 and widths[0] != len(names):
        value = f"a first line of {len(names)} fields ({', '.join(names[:5])}, ...) above rows of {widths[0]} fields"
        problems.refuse_now(value=value, allowed=allowed + _DECIMAL_COMMA_HINT)


def _is_number(text: str) -> bool:
    """Whether a text reads as a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def _filled(cell: Cell) -> bool:
    """Whether a cell is not empty."""
    return cell is not None and cell != ""


def _is_complete(number: int, row: Sequence[Cell], width: int, problems: Problems) -> bool:
    """Whether a row has as many fields as the header; others, and empty ones, are noted."""
    filled = any(map(_filled, row))
    if not filled:
        allowed = "one row per measured point: drop the row"
        problems.add("empty row", row=number, value="an empty row", allowed=allowed)
    elif len(row) != width:
        allowed = f"{width} fields as in the header{_DECIMAL_COMMA_HINT if len(row) > width else ''}"
        shown = ", ".join(map(str, row[:4]))
        problems.add("ragged row", row=number, value=f"{len(row)} fields ({shown}, ...)", allowed=allowed)
    return filled and len(row) == width


def parquet_cells(data: bytes, problems: Problems) -> Cells:
    """Cells of a parquet file's bytes; the columns that pandas adds for its index are left out."""
    import pyarrow
    import pyarrow.parquet

    if not data.startswith(b"PAR1"):
        allowed = "a parquet file; comma-separated text has the extension .csv"
        problems.refuse_now(value=_actual_format(data), allowed=allowed)
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


def xlsx_cells(data: bytes, problems: Problems, sheet: str | None = None) -> Cells:
    """Cells of a workbook's bytes: those of the named sheet, or of the only one that holds anything."""
    from openpyxl import load_workbook
    from openpyxl.utils.exceptions import InvalidFileException

    if not data.startswith(b"PK\x03\x04"):
        problems.refuse_now(value=_actual_format(data), allowed="an .xlsx workbook")
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
    header, *rows = filled[sheet]
    first = 2 + next(i for i, row in enumerate(book[sheet].iter_rows(values_only=True)) if any(map(_holds_value, row)))
    names = ["" if name is None else str(name).strip() for name in header]
    return table(names, rows, range(first, first + len(rows)), problems)


def _rows(sheet: "Worksheet") -> list[list[Cell]]:
    """Rows of a sheet's cells from its first row that holds any, without empty columns at its right end."""
    rows = [list(row) for row in sheet.iter_rows(values_only=True)]
    rows = rows[next((i for i, row in enumerate(rows) if any(_holds_value(cell) for cell in row)), len(rows)) :]
    last = max((k + 1 for row in rows for k, cell in enumerate(row) if _holds_value(cell)), default=0)
    return [row[:last] for row in rows]


def _holds_value(cell: Cell) -> bool:
    """Whether a cell of a workbook holds more than spaces."""
    return cell is not None and str(cell).strip() != ""
