"""The robots by the name that the configuration gives them. Lengths in mm, angles in rad."""

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np

from rrru.errors import ConfigError
from rrru.kinematics.general_robot import GeneralRobot
from rrru.kinematics.mobility import free_motions
from rrru.kinematics.robot import Robot
from rrru.plugins import load_object
from rrru.robots.delta import Delta
from rrru.robots.from_dh import from_dh
from rrru.robots.ptt3 import Ptt3
from rrru.robots.rrru3 import Rrru3

MECHANISMS: dict[str, type[Rrru3] | type[Ptt3] | type[Delta]] = {"rrru3": Rrru3, "ptt3": Ptt3, "delta": Delta}
# keys of which one is in an entry that describes a robot of the user's own
OWN = ("urdf", "mjcf", "dh", "module")


def tracked_set(name: str) -> str:
    """The set of parameters of a `robots:` entry that measured positions identify."""
    return MECHANISMS.get(name, GeneralRobot).TRACKED


def searched_set(name: str) -> str:
    """The set of parameters of a `robots:` entry that the genetic algorithm searches, empty for a robot without one."""
    return MECHANISMS.get(name, GeneralRobot).SEARCHED


def make_mechanism(name: str, section: Mapping[str, Any], **options: Any) -> Robot:
    """The robot of one `robots:` entry of the configuration; raises ConfigError for an unknown robot or key.

    Angles of the entry are in degrees, with keys that end in _deg. Its limits are no part of the robot.
    """
    section = {key: value for key, value in section.items() if key != "limits"}
    if any(key in section for key in OWN):
        return _own(name, dict(section), options)
    if name not in MECHANISMS:
        raise ConfigError(
            f"unknown robot {name!r}; known: {', '.join(MECHANISMS)}, or one with urdf, mjcf, dh or module"
        )
    kind = MECHANISMS[name]
    section = {
        key.replace("_deg", "_rad"): float(np.radians(value)) if key.endswith("_deg") else value
        for key, value in section.items()
    }
    known = {f.name for f in fields(kind) if f.init}
    for key in section:
        if key not in known:
            raise ConfigError(f"robot {name}: unknown key {key!r}; known: {', '.join(sorted(known))}")
    return kind(**section, **options)


def _own(name: str, section: dict[str, Any], options: Mapping[str, Any]) -> Robot:
    """A robot of the user's own from a URDF or MJCF file, DH rows or a Python module."""
    stated: dict[str, Any] = {"tool_mm": tuple(section.pop("tool_mm"))} if "tool_mm" in section else {}
    if "up" in section:
        stated["up"] = _direction(name, section.pop("up"))
    if "module" in section:
        own = load_object(f"robot {name}", section["module"])()
        if not isinstance(own, GeneralRobot):
            raise ConfigError(f"robot {name}: {section['module']} gave a {type(own).__name__}; allowed: GeneralRobot")
        if free := free_motions(own.legs, own.up):
            raise ConfigError(f"robot {name}: its platform is free to {'; '.join(free)}; allowed: legs that hold it")
        return replace(own, name=name, **stated, **options)
    if "dh" in section:
        return from_dh(section.pop("dh"), **section, name=name, **stated, **options)
    from rrru.formats import robot_file

    read, key = (robot_file.from_urdf, "urdf") if "urdf" in section else (robot_file.from_mjcf, "mjcf")
    robot: Robot = read(section.pop(key), **section, name=name, **stated, **options)
    return robot


def _direction(name: str, up: Sequence[float]) -> tuple[float, ...]:
    """The unit vector along `up`; raises ConfigError where it has no length."""
    vector = np.asarray(up, dtype=float)
    if not vector.any():
        raise ConfigError(f"robot {name}: up is {', '.join(f'{size:g}' for size in up)}; allowed: a direction")
    return tuple(vector / np.linalg.norm(vector))
