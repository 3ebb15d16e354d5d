"""The files of a figure; without Matplotlib, so that rules and pages know them without loading it."""

from collections.abc import Iterable
from pathlib import Path

from rrru.errors import ConfigError

# kinds of files: the entry that would hold a date or a version, and the one for the caption
KINDS = {
    "pdf": ("CreationDate", "Subject"),
    "png": ("Software", "Description"),
    "svg": ("Date", "Description"),
}
# bytes of the largest SVG that a page holds; of a larger figure it shows the PNG
LARGEST_SVG = 400_000


def with_svg(kinds: Iterable[str]) -> list[str]:
    """Kinds of files and SVG, which a page needs; ConfigError for one that is not of `KINDS`.

    >>> with_svg(["png"])
    ['png', 'svg']
    """
    if unknown := sorted(set(kinds) - set(KINDS)):
        raise ConfigError(f"figures as {', '.join(unknown)}: no such files; allowed: {', '.join(KINDS)}")
    return sorted({"svg", *kinds})


def figure_paths(folder: str, figures: Iterable[str]) -> dict[str, str]:
    """Paths of figures in a folder as PDF, PNG and SVG, by name and kind."""
    return {f"{name}_{kind}": f"{folder}/{name}.{kind}" for name in figures for kind in KINDS}


def fits_page(path: str | Path) -> bool:
    """Whether a page holds the SVG file at path, and not the figure's PNG."""
    return Path(path).stat().st_size <= LARGEST_SVG
