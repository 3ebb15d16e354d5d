"""The library of effects by name, read from the files of this folder, and user-defined effects by `module:object`.

A file of the library has a function `for_robot`, from a robot to its Effect, None where the robot has no site for it.
"""

import importlib
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import fields
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import ActiveEffect, Contribution, Coordinates, Effect, Motion, plain_coordinates
from rrru.errors import ConfigError
from rrru.kinematics.robot import Robot
from rrru.parameters import ParameterSet
from rrru.plugins import load_object

# the order of tables and draws; effects that are not listed here follow by their files' names
_ORDER = (
    *("backlash", "drive_compliance", "link_flexure", "joint_clearance", "leg_asymmetry", "axis_tilt", "rail_tilt"),
    *("base_placement", "frame_misregistration", "encoder_eccentricity", "transmission_error", "thermal_growth"),
    *("lead_error", "screw_growth", "servo_lag", "bar_mismatch", "tool_offset", "joint_axis_error", "cross_compliance"),
)
# names of other things in results, settings and estimates, which no effect of a user's may have
RESERVED = (
    *("none", "unexplained", "weight", "shape", "geometry", "calibration", "sampling", "scatter", "runs", "instrument"),
    *("unknown_drive", "unknown_zeros", "unknown_drift", "unknown_targets"),
    *("unknown_affine", "unknown_place", "unknown_load", "unknown_rate"),
    *("unknown_jump", "unknown_zero_jump", "unknown_target_jump"),
)
# fields of a Motion that an effect may need
_NEEDS = tuple(one.name for one in fields(Motion) if one.name not in ("robot", "path_index", "load_slopes", "approach"))
# a user's effect that names no typical sizes gets this share of its bounds' width
_TYPICAL_SHARE = 0.1


def _names() -> tuple[str, ...]:
    """Names of the folder's effects in their order."""
    files = {info.name for info in pkgutil.iter_modules([str(Path(__file__).parent)])}
    names = {name for name in files - {Path(__file__).stem} if hasattr(_module(name), "for_robot")}
    return *(name for name in _ORDER if name in names), *sorted(names.difference(_ORDER))


def _module(name: str) -> ModuleType:
    """The module of one file of the folder."""
    return importlib.import_module(f"rrru.effects.{name}")


def _made(name: str, robot: Robot) -> Effect | None:
    """The effect of one file of the folder on a robot, None where the robot has no site for it."""
    effect: Effect | None = _module(name).for_robot(robot)
    return effect


NAMES = _names()
# effects that contain others as special cases: the number of parameters alone separates them (Occam factor)
HOLDS = {
    "joint_axis_error": ("leg_asymmetry", "axis_tilt", "rail_tilt", "base_placement"),
    "friction_windup": ("backlash",),
    "link_growth": ("thermal_growth",),
    "drive_error_function": ("encoder_eccentricity", "encoder_ovality", "transmission_error", "transmission_orders"),
    "transmission_orders": ("encoder_eccentricity", "encoder_ovality", "transmission_error"),
}


def library(robot: Robot) -> dict[str, Effect]:
    """The library's effects that a robot may have, by name."""
    made = {name: _made(name, robot) for name in NAMES}
    return {name: effect for name, effect in made.items() if effect is not None}


def find(name: str, robot: Robot) -> Effect | None:
    """The effect on a robot of a library name or of `module:object`, an effect or a class without arguments.

    The module lies in the working directory or is installed. None for a library's effect that the robot cannot have.

    A user's effect needs name, parameters and contribute; without `coordinates` these are the parameters with a tenth
    of their bounds' width as typical size, without `needs` nothing is needed. Raises ConfigError where there is none or
    where it is incomplete.
    """
    if name in NAMES:
        return _made(name, robot)
    module_name, colon, object_name = name.partition(":")
    if not (colon and object_name and all(part.isidentifier() for part in module_name.split("."))):
        near = get_close_matches(name, NAMES, n=1)
        meant = f"; did you mean {near[0]}?" if near else f"; known: {', '.join(NAMES)}"
        raise ConfigError(f"unknown effect {name!r}{meant}, or module:object for one of your own")
    return _complete(name, _load(name))


