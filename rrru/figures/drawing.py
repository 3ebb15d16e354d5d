"""Figures by the names of their functions, from tables on disk to files."""

import importlib
import inspect

from rrru.figures import style
from rrru.store import tables


def draw_all(figures, paths, options, outputs):
    """Draw figures {name: ("module:function", names of its tables)} to outputs["{name}_{kind}"] of `style.KINDS`.

    paths: the tables' paths by name; options: of all figures, see their functions. The docstring of a figure's function
    is its caption in all files.
    """
    for name, (place, needed) in figures.items():
        figure = draw(place, {table: tables.read(paths[table]) for table in needed}, options)
        files = {kind: outputs[f"{name}_{kind}"] for kind in style.KINDS}
        style.save(figure, files, inspect.cleandoc(_function(place).__doc__))


def draw(place, frames, options):
    """The figure of a function "module:function" for frames by table name."""
    return _function(place)(frames, options)


def _function(place):
    """The function that "module:function" names."""
    module, _, name = place.partition(":")
    return getattr(importlib.import_module(module), name)
