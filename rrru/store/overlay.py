"""Results of a search as an overlay of the configuration."""

import logging
from pathlib import Path
from typing import Any

import yaml

from rrru.store.atomic_write import write_text


def write(values: dict[str, Any], misfit: float, path: str | Path) -> None:
    """Write nested values as YAML with the misfit in its first line, completely or not at all."""
    logging.info("misfit %.4f", misfit)
    write_text(f"# misfit {misfit:.4f}\n" + yaml.safe_dump(values, sort_keys=False), path)
