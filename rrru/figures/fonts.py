"""Fonts embedded in a PDF without their layout tables.

A PDF holds text that is laid out already: nobody reads the tables of kerning and ligatures in it, and cutting them down
to the glyphs in use takes longer than the glyphs themselves.
"""

from fontTools.ttLib import registerCustomTableClass
from fontTools.ttLib.tables.otBase import BaseTTXConverter

_LAYOUT_TABLES = ("GDEF", "GPOS", "GSUB")


class UnusedTable(BaseTTXConverter):
    """A layout table that a subset of its font goes without."""

    def prune_pre_subset(self, _font, _options):
        """What fontTools asks of a table before it cuts it down: whether to keep it."""
        return False


def leave_out_layout():
    """Tell fontTools, in this process, that subsets of fonts have no layout tables."""
    for tag in _LAYOUT_TABLES:
        registerCustomTableClass(tag, __name__, UnusedTable.__name__)
