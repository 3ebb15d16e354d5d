"""What a workflow script depends on: the import closure of its code, computed, so that an edit reruns exactly what it
changes.
"""

import ast
import hashlib
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def closure(*modules):
    """Files that the given files or modules of the package import, by themselves or through others, themselves
    included, sorted.

    modules: paths of Python files, or dotted names such as "rrru.gap.figure". Imports inside of functions count;
    packages outside of this one do not, they are the lock's.
    """
    waiting = [Path(module).resolve() if str(module).endswith(".py") else _file(module) for module in modules]
    found = set()
    while waiting:
        file = waiting.pop()
        if file is not None and file not in found:
            found.add(file)
            waiting.extend(_imported(file))
    return sorted(found)


@cache
def code_digest(*modules):
    """Digest (16 hex digits) of all files of the `closure` of modules."""
    digest = hashlib.sha256()
    for file in closure(*modules):
        digest.update(file.name.encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


@cache
def _imported(file):
    """Files of the package that a file imports, the `__init__.py` of every folder on the way included."""
    names = set()
    for node in ast.walk(ast.parse(file.read_bytes())):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.update((node.module, *(f"{node.module}.{alias.name}" for alias in node.names)))
    parts = [name.split(".") for name in names if name.split(".")[0] == "rrru"]
    return tuple(filter(None, {_file(".".join(p[:k])) for p in parts for k in range(1, len(p) + 1)}))


def _file(name):
    """The file of a dotted name, None where the name is no module."""
    place = ROOT.joinpath(*name.split("."))
    candidates = (place.with_suffix(".py"), place / "__init__.py")
    return next((file for file in candidates if file.is_file()), None)
