"""The options of the diagnosis: frozen, each used, each with a reason."""

import ast
from dataclasses import FrozenInstanceError, fields

import pytest

from rrru.diagnosis.options import OPTIONS, DiagnosisOptions
from tests.places import ROOT


def _uses(path):
    """Names that a file reads from OPTIONS."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "OPTIONS":
            yield node.attr


def test_options_are_frozen():
    with pytest.raises(FrozenInstanceError):
        OPTIONS.min_spare_numbers = 0


def test_every_option_is_used_and_every_use_is_an_option():
    used = {name for path in (ROOT / "rrru").rglob("*.py") for name in _uses(path)}
    assert used == {field.name for field in fields(DiagnosisOptions)}


def test_every_option_or_the_one_before_it_has_a_reason():
    lines = (ROOT / "rrru/diagnosis/options.py").read_text().splitlines()
    names = {field.name for field in fields(DiagnosisOptions)}
    explained = False
    for line in lines:
        text = line.strip()
        if text.split(":")[0] in names:
            assert explained, f"{text}: no reason above"
        else:
            explained = text.startswith("# ") and not text.startswith("# ---")
