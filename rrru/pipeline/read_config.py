"""Configurations from YAML files: the package's defaults with overlays on top."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from rrru.errors import ConfigError, why_unreadable
from rrru.pipeline.checks import check_keys, check_schema

DEFAULTS = Path(__file__).with_name("defaults.yaml")
SCHEMA = Path(__file__).with_name("config.schema.yaml")


def read_config(overlays: Sequence[str | Path] = ()) -> dict[str, Any]:
    """The defaults of the package under overlays, paths of YAML files, and checked.

    Raises ConfigError for a file that is not a YAML mapping, a key that occurs twice, and an unknown or wrong value.
    """
    config: dict[str, Any] = {}
    check_keys(overlays)
    for file in (DEFAULTS, *overlays):
        try:
            section = yaml.safe_load(Path(file).read_text(encoding="utf-8"))
        except yaml.MarkedYAMLError as error:
            line = f", line {error.problem_mark.line + 1}" if error.problem_mark else ""
            raise ConfigError(f"{file}{line}: {error.problem}; allowed: a YAML file") from error
        except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
            raise ConfigError(f"{file}: {why_unreadable(error)}; allowed: a YAML file") from error
        if not isinstance(section, dict):
            found = "is empty" if section is None else "is no mapping"
            allowed = "a YAML file with sections such as robots: and campaigns:"
            raise ConfigError(f"{file}: {found}; allowed: {allowed}")
        config = merged(config, section)
    check_config(config)
    return config


def check_config(config: Mapping[str, Any]) -> None:
    """Raise ConfigError with place and value where a configuration, or some sections of one, has a wrong value."""
    check_schema(config, SCHEMA, parts=True)


def merged(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """A mapping with the entries of another one on top."""
    both = {
        key: merged(below[key], value) if isinstance(value, dict) and isinstance(below.get(key), dict) else value
        for key, value in above.items()
    }
    return {**below, **both}
