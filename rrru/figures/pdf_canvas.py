"""Matplotlib's canvas of PDF files, whose embedded fonts leave out what lays text out."""

from types import SimpleNamespace

from fontTools.ttLib import TTFont, registerCustomTableClass
from fontTools.ttLib.tables.otBase import BaseTTXConverter
from matplotlib.backends.backend_pdf import FigureCanvasPdf

__all__ = ["FigureCanvasPdf"]

# tables of kerning and ligatures: a PDF holds text that is laid out already, and a subset of them takes longer than the
# glyphs themselves
_LAYOUT_TABLES = ("GDEF", "GPOS", "GSUB")


class UnusedTable(BaseTTXConverter):  # type: ignore[misc]
    """A layout table that a subset of its font, embedded in a PDF, goes without."""

    def decompile(self, _data: bytes, _font: TTFont) -> None:
        """Read nothing: fontTools looks at the version and at `LookupList` of every layout table before it prunes."""
        self.table = SimpleNamespace(Version=0)

    def prune_pre_subset(self, _font: TTFont, _options: object) -> bool:
        """Whether fontTools keeps the table in a subset: never."""
        return False


# in this process, whatever else writes a PDF
for _tag in _LAYOUT_TABLES:
    registerCustomTableClass(_tag, __name__, UnusedTable.__name__)
