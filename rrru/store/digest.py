"""Dependencies of a workflow script: the import closure of its code, so that an edit reruns the affected jobs."""

import hashlib
import re
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# import statements of the package's own modules, inside of functions too
_FROM = re.compile(r"^[ \t]*from[ \t]+(rrru[\w.]*)[ \t]+import[ \t]+(\([^)]*\)|[^\n]*)", re.MULTILINE)
_DATA = re.compile(r"""Path\(__file__\)\.with_name\("([^"]+\.csv)"\)""")
_IMPORT = re.compile(r"^[ \t]*import[ \t]+(rrru[\w.]*)", re.MULTILINE)


def closure(*modules: str) -> list[Path]:
    """Files that the given ones import, by themselves or through others, themselves included, sorted.

    modules: paths of Python files below the project's root, or dotted names such as "rrru.figures.gap". Packages other
    than this one do not count: they are the lock's.
    """
    waiting = [file for module in modules for file in _start(module)]
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


def _start(module: str) -> list[Path]:
    """The file of a path, or that of a dotted name and the `__init__.py` of every folder on the way."""
    if module.endswith(".py"):
        return [ROOT / module]
    if _file(module) is None:
        raise ModuleNotFoundError(f"{module} is no module of this project")
    return _on_the_way(module)


def _on_the_way(name: str) -> list[Path]:
    """Files of a dotted name and of the packages that hold it, as far as they are modules of this project."""
    parts = name.split(".")
    files = (_file(".".join(parts[:k])) for k in range(1, len(parts) + 1))
    return [file for file in files if file]


@cache
def _imported(file: Path) -> tuple[Path, ...]:
    """Files of the package that a file imports, the `__init__.py` of every folder on the way included."""
    text = file.read_text()
    names = set(_IMPORT.findall(text))
    for module, targets in _FROM.findall(text):
        names.update(f"{module}.{word}" for word in re.findall(r"(\w+)(?:[ \t]+as[ \t]+\w+)?", targets))
    return tuple({*_looked_for(file, text), *(file for name in names for file in _on_the_way(name))})


def _looked_for(file: Path, text: str) -> list[Path]:
    """Files that a file uses without importing them by name: data, of its folder, or every package with its schemas."""
    if "pkgutil.walk_packages(" in text:
        package = ROOT / file.relative_to(ROOT).parts[0]
        return [*package.rglob("__init__.py"), *package.rglob("schemas.py")]
    data = [file.with_name(name) for name in _DATA.findall(text)]
    return data + (list(file.parent.glob("*.py")) if "pkgutil.iter_modules(" in text else [])


@cache
def _file(name: str) -> Path | None:
    """The file of a dotted name, None where the name is no module."""
    place = ROOT.joinpath(*name.split("."))
    candidates = (place.with_suffix(".py"), place / "__init__.py")
    return next((file for file in candidates if file.is_file()), None)
