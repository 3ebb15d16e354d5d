"""Fonts embedded in a PDF without their layout tables.

A PDF holds text that is laid out already: its tables of kerning and ligatures are not used, and a subset of them takes
longer than the glyphs themselves.
"""

from types import SimpleNamespace

from fontTools.ttLib import registerCustomTableClass
from fontTools.ttLib.tables.otBase import BaseTTXConverter

_LAYOUT_TABLES = ("GDEF", "GPOS", "GSUB")


class UnusedTable(BaseTTXConverter):
    """A layout table that a subset of its font goes without."""

    def decompile(self, _data, _font):
        """Read nothing: fontTools looks at the version and at `LookupList` of every layout table before it prunes."""
        self.table = SimpleNamespace(Version=0)

    def prune_pre_subset(self, _font, _options):
        """Whether fontTools keeps the table in a subset: never."""
        return False


def leave_out_layout():
    """Make fontTools, in this process, leave layout tables out of subsets of fonts."""
    for tag in _LAYOUT_TABLES:
        registerCustomTableClass(tag, __name__, UnusedTable.__name__)
