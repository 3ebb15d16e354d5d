"""Digest of the package's code, so that a workflow reruns what an edit changes."""

import hashlib
from functools import cache
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[1]


@cache
def code_digest(*rooms):
    """Digest (16 hex digits) of the Python files in the named rooms of the package (folders or modules, without the ending)."""
    digest = hashlib.sha256()
    for room in sorted(rooms):
        place = _PACKAGE / room
        files = sorted(place.rglob("*.py")) if place.is_dir() else [place.with_suffix(".py")]
        for file in files:
            digest.update(str(file.relative_to(_PACKAGE)).encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()[:16]
