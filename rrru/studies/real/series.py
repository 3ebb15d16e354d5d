"""Which real series there are to look at: files of the configuration's data sets, shipped ones and the user's own."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from rrru.errors import ConfigError

# the folder that data which may not be shipped are read from
VARIABLE = "RRRU_REAL_DATA"


@dataclass(frozen=True)
class Series:
    """One measured series: its name, that of its data set, the file, and the set's section of the configuration.

    label: the name without the data set's; variant: which way of reading the file, "" where there is one.
    """

    name: str
    dataset: str
    label: str
    variant: str
    file: Path
    section: Mapping[str, Any]

    def read(self) -> pd.DataFrame:
        """The file's columns; raises ConfigError where it cannot be read or has no rows."""
        try:
            frame = pd.read_parquet(self.file) if self.file.suffix == ".parquet" else pd.read_csv(self.file)
        except (OSError, ValueError) as error:
            raise ConfigError(f"real.sets.{self.dataset}: {self.file}: {error}") from error
        if frame.empty:
            raise ConfigError(f"real.sets.{self.dataset}: {self.file} has no rows")
        return frame

    def column(self, frame: pd.DataFrame, key: str, names: Any) -> Any:
        """One column or several of the file; raises ConfigError naming those that it lacks."""
        lacking = [name for name in ([names] if isinstance(names, str) else names) if name not in frame]
        if lacking:
            known = ", ".join(frame.columns)
            raise ConfigError(
                f"real.sets.{self.dataset}.{key}: no column {lacking[0]!r} in {self.file}, which has {known}"
            )
        return frame[names]


def folders(section: Mapping[str, Any]) -> tuple[Path, ...]:
    """Folders that the data lie in: the configuration's, and the one that the environment names."""
    own = os.environ.get(VARIABLE)
    return (Path(section["folder"]), *([Path(own)] if own else []))


def found(section: Mapping[str, Any], name: str) -> tuple[Series, ...]:
    """The series of one data set, in order of their files' names; none where it has no files here.

    section: the configuration's `real`. A series is called by its set, what stands for the * of its file's name, and
    its variant.
    """
    own = dict(section["sets"][name])
    variants = own.pop("variants", {"": {}})
    paths: dict[str, Path] = {}
    for folder in folders(section):
        for file in sorted(folder.glob(own["files"])):
            paths.setdefault(_label(own["files"], file), file)
    result = []
    for label in sorted(paths):
        for variant, changes in variants.items():
            both = "_".join(filter(None, (label, variant)))
            called = "_".join(filter(None, (name, both)))
            result.append(Series(called, name, both, variant, paths[label], own | dict(changes)))
    return tuple(result)


def check(config: Mapping[str, Any]) -> None:
    """Raise ConfigError where a data set names a robot or a variant that does not exist, or no way to read it."""
    for name, section in config["real"]["sets"].items():
        where = f"real.sets.{name}"
        if "kind" in section:
            continue
        if ("robot" in section) == ("chain" in section):
            raise ConfigError(
                f"{where}: got {'both' if 'robot' in section else 'no'} robot and chain; allowed: one of them"
            )
        if "robot" in section and section["robot"] not in config["robots"]:
            known = ", ".join(config["robots"])
            raise ConfigError(f"{where}.robot: robots has no {section['robot']!r}; known: {known}")
        if "readings" not in section:
            raise ConfigError(f"{where}: got no readings; allowed: at least one target with its position")
        for target in section.get("world_targets", ()):
            if target not in section["readings"]:
                raise ConfigError(f"{where}.world_targets: readings has no {target!r}")


def missing(section: Mapping[str, Any], name: str) -> str:
    """What is to be told of a data set without files here."""
    where = " or ".join(map(str, folders(section)))
    return f"real.sets.{name}: no {section['sets'][name]['files']} in {where}: left out; {VARIABLE} may name its folder"


def _label(pattern: str, file: Path) -> str:
    """What stands for the * of a pattern in a file's name, "" where it has none."""
    before, star, after = Path(pattern).name.partition("*")
    return file.name.removeprefix(before).removesuffix(after) if star else ""
