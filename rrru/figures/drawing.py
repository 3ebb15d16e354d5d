"""Figures by the names of their functions, from tables on disk to files.

Matplotlib is loaded where a figure is drawn: a command whose figures other processes draw goes without it.
"""

import importlib
import inspect
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rrru.figures.choose import Options, Tables
from rrru.figures.files import KINDS, fits_page
from rrru.store import tables

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rrru.figures.style import Drawing


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
    for _ in drawn(figures, paths, options, outputs, kinds):
        pass


def drawn(
    figures: Mapping[str, tuple[str, Sequence[str]]],
    paths: Mapping[str, str],
    options: Options,
    outputs: Mapping[str, str],
    kinds: Collection[str] = KINDS,
    call: Callable[..., Iterable[None]] = map,
) -> Iterable[None]:
    """`draw_all` figure by figure as the result is iterated.

    call: as `map`; one that calls in other processes begins at once with all figures.
    """
    draw_one = partial(_draw_files, paths=dict(paths), options=options, outputs=dict(outputs), kinds=kinds)
    return call(draw_one, figures, figures.values())


def _draw_files(
    name: str,
    drawn: tuple[str, Sequence[str]],
    paths: Mapping[str, str],
    options: Options,
    outputs: Mapping[str, str],
    kinds: Collection[str],
) -> None:
    """Draw the files of one figure, see `draw_all`."""
    from rrru.figures import style

    place, needed = drawn
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


def draw(place: str, frames: Tables, options: Options) -> "Figure":
    """The figure of a function "module:function" for frames by table name."""
    return _function(place)(frames, options)


def _function(place: str) -> "Drawing":
    """The function that "module:function" names."""
    module, _, name = place.partition(":")
    function: Drawing = getattr(importlib.import_module(module), name)
    return function
