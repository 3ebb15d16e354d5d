"""What a workflow script depends on: the import closure of its code, so that an edit reruns what it changes."""

import hashlib
import re
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# import statements of the package's own modules, inside of functions too
_FROM = re.compile(r"^[ \t]*from[ \t]+(rrru[\w.]*)[ \t]+import[ \t]+(\([^)]*\)|[^\n]*)", re.MULTILINE)
_IMPORT = re.compile(r"^[ \t]*import[ \t]+(rrru[\w.]*)", re.MULTILINE)


def closure(*modules: str) -> list[Path]:
    """Files that the given ones import, by themselves or through others, themselves included, sorted.

    modules: paths of Python files below the project's root, or dotted names such as "rrru.figures.gap". Packages other
    than this one do not count: they are the lock's.
    """
    waiting = [_start(module) for module in modules]
    found: set[Path] = set()
    while waiting:
        file = waiting.pop()
        if file not in found:
            found.add(file)
            waiting.extend(_imported(file))
    return sorted(found)


@cache
def code_digest(*modules: str) -> str:
    """Digest (16 hex digits) of all files of the `closure` of modules."""
    digest = hashlib.sha256()
    for file in closure(*modules):
        digest.update(str(file.relative_to(ROOT)).encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def _start(module: str) -> Path:
    """The file that a path or a dotted name stands for."""
    file = ROOT / module if module.endswith(".py") else _file(module)
    if file is None:
        raise ModuleNotFoundError(f"{module} is no module of this project")
    return file


@cache
def _imported(file: Path) -> tuple[Path, ...]:
    """Files of the package that a file imports, the `__init__.py` of every folder on the way included."""
    text = file.read_text()
    names = set(_IMPORT.findall(text))
    for module, targets in _FROM.findall(text):
        names.update(f"{module}.{word}" for word in re.findall(r"(\w+)(?:[ \t]+as[ \t]+\w+)?", targets))
    parts = [name.split(".") for name in names]
    # what looks for modules finds those of its own folder
    beside = file.parent.glob("*.py") if "import pkgutil\n" in text else ()
    return tuple(filter(None, {*beside, *(_file(".".join(p[:k])) for p in parts for k in range(1, len(p) + 1))}))


@cache
def _file(name: str) -> Path | None:
    """The file of a dotted name, None where the name is no module."""
    place = ROOT.joinpath(*name.split("."))
    candidates = (place.with_suffix(".py"), place / "__init__.py")
    return next((file for file in candidates if file.is_file()), None)
