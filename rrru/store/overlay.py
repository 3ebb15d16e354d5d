"""What a search found as an overlay of the configuration."""

import logging
from pathlib import Path

import yaml


def write(values: dict, misfit: float, path: str | Path) -> None:
    """Write nested values as YAML with the misfit in its first line, as a whole or not at all."""
    logging.info("misfit %.4f", misfit)
    partial = Path(f"{path}.partial")
    partial.write_text(f"# misfit {misfit:.4f}\n" + yaml.safe_dump(values, sort_keys=False))
    partial.replace(path)
