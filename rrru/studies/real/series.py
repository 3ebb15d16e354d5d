"""Available real series: files of the configuration's data sets, shipped ones and the user's own."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any

import pandas as pd

from rrru.errors import ConfigError, RrruError
from rrru.pipeline.config import own_robot_file

# names the folder of data that may not be redistributed
VARIABLE = "RRRU_REAL_DATA"
REFUSED = "refused"


@dataclass(frozen=True)
class Series:
    """One measured series: its name, that of its data set, the file, and the set's section of the configuration.

    label: the name without that of the data set; variant: how to read the file, "" where there is one way only.
    """

    name: str
    dataset: str
    label: str
    variant: str
    file: Path
    section: Mapping[str, Any]

    def read(self) -> pd.DataFrame:
        """The file's columns; raises ConfigError where it cannot be read, has no rows or a column's name twice."""
        where = f"real.sets.{self.dataset}: {self.file}"
        try:
            if self.file.suffix == ".parquet":
                frame = pd.read_parquet(self.file)
                names = frame.columns
            else:
                frame = pd.read_csv(self.file, skipinitialspace=True)
                # pandas renames repeated columns
                names = pd.read_csv(self.file, skipinitialspace=True, header=None, nrows=1, dtype=str).iloc[0].dropna()
        except (OSError, ValueError) as error:
            raise ConfigError(f"{where}: {str(error).strip()}; allowed: CSV or parquet, one row per pose") from error
        twice = names[names.duplicated()].tolist()
        if twice:
            raise ConfigError(f"{where} has two columns {twice[0]!r}; allowed: each name once")
        if frame.empty:
            raise ConfigError(f"{where} has no rows; allowed: one row per pose")
        return frame

    def column(self, frame: pd.DataFrame, key: str, names: Any) -> Any:
        """One column or several of the file; raises ConfigError for a missing one."""
        lacking = [name for name in ([names] if isinstance(names, str) else names) if name not in frame]
        if lacking:
            known = ", ".join(frame.columns)
            raise ConfigError(
                f"real.sets.{self.dataset}.{key}: no column {lacking[0]!r} in {self.file}, which has {known}"
            )
        return frame[names]


def folders(section: Mapping[str, Any]) -> tuple[Path, ...]:
    """Folders of the data: the one named in the environment precedes that of the configuration."""
    named = os.environ.get(VARIABLE)
    return (*([Path(named)] if named else []), Path(section["folder"]))


def found(section: Mapping[str, Any], name: str) -> tuple[Series, ...]:
    """The series of one data set, in order of their files' names; none where it has no files here.

    section: the configuration's `real`. The name of a series has its set, the part of its file name that matches *, and
    its variant.
    """
    own = dict(section["sets"][name])
    variants = own.pop("variants", {"": {}})
    paths: dict[str, Path] = {}  # of the same label the first folder's
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


def used(section: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """The data sets of the configuration's `real` by name; an overlay takes one out by setting it to null."""
    return {name: one for name, one in section["sets"].items() if one is not None}


def check(config: Mapping[str, Any]) -> None:
    """Raise ConfigError where a data set names an unknown robot or variant, or does not say how to read it."""
    sets = used(config["real"])
    if not sets:
        raise ConfigError("real.sets: got only null; allowed: at least one set")
    for name, section in sets.items():
        where = f"real.sets.{name}"
        pattern = PurePath(section["files"])
        signs = set("?[") & set(section["files"]) or {"*"} & set(str(pattern.parent))
        if signs or pattern.name.count("*") > 1 or pattern.is_absolute() or ".." in pattern.parts:
            raise ConfigError(
                f"{where}.files: got {section['files']!r}; allowed: a path below the folder, one * in the file's name"
            )
        if "kind" not in section:
            _check_arm(where, section, config["robots"])


