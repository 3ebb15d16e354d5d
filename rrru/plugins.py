"""User-defined objects by `module:object`."""

import ast
import hashlib
import importlib
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from rrru.errors import ConfigError


def module_file(name: str) -> Path:
    """The file below the working directory that holds the module of `module:object`."""
    place = Path(name.partition(":")[0].replace(".", "/"))
    package = place / "__init__.py"
    return package if package.is_file() else place.with_suffix(".py")


def module_files(names: Iterable[str]) -> list[Path]:
    """Files below the working directory that `module:object` names and that their modules import, sorted."""
    waiting, found = [name.partition(":")[0] for name in names], set()
    while waiting:
        module = waiting.pop()
        parts = module.split(".")
        files = {module_file(".".join(parts[:count])) for count in range(1, len(parts) + 1)}
        new = {file for file in files if file.is_file()} - found
        found |= new
        for file in new:
            waiting += _imports(file)
    return sorted(found)


def own_code_digest(names: Iterable[str]) -> str:
    """Digest of the `module_files` of names."""
    digest = hashlib.sha256()
    for file in module_files(names):
        digest.update(str(file).encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()


def _imports(file: Path) -> list[str]:
    """Dotted names that the import statements of a file may load, none for a file that is no Python."""
    try:
        tree = ast.parse(file.read_bytes())
    except (SyntaxError, ValueError):
        # the import of the module reports this
        return []
    result = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            result += [alias.name for alias in node.names]
        if isinstance(node, ast.ImportFrom):
            # of level 1: the file's own package, of level 2 the one above
            above = file.parts[: len(file.parts) - node.level] if node.level else ()
            base = ".".join([*above, *filter(None, [node.module])])
            result += [".".join(filter(None, [base, name])) for name in ("", *(alias.name for alias in node.names))]
    return [name for name in result if name]


def load_object(whose: str, name: str) -> Any:
    """The object that `module:object` names; the module lies in the working directory or is installed.

    whose: the caller, for messages. Raises ConfigError where there is none.
    """
    module_name, colon, object_name = name.partition(":")
    if not (colon and object_name.isidentifier() and all(part.isidentifier() for part in module_name.split("."))):
        raise ConfigError(f"{whose}: {name!r} is no module:object")
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.insert(0, here)
    try:
        module = importlib.import_module(module_name)
    except ImportError as error:
        place = f"{module_name!r} from {here} or the installed packages"
        raise ConfigError(f"{whose}: cannot import {place}: {error}") from error
    if not hasattr(module, object_name):
        raise ConfigError(f"{whose}: module {module_name} has no {object_name!r}")
    return getattr(module, object_name)
