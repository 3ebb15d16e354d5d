"""Every figure as the workflow draws it: name to function and tables, out of the package and the rules' files."""

import importlib
import re

from rrru.pipeline.jobs.outputs import CAMPAIGN_FIGURES, GAP_FIGURES
from tests.places import ROOT

_ASSIGNED = re.compile(r"^(_?[A-Z_]+ = (?:\{.*?\}|\{\n.*?^\}|\[.*?\]|\"[^\n]*\"))$", re.MULTILINE | re.DOTALL)


def _figures():
    """Figures {name: ("module:function", tables)} of the jobs of a campaign and of all rules."""
    result = {**CAMPAIGN_FIGURES, **GAP_FIGURES}
    for file in sorted((ROOT / "workflow/rules").rglob("*.smk")):
        names = {}
        for statement in _ASSIGNED.findall(file.read_text()):
            try:
                exec(statement, names)
            except NameError:
                continue
        for name, value in names.items():
            if name.endswith(("_FIGURES", "_FIGURE")):
                result |= value
    return result


def _function(place):
    module, _, name = place.partition(":")
    return getattr(importlib.import_module(module), name)


FIGURES = {name: (_function(place), tuple(tables)) for name, (place, tables) in _figures().items()}
