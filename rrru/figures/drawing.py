"""Figures by the names of their functions, from tables on disk to files; Matplotlib is loaded where one is drawn."""

import importlib
import inspect
from collections.abc import Collection, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rrru.figures.files import KINDS, fits_page
from rrru.store import tables

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rrru.figures.choose import Options, Tables
    from rrru.figures.style import Drawing


@dataclass(frozen=True)
class FigureRequest:
    """A figure to draw from tables on disk, see `requests`.

    place: "module:function"; paths: of its tables by name; files: of all kinds; kinds: of the files to write.
    """

    place: str
    paths: Mapping[str, str]
    options: "Options"
    files: Mapping[str, str]
    kinds: tuple[str, ...]

    def draw(self) -> None:
        """Write the figure's files; the docstring of its function is its caption.

        A figure whose SVG is too large for a page has a PNG whatever the kinds; files of other kinds that an earlier
        run left are removed.
        """
        from rrru.figures import style

        figure = draw(self.place, {name: tables.read(path) for name, path in self.paths.items()}, self.options)
        caption = inspect.cleandoc(_function(self.place).__doc__ or "")
        style.save(figure, {kind: self.files[kind] for kind in self.kinds}, caption)
        others = set(KINDS) - set(self.kinds)
        if "png" in others and not fits_page(self.files["svg"]):
            style.save(figure, {"png": self.files["png"]}, caption)
            others.remove("png")
        for kind in others:
            Path(self.files[kind]).unlink(missing_ok=True)


def requests(
    figures: Mapping[str, tuple[str, Sequence[str]]],
    paths: Mapping[str, str],
    options: "Options",
    outputs: Mapping[str, str],
    kinds: Collection[str] = KINDS,
) -> list[FigureRequest]:
    """Requests for figures {name: ("module:function", names of its tables)} in outputs["{name}_{kind}"] of `KINDS`.

    paths: the tables' paths by name; options: of all figures, see their functions; kinds: of the files, "svg" among
    them.
    """
    return [
        FigureRequest(
            place,
            {table: paths[table] for table in needed},
            options,
            {kind: outputs[f"{name}_{kind}"] for kind in KINDS},
            tuple(kinds),
        )
        for name, (place, needed) in figures.items()
    ]


def draw_all(figures: Sequence[FigureRequest], processes: Executor | None = None) -> None:
    """Draw figures one after the other, or in processes, see `rrru.figures.processes`: the files are the same."""
    if processes is None:
        for figure in figures:
            figure.draw()
    else:
        # an error of a process is raised where its result is asked for
        list(processes.map(FigureRequest.draw, figures))


def draw(place: str, frames: "Tables", options: "Options") -> "Figure":
    """The figure of a function "module:function" for frames by table name."""
    return _function(place)(frames, options)


def _function(place: str) -> "Drawing":
    """The function that "module:function" names."""
    module, _, name = place.partition(":")
    function: Drawing = getattr(importlib.import_module(module), name)
    return function
