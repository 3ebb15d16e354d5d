"""The formats of measurement files: which one a file has, and its cells read in it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from rrru.campaign.ingest.cells import Cells, parquet_cells, read_bytes, text_cells, xlsx_cells
from rrru.campaign.ingest.problems import Problems
from rrru.campaign.ingest.trackers import leica_cells, spatial_analyzer_cells
from rrru.errors import ConfigError

# by kind the reader of a file's bytes and the fields of Format that it takes
_READERS: dict[str, tuple[Callable[..., Cells], tuple[str, ...]]] = {
    "csv": (text_cells, ("separator", "decimal")),
    "leica": (leica_cells, ("separator", "decimal")),
    "spatial_analyzer": (spatial_analyzer_cells, ("separator", "decimal")),
    "xlsx": (xlsx_cells, ("sheet",)),
    "parquet": (parquet_cells, ()),
}
KINDS = tuple(_READERS)
# kinds by the file's extension
_EXTENSIONS = {".csv": "csv", ".parquet": "parquet", ".xlsx": "xlsx"}


@dataclass(frozen=True)
class Format:
    """Format of a file; raises ConfigError for a value that is not allowed.

    kind: one of KINDS; None: that of the file's extension.
    separator: between the fields of a text; None: a comma in a CSV file, in a tracker's point list what the list has.
    decimal: "." or ",".
    sheet: name of a workbook's sheet; None for a workbook with a single one.
    """

    kind: str | None = None
    separator: str | None = None
    decimal: str = "."
    sheet: str | None = None

    def __post_init__(self) -> None:
        if self.kind is not None and self.kind not in KINDS:
            raise ConfigError(f"format is {self.kind!r}; allowed: {', '.join(KINDS)}")
        if self.decimal not in (".", ","):
            raise ConfigError(f"decimal is {self.decimal!r}; allowed: '.' or ','")
        if self.separator is not None and (len(self.separator) != 1 or self.separator in '"\r\n.'):
            raise ConfigError(f"separator is {self.separator!r}; allowed: one character, such as ';' or '\\t'")
        if self.decimal == "," and self.separator == ",":
            raise ConfigError("separator and decimal are both ','; allowed: two characters")

    @classmethod
    def from_config(cls, section: str | Mapping[str, Any] | None) -> Self:
        """From the key `format` of a campaign: the name of a kind, or a mapping of fields, as the schema checks."""
        return cls(section) if section is None or isinstance(section, str) else cls(**section)

    def kind_of(self, path: Path, problems: Problems) -> str:
        """The kind of a file.

        Raises IngestError for an unknown extension where no kind is stated, ConfigError for a field of another kind.
        """
        kind = self.kind or _EXTENSIONS.get(path.suffix.lower())
        if kind is None:
            allowed = f"{', '.join(_EXTENSIONS)}, or the format stated: format: {' or '.join(KINDS)}"
            problems.refuse_now(value=f"the extension {path.suffix!r}", allowed=allowed)
        _, keys = _READERS[kind]
        decimal = self.decimal if self.decimal != "." else None
        given = {"separator": self.separator, "decimal": decimal, "sheet": self.sheet}
        for key, value in given.items():
            if value is not None and key not in keys:
                raise ConfigError(f"ingest of {path}: format {kind} has no {key}; allowed: {', '.join(keys) or 'none'}")
        return kind


def read_cells(path: Path, how: Format, problems: Problems) -> Cells:
    """The Cells of a file; raises IngestError where it is not what its format says."""
    data = read_bytes(path, problems)
    kind = how.kind_of(path, problems)
    reader, keys = _READERS[kind]
    return reader(data, problems, **{key: getattr(how, key) for key in keys})
