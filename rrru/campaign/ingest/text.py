"""The cells of a comma-separated file as text, with every fault of the file itself found before a number is looked
at.
"""

import csv
import io

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


def looks_like(data):
    """Name of the file format that the first bytes give away, or None."""
    return next((name for signature, name in _SIGNATURES if data.startswith(signature)), None)


def text_cells(data, problems):
    """Names of the columns, numbers of the data rows and their cells (lists of text) of a CSV file's bytes.

    Rows with another number of fields than the header are noted and left out, as are empty lines at the end. Raises
    IngestError for anything but UTF-8 text with commas, a header line and at least one row.
    """
    text = _decode(data, problems)
    if not text.strip():
        problems.refuse_now(value="an empty file", allowed=_COMMA_SEPARATED)
    rows = _rows(text, problems)
    names = [name.strip() for name in rows[0]]
    _require_header(names, [len(row) for row in rows[1:] if row], problems)
    cells = [[cell.strip() for cell in row] for row in rows[1:]]
    while cells and not any(cells[-1]):
        cells.pop()
    if not cells:
        problems.refuse_now(
            value=f"a header ({', '.join(names)}) and no row", allowed="one row per measured point below the header"
        )
    whole = _whole_rows(names, cells, problems)
    if not whole:
        problems.refuse()
    return names, [number for number, _ in whole], [row for _, row in whole]


def _decode(data, problems):
    """Text of the bytes; a UTF-8 byte-order mark is accepted."""
    known = looks_like(data)
    if known:
        problems.refuse_now(value=known, allowed=_COMMA_SEPARATED)
    if data.startswith(_UTF16) or b"\0" in data[:4096]:
        wide = data.startswith(_UTF16) or data[:4096].count(b"\0") > len(data[:4096]) // 4
        encoding = "UTF-16 or UTF-32" if wide else "binary data (a byte 0)"
        problems.refuse_now(value=encoding, allowed=f"{_COMMA_SEPARATED}; save the file again with the encoding UTF-8")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        value = f"byte 0x{data[error.start]:02x} in line {line}, which is not UTF-8"
        problems.refuse_now(value=value, allowed=f"{_COMMA_SEPARATED}; save the file again with the encoding UTF-8")
    if "\0" in text:
        problems.refuse_now(
            value=f"byte 0 in line {text.count(chr(10), 0, text.index(chr(0))) + 1}", allowed=_COMMA_SEPARATED
        )
    return text


def _rows(text, problems):
    """All records from the header on; lines before the header that are empty are left out."""
    reader = csv.reader(io.StringIO(text.lstrip("\r\n"), newline=""), strict=True)
    try:
        return list(reader)
    except csv.Error as error:
        problems.refuse_now(
            value=f"line {reader.line_num}: {error}", allowed='fields without quotes, or each quote closed: "line 1"'
        )


def _require_header(names, widths, problems):
    """Refuse a first line that is no header, or that has another separator; `widths` are the numbers of fields of the
    rows below.
    """
    for separator, word in _SEPARATORS.items():
        if sum(name.count(separator) for name in names) >= len(names) and (
            separator != " " or {len(names), *widths} == {1}
        ):
            allowed = (
                "commas between the fields and points as decimal marks; "
                f"pandas.read_csv(file, sep={separator!r}, decimal=',').to_csv(new_file, index=False) writes such a file"
            )
            problems.refuse_now(value=f"{word} between the fields", allowed=allowed)
    allowed = "a first line with the names of all columns, and nothing above it"
    if sum(map(_is_number, names)) > len(names) // 2:
        problems.refuse_now(value=f"a first line of values ({', '.join(names)})", allowed=allowed)
    if len(set(widths)) == 1 and widths[0] != len(names):
        value = f"a first line of {len(names)} fields ({', '.join(names[:5])}, ...) above rows of {widths[0]} fields"
        problems.refuse_now(value=value, allowed=f"{allowed}; a decimal comma makes two fields of one number")


def _is_number(text):
    """Whether a text reads as a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def _whole_rows(names, cells, problems):
    """Numbered rows with as many fields as the header; the others, and empty rows between them, are noted."""
    whole = []
    for number, row in enumerate(cells, start=1):
        if not any(row):
            problems.add(
                "empty row", row=number, value="an empty row", allowed="one row per measured point: drop the row"
            )
        elif len(row) != len(names):
            allowed = f"{len(names)} fields as in the header"
            if len(row) > len(names):
                allowed += "; a decimal comma makes two fields of one number"
            problems.add(
                "ragged row", row=number, value=f"{len(row)} fields ({', '.join(row[:4])}, ...)", allowed=allowed
            )
        else:
            whole.append((number, row))
    return whole
