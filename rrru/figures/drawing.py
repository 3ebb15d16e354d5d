"""Figures by the names of their functions, from tables on disk to files."""

import importlib
import inspect
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

from matplotlib.figure import Figure

from rrru.figures import style
from rrru.figures.choose import Options, Tables
from rrru.figures.files import KINDS, fits_page
from rrru.figures.style import Drawing
from rrru.store import tables


def draw_all(
    figures: Mapping[str, tuple[str, Sequence[str]]],
    paths: Mapping[str, str],
    options: Options,
    outputs: Mapping[str, str],
    kinds: Collection[str] = KINDS,
) -> None:
    """Draw figures {name: ("module:function", names of its tables)} to outputs["{name}_{kind}"] of `KINDS`.

    paths: the tables' paths by name; options: of all figures, see their functions; kinds: of the files, "svg" among
    them. A figure whose SVG is too large for a page has a PNG whatever the kinds; files of other kinds that an earlier
    run left are removed. The docstring of a figure's function is its caption in all files.
    """
    for name, (place, needed) in figures.items():
        figure = draw(place, {table: tables.read(paths[table]) for table in needed}, options)
        files = {kind: outputs[f"{name}_{kind}"] for kind in KINDS}
        caption = inspect.cleandoc(_function(place).__doc__ or "")
        style.save(figure, {kind: files[kind] for kind in kinds}, caption)
        others = set(KINDS) - set(kinds)
        if "png" in others and not fits_page(files["svg"]):
            style.save(figure, {"png": files["png"]}, caption)
            others.remove("png")
        for kind in others:
            Path(files[kind]).unlink(missing_ok=True)


def draw(place: str, frames: Tables, options: Options) -> Figure:
    """The figure of a function "module:function" for frames by table name."""
    return _function(place)(frames, options)


def _function(place: str) -> Drawing:
    """The function that "module:function" names."""
    module, _, name = place.partition(":")
    function: Drawing = getattr(importlib.import_module(module), name)
    return function
