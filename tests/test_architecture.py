"""Imports point one way, and only the named files know the named libraries."""

import ast
from pathlib import Path

import pytest

_ROOT = Path(__file__).resolve().parents[1]
_FLOORS = {
    "errors": 1,
    "seeds": 1,
    "parameters": 2,
    "mechanisms": 3,
    "effects": 4,
    "campaign": 4,
    "calibrate": 5,
    "plant": 5,
    "compensate": 6,
    "gap": 6,
    "withheld": 7,
    "ptt_study": 7,
    "reproduce": 7,
    "study": 7,
    "delta_study": 7,
    "method_study": 8,
    "report": 0,
}
_SIBLINGS = {
    ("effects", "campaign"),
    ("campaign", "effects"),
    ("calibrate", "plant"),
    ("plant", "calibrate"),
    ("reproduce", "study"),
    ("delta_study", "study"),
}
_LIBRARIES = {
    "pygad": {"rrru/calibrate/genetic.py"},
    "matplotlib": {p.relative_to(_ROOT).as_posix() for p in (_ROOT / "rrru/report/figures").glob("*.py")},
    "cv2": {"rrru/plant/camera.py", "rrru/calibrate/vision.py"},
    "snakemake": set(),
}
_FILES = sorted((_ROOT / "rrru").rglob("*.py"))


def _imports(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@pytest.mark.parametrize("path", _FILES, ids=lambda p: p.relative_to(_ROOT).as_posix())
def test_a_room_uses_only_rooms_below_it(path):
    room = path.relative_to(_ROOT / "rrru").parts[0].removesuffix(".py")
    if room == "__init__":
        return
    for name in _imports(path):
        parts = name.split(".")
        if parts[0] != "rrru" or len(parts) < 2 or parts[1] == room:
            continue
        other = parts[1]
        allowed = other in ("errors",) if room == "report" else _FLOORS[other] != 0 and _FLOORS[other] <= _FLOORS[room]
        assert allowed and (room, other) not in _SIBLINGS, f"{room} imports {name}"


@pytest.mark.parametrize("library", _LIBRARIES)
def test_only_the_named_files_know_a_library(library):
    users = {p.relative_to(_ROOT).as_posix() for p in _FILES if any(n.split(".")[0] == library for n in _imports(p))}
    assert users <= _LIBRARIES[library]


def test_nobody_uses_global_random_state():
    """Only generators: no numpy.random function but default_rng, SeedSequence and Generator."""
    for path in _FILES:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Attribute) and node.value.attr == "random":
                assert node.attr in ("default_rng", "SeedSequence", "Generator"), f"{path}: np.random.{node.attr}"
            if isinstance(node, ast.Import):
                assert "random" not in [alias.name for alias in node.names], path