def _check_arm(where: str, section: Mapping[str, Any], robots: Mapping[str, Any]) -> None:
    """Raise ConfigError where the section of an arm names an unknown robot or target, or lacks its readings."""
    if ("robot" in section) == ("chain" in section):
        raise ConfigError(
            f"{where}: got {'both' if 'robot' in section else 'no'} robot and chain; allowed: one of them"
        )
    # imported here because it imports every robot, and every start of the workflow imports this module
    from rrru.robots.catalogue import OWN

    own = [name for name, robot in robots.items() if set(OWN) & set(robot)]
    if "robot" in section and section["robot"] not in own:
        raise ConfigError(
            f"{where}.robot: got {section['robot']!r}; allowed: an entry of robots with {', '.join(OWN)}: "
            f"{', '.join(own)}"
        )
    if "readings" not in section:
        raise ConfigError(f"{where}: got no readings; allowed: at least one target with its position")
    targets, fixed = [*section["readings"]], section.get("world_targets", ())
    for target in fixed:
        if target not in targets:
            raise ConfigError(f"{where}.world_targets: got {target!r}; allowed: keys of readings: {', '.join(targets)}")
    if set(targets) == set(fixed):
        raise ConfigError(f"{where}.world_targets: got all of readings; allowed: all except one on the robot")
    for key, names in _named(section):
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ConfigError(f"{where}.{key}: got {twice[0]!r} twice; allowed: another column for each")


def _named(section: Mapping[str, Any]) -> list[tuple[str, list[str]]]:
    """Keys of an arm's section and the columns of each, which have to differ."""
    ways = {"joints": section} | {f"variants.{name}.joints": one for name, one in section.get("variants", {}).items()}
    joints = [(key, [*one["joints"].values()]) for key, one in ways.items() if "joints" in one]
    readings = [
        (f"readings.{target}", [*reading["position"], *reading.get("rotation", ())])
        for target, reading in section["readings"].items()
    ]
    return joints + readings


def missing(section: Mapping[str, Any], name: str) -> str:
    """The message for a data set without files."""
    where = " or ".join(map(str, folders(section)))
    pattern = section["sets"][name]["files"]
    return f"real.sets.{name}: skipped, no {pattern} in {where}; set {VARIABLE} to its folder"


def _label(pattern: str, file: Path) -> str:
    """The part of a file's name that matches the * of a pattern, "" where it has none."""
    before, star, after = Path(pattern).name.partition("*")
    return file.name.removeprefix(before).removesuffix(after) if star else ""


def files(config: Mapping[str, Any], name: str, series: str | None = None) -> list[str]:
    """The existing files of a data set or of one of its series, and those that describe its robot.

    series: its name, by default all series.
    """
    every = found(config["real"], name)
    result = list(dict.fromkeys(one.file for one in every if series in (None, one.name)))
    section = config["real"]["sets"][name]
    if "chain" in section:
        result += sorted({one.parent / section["chain"] for one in result})
    elif "robot" in section:
        result.append(own_robot_file(config["robots"][section["robot"]]))
    return [str(file) for file in result if file is not None and file.exists()]


def part(config: Mapping[str, Any], name: str) -> dict[str, Any]:
    """The part of the configuration of a data set, with the robot that it names."""
    section, real = config["real"]["sets"][name], {key: config["real"][key] for key in ("folder", "gap")}
    robots = {section["robot"]: config["robots"][section["robot"]]} if "robot" in section else {}
    return {"set": name, "real": real | {"sets": {name: section}}, "robots": robots}


def of_each(place, series):
    """Input function of a rule: a file of every series of a set, from its path with both names as wildcards.

    series: names of the series by that of their set.
    """
    return lambda wildcards: [
        place.replace("{set}", wildcards.set).replace("{series}", name) for name in series[wildcards.set]
    ]


def refused(series: Series, error: RrruError) -> dict[str, pd.DataFrame]:
    """Frames by name, without the campaign: the row of `real_verdicts` with the reason in its notes, no numbers."""
    row = dict.fromkeys(("where", "confounded_with", "next_runs"), "") | {"points": 0, "dropped_points": 0}
    reason = {"effects": REFUSED, "notes": f"left out: {error}", **named(series)}
    return {"real_verdicts": pd.DataFrame([row | reason])}


def named(series: Series) -> dict[str, str]:
    """Columns of `real_verdicts` on the series itself."""
    robot = series.section.get("robot", series.dataset)
    return {"dataset": series.dataset, "robot": robot, "source": series.file.name}
