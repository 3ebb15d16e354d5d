"""Figures of the study as PDF and PNG."""

import importlib
import inspect

from rrru.figures import style
from rrru.store import tables
from rrru.store.job import run


def main(settings, inputs, outputs):
    """Draw figures {name: ("module:function", names of its tables)} of the settings, each with the settings' options."""
    for name, (place, needed) in settings["figures"].items():
        module, _, draw = place.partition(":")
        frames = {table: tables.read(inputs[table]) for table in needed}
        function = getattr(importlib.import_module(module), draw)
        figure = function(frames, settings["options"])
        # what its function says of a figure is the caption in both files
        style.save(figure, outputs[f"{name}_pdf"], outputs[f"{name}_png"], inspect.cleandoc(function.__doc__))


if __name__ == "__main__":
    run(main, snakemake)
