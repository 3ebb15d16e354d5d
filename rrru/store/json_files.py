"""Facts as JSON files: nested mappings of numbers and texts, the same bytes for the same facts."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from rrru.store.atomic_write import write_text


def write(facts: dict[str, Any], path: str | Path) -> None:
    """Write facts as JSON, completely or not at all."""
    write_text(text(facts), path)


def text(facts: dict[str, Any]) -> str:
    """Facts as JSON; numbers of NumPy as plain ones, non-finite ones as null."""
    return json.dumps(_plain(facts), indent=1, sort_keys=True, allow_nan=False, ensure_ascii=False) + "\n"


def read(path: str | Path) -> dict[str, Any]:
    """The facts of a file."""
    found: dict[str, Any] = json.loads(Path(path).read_text())
    return found


def _plain(value: Any) -> Any:
    """Nested facts in the types of JSON."""
    if isinstance(value, dict):
        return {str(key): _plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not np.isfinite(value) else value
