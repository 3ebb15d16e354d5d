"""Settings of the configuration for reading a measurement file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Self

import numpy as np
import pandas as pd

from rrru.campaign.ingest.formats import Format
from rrru.campaign.stated_motion import StatedMotion
from rrru.errors import ConfigError

MM = {"mm": 1.0, "m": 1000.0, "inch": 25.4}
RAD = {"rad": 1.0, "deg": np.pi / 180.0}
_AS_IT_ENDS = Format()
_CHOICES = {
    "unit": tuple(MM),
    "angle_unit": tuple(RAD),
    "drive_unit": (None, *MM),
    "frame": ("robot", "register"),
    "extra_columns": ("refuse", "ignore"),
    "elbow": ("out", "in"),
}


@dataclass(frozen=True)
class IngestSpec:
    """Settings for reading a measurement file; raises ConfigError for a setting that does not exist.

    columns: our name -> the file's column name, absent = the same name. unit: of the file's positions ("mm", "m",
    "inch"; speeds are mm/s, payloads kg). drive_unit: of drive values that are lengths, None as `unit`. angle_unit:
    "rad" or "deg". frame: of the measured positions; "register" solves the six numbers between it and the robot frame
    from `registration_points`, pairs (run, point), none for all.
    extra_columns: "refuse" or "ignore" undeclared columns. elbow: assembly of the legs, "out" or "in". targets: known
    places of reflectors on the platform in mm, by name; others are estimated from the file. world_targets: names of
    those that are fixed next to the robot, their places in its frame. format: how the file is written; commands: a
    second file with the commanded positions, and its format, see `rrru.campaign.ingest.commands`; time_format: of
    strptime, of times of day in `time_s`. signs: drive -> -1 where the file counts its values in the opposite sense;
    order: names of the drives to which the file's columns of drive values belong, in their order, none for the robot's
    own order. motion: how the robot moved between the rows, None where not stated.
    """

    path: str
    columns: Mapping[str, str] = field(default_factory=dict)
    unit: str = "mm"
    angle_unit: str = "rad"
    drive_unit: str | None = None
    frame: str = "robot"
    registration_points: tuple[tuple[int, int], ...] = ()
    extra_columns: str = "refuse"
    elbow: str = "out"
    targets: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    world_targets: tuple[str, ...] = ()
    format: Format = _AS_IT_ENDS
    commands: str | None = None
    commands_format: Format = _AS_IT_ENDS
    time_format: str | None = None
    signs: Mapping[str, int] = field(default_factory=dict)
    order: tuple[str, ...] = ()
    motion: StatedMotion | None = None

    def __post_init__(self) -> None:
        theirs, points = [*self.columns.values()], self.registration_points
        given = {key: getattr(self, key) for key in _CHOICES}
        wrong = [f"{key} is {given[key]!r}; allowed: {', '.join(filter(None, _CHOICES[key]))}" for key in _CHOICES]
        wrong = [text for text, key in zip(wrong, _CHOICES, strict=True) if given[key] not in _CHOICES[key]]
        doubled = [name for name in theirs if theirs.count(name) > 1]
        wrong += [f"columns gives {name!r} two meanings; allowed: one of our names per column" for name in doubled]
        if points and self.frame != "register":
            wrong.append(f"registration_points with frame {self.frame!r}; allowed: frame register")
        if not all(isinstance(pair, (tuple, list)) and len(pair) == 2 for pair in points):
            wrong.append(f"registration_points {points!r}; allowed: pairs (run, point)")
        if wrong:
            raise ConfigError(f"ingest of {self.path}: {wrong[0]}")

    @property
    def unit_of_drives(self) -> str:
        """Unit of drive values that are lengths."""
        return self.drive_unit or self.unit

    def check_drives(self, drives: Sequence[str]) -> None:
        """Raise ConfigError where signs or order are not of these drives."""
        if unknown := [name for name in self.signs if name not in drives]:
            raise ConfigError(f"ingest of {self.path}: signs has {unknown[0]!r}; allowed: {', '.join(drives)}")
        if wrong := [f"{name}: {sign!r}" for name, sign in self.signs.items() if sign not in (1, -1)]:
            raise ConfigError(f"ingest of {self.path}: signs has {wrong[0]}; allowed: 1 or -1")
        if self.order and sorted(self.order) != sorted(drives):
            given = ", ".join(map(str, self.order))
            raise ConfigError(f"ingest of {self.path}: order is {given}; allowed: each of {', '.join(drives)} once")

    def as_meant(self, frame: pd.DataFrame, drives: Sequence[str]) -> pd.DataFrame:
        """The frame with drive values in `order` and with `signs`, where it has all drives' columns."""
        if not set(drives) <= set(frame):
            return frame
        columns = dict(zip(self.order or drives, drives, strict=True))
        return frame.assign(**{name: self.signs.get(name, 1) * frame[columns[name]] for name in drives})

    @classmethod
    def from_config(cls, section: Mapping[str, Any]) -> Self:
        """From a campaign's section of the configuration, whose key `ingest` is the path."""
        given = {entry.name: section[entry.name] for entry in fields(cls)[1:] if entry.name in section}
        points = tuple(tuple(pair) for pair in given.pop("registration_points", ()))
        places = {name: tuple(place) for name, place in given.pop("targets", {}).items()}
        on_world, order = tuple(given.pop("world_targets", ())), tuple(given.pop("order", ()))
        commands = given.pop("commands", None)
        if "motion" in given:
            given["motion"] = _stated(section)
        commands = commands if isinstance(commands, Mapping) else {"file": commands}
        return cls(
            section["ingest"],
            registration_points=points,
            targets=places,
            world_targets=on_world,
            order=order,
            format=Format.from_config(given.pop("format", None)),
            commands=commands["file"],
            commands_format=Format.from_config(commands.get("format")),
            **given,
        )


def _stated(section: Mapping[str, Any]) -> StatedMotion:
    """The StatedMotion of a campaign's section; raises ConfigError with the file for a wrong one."""
    try:
        return StatedMotion.from_config(section["motion"])
    except ConfigError as error:
        raise ConfigError(f"ingest of {section['ingest']}: {error}") from error
