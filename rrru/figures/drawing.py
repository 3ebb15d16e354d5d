"""Figures by the names of their functions, from tables on disk to files."""

import importlib
import inspect

from rrru.figures import style
from rrru.store import tables


def draw_all(figures, paths, options, outputs):
    """Draw figures {name: ("module:function", names of its tables)} to outputs["{name}_pdf"] and outputs["{name}_png"].

    paths: the tables' paths by name; options: what all figures are told, see their functions. What a figure's function
    says of it is the caption in both files.
    """
    for name, (place, needed) in figures.items():
        module, _, attribute = place.partition(":")
        function = getattr(importlib.import_module(module), attribute)
        figure = function({table: tables.read(paths[table]) for table in needed}, options)
        style.save(figure, outputs[f"{name}_pdf"], outputs[f"{name}_png"], inspect.cleandoc(function.__doc__))