def active_effects(section: Mapping[str, Mapping[str, float]] | None, robot: Robot) -> tuple[ActiveEffect, ...]:
    """Effects of a robot with their values from a mapping {effect: {parameter: value}}.

    Raises ConfigError for unknown names and for values out of bounds.
    """
    result = []
    for name, values in dict(section or {}).items():
        effect = find(name, robot)
        if effect is None:
            raise ConfigError(f"effect {name!r} is none of a {robot.name}; known: {', '.join(library(robot))}")
        for key, value in values.items():
            allowed = effect.parameters[key]
            if not allowed.low <= value <= allowed.high:
                bounds = f"{allowed.low} to {allowed.high}"
                raise ConfigError(f"effect {name}: {key} is {value} {allowed.unit}; allowed: {bounds}")
        result.append(ActiveEffect(effect, dict(values)))
    return tuple(result)


def _load(name: str) -> Any:
    """The object named by `module:object`, an instance where it is a class."""
    named = load_object(f"effect {name!r}", name)
    if not isinstance(named, type):
        return named
    try:
        return named()
    except TypeError as error:
        allowed = "a class without arguments, or an object"
        raise ConfigError(f"effect {name!r}: cannot make one: {error}; allowed: {allowed}") from error


def _complete(name: str, users: Any) -> Effect:
    """The user's effect with its contributions checked and with defaults for what it may leave out."""
    missing = [part for part in ("name", "parameters", "contribute") if not hasattr(users, part)]
    if missing:
        raise ConfigError(f"effect {name!r} lacks {', '.join(missing)}; needed: name, parameters, contribute")
    if not isinstance(users.parameters, ParameterSet) or not callable(users.contribute):
        raise ConfigError(f"effect {name!r}: parameters is no rrru.parameters.ParameterSet or contribute no function")
    _check_name(name, users.name)
    needs = getattr(users, "needs", ())
    if isinstance(needs, str) or (unknown := [need for need in needs if need not in _NEEDS]):
        found = f"needs {unknown[0]!r}" if not isinstance(needs, str) else f"has needs = {needs!r}, a text"
        raise ConfigError(f"effect {name!r} {found}; allowed: a tuple of {', '.join(_NEEDS)}")
    coordinates = getattr(users, "coordinates", None)
    if coordinates is None:
        coordinates = _default_coordinates(name, users.parameters)
    checked = partial(_checked, name, users.contribute)
    return Effect(users.name, users.parameters, coordinates, checked, tuple(needs))


def _check_name(name: str, own: str) -> None:
    """Raise ConfigError where a user's effect has a name that tables and settings cannot hold."""
    if own in NAMES:
        raise ConfigError(f"effect {name!r}: its name {own!r} belongs to the library; allowed: another one")
    if own in RESERVED:
        allowed = f"a name other than {', '.join(RESERVED)}"
        raise ConfigError(f"effect {name!r}: its name {own!r} has another meaning in results; allowed: {allowed}")
    if not (isinstance(own, str) and own.isidentifier()):
        raise ConfigError(f"effect {name!r}: its name is {own!r}; allowed: letters, digits and _, such as my_effect")


def _checked(
    name: str, contribute: Callable[[Motion, FloatArray], Contribution], motion: Motion, values: FloatArray
) -> Contribution:
    """A user's contribution in full shape; raises ConfigError where it fails or does not fit."""
    try:
        result = contribute(motion, values)
    except Exception as error:
        raise ConfigError(f"effect {name!r}: contribute failed with {type(error).__name__}: {error}") from error
    if not isinstance(result, Contribution):
        raise ConfigError(f"effect {name!r}: contribute gave a {type(result).__name__}; allowed: a Contribution")
    shape = (len(motion), len(motion.robot.legs.sites), 6)
    try:
        return Contribution(np.broadcast_to(np.asarray(result.twists, dtype=float), shape))
    except ValueError as error:
        given = np.shape(result.twists)
        raise ConfigError(f"effect {name!r}: its twists have the shape {given}; allowed: {shape}") from error


def _default_coordinates(name: str, parameters: ParameterSet) -> Coordinates:
    """Plain coordinates with a share of the bounds' width as typical sizes."""
    width = parameters.high - parameters.low
    for parameter in np.array(parameters.names)[~np.isfinite(width)]:
        allowed = "finite bounds, or coordinates of the effect's own"
        raise ConfigError(f"effect {name!r}: {parameter} has no finite bounds; allowed: {allowed}")
    return plain_coordinates(parameters, _TYPICAL_SHARE * width)
