"""Imports point one way, and only the named files know the named libraries."""

import ast
import re
from functools import cache

import pytest

from tests.places import ROOT

_ROOT = ROOT
_FLOORS = {
    "__version__": 0,
    "arrays": 1,
    "errors": 1,
    "seeds": 1,
    "cache": 1,
    "parameters": 2,
    "plugins": 2,
    "kinematics": 3,
    "formats": 4,
    "robots": 5,
    "effects": 6,
    "campaign": 6,
    "estimation": 7,
    "simulation": 7,
    "calibration": 8,
    "genetic": 9,
    "compensation": 9,
    "diagnosis": 9,
    "pipeline": 10,
    "studies": 11,
    "report": 12,
    "api": 13,
    "cli": 14,
    "__main__": 15,
}
# tables in, figures out: they import none of the computing packages
_APART = {"store": {"errors"}, "figures": {"arrays", "errors", "store"}}
_DRAWING = {p.relative_to(_ROOT).as_posix() for p in (_ROOT / "rrru").rglob("*.py") if "figures" in str(p)}
_LIBRARIES = {
    "pygad": {"rrru/genetic/pygad_run.py"},
    "matplotlib": _DRAWING,
    "cv2": {"rrru/simulation/camera.py", "rrru/studies/delta/vision.py"},
    "sklearn": {"rrru/studies/blind_validation/rivals.py"},
    "jinja2": {"rrru/report/page.py", "rrru/studies/printers/command.py"},
    "snakemake": set(),
}
_FILES = sorted((_ROOT / "rrru").rglob("*.py"))


@cache
def _nodes(path):
    """All nodes of a file's syntax tree."""
    return [*ast.walk(ast.parse(path.read_text()))]


@cache
def _imports(path):
    """Names that a file imports, wherever they stand."""
    names = []
    for node in _nodes(path):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names += [f"{node.module}.{alias.name}" for alias in node.names]
    return names


@pytest.mark.parametrize("path", _FILES, ids=lambda p: p.relative_to(_ROOT).as_posix())
def test_a_package_uses_only_packages_below_it(path):
    package = path.relative_to(_ROOT / "rrru").parts[0].removesuffix(".py")
    if package == "__init__":
        return
    for name in _imports(path):
        parts = name.split(".")
        if parts[0] != "rrru" or len(parts) < 2 or parts[1] == package or parts[1] in _APART:
            continue
        if package in _APART:
            assert parts[1] in _APART[package], f"{path} imports {name}"
        else:
            assert _FLOORS[parts[1]] < _FLOORS[package], f"{path} imports {name}"


@pytest.mark.parametrize("library", _LIBRARIES)
def test_only_the_named_files_know_a_library(library):
    users = {p.relative_to(_ROOT).as_posix() for p in _FILES if any(n.split(".")[0] == library for n in _imports(p))}
    assert users <= _LIBRARIES[library]


def test_nobody_uses_global_random_state():
    """Only generators: no numpy.random function but default_rng, SeedSequence and Generator."""
    for path in _FILES:
        for node in _nodes(path):
            if (
                isinstance(node, ast.Attribute)
                and isinstance(node.value, ast.Attribute)
                and node.value.attr == "random"
            ):
                assert node.attr in ("default_rng", "SeedSequence", "Generator"), f"{path}: np.random.{node.attr}"
            if isinstance(node, ast.Import):
                assert "random" not in [alias.name for alias in node.names], path


def test_nothing_runs_code_that_a_file_holds():
    """Modules by the user's names come in at one place; no text is evaluated, unpickled or handed to a shell."""
    forbidden = {"eval", "exec", "__import__", "pickle", "marshal", "subprocess", "system", "popen", "UnsafeLoader"}
    for path in [*_FILES, *sorted((_ROOT / "workflow/scripts").glob("*.py"))]:
        used = {node.id for node in _nodes(path) if isinstance(node, ast.Name)}
        used |= {node.attr for node in _nodes(path) if isinstance(node, ast.Attribute)}
        used |= {name.split(".")[0] for name in _imports(path)}
        assert not used & forbidden, f"{path} uses {used & forbidden}"
    rules = [_ROOT / "Snakefile", *sorted((_ROOT / "workflow/rules").rglob("*.smk"))]
    assert not [path for path in rules if re.search(r"^\s+(shell|run):", path.read_text(), re.MULTILINE)]
