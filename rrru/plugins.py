"""User-defined objects by `module:object`."""

import importlib
import sys
from pathlib import Path
from typing import Any

from rrru.errors import ConfigError


def module_file(name: str) -> Path:
    """The file below the working directory that holds the module of `module:object`."""
    return Path(f"{name.partition(':')[0].replace('.', '/')}.py")


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
