"""The library of effects by name, read from the files of this folder, and effects of one's own by `module:object`.

A file of the library has a tuple EFFECTS of one Effect, or of one per kind of drives where the law differs.
"""

import importlib
import pkgutil
import sys
from functools import partial
from pathlib import Path

import numpy as np

from rrru.effects.protocol import PLACES, ActiveEffect, Contribution, Effect, plain_coordinates
from rrru.errors import ConfigError
from rrru.parameters import ParameterSet

# the order of tables and draws; what is not named here follows by its file's name
_ORDER = (
    *("backlash", "drive_compliance", "link_flexure", "joint_clearance", "leg_asymmetry", "axis_tilt", "rail_tilt"),
    *("base_placement", "frame_misregistration", "encoder_eccentricity", "transmission_error", "thermal_growth"),
    "servo_lag",
)
# a user's effect that names no typical sizes gets this share of its bounds' width
_TYPICAL_SHARE = 0.1


def _effects():
    """All effects of the folder's files in their order."""
    names = {info.name for info in pkgutil.iter_modules([str(Path(__file__).parent)])} - {Path(__file__).stem}
    ordered = (*(name for name in _ORDER if name in names), *sorted(names.difference(_ORDER)))
    modules = (importlib.import_module(f"rrru.effects.{name}") for name in ordered)
    return tuple(effect for module in modules for effect in getattr(module, "EFFECTS", ()))


# by unit of the actuator values; robots with screw- or belt-driven sliders have some laws in other units
LIBRARY = {unit: {effect.name: effect for effect in _effects() if unit in effect.drives} for unit in ("rad", "mm")}
EFFECTS, SLIDER_EFFECTS = LIBRARY["rad"], LIBRARY["mm"]


def find(name, drive_unit="rad"):
    """The effect of a library name or of `module:object`, an effect or a class without arguments.

    The module lies in the working directory or is installed. drive_unit: "rad" or "mm", that of the robot's actuator
    values. None for a name that is an effect of the other kind of drives only.

    A user's effect needs name, parameters and contribute; without `coordinates` these are the parameters with a tenth
    of their bounds' width as typical size, without `needs` nothing is needed. Raises ConfigError where there is none or
    where it is incomplete.
    """
    if any(name in library for library in LIBRARY.values()):
        return LIBRARY[drive_unit].get(name)
    module_name, colon, object_name = name.partition(":")
    if not (colon and object_name and all(part.isidentifier() for part in module_name.split("."))):
        known = ", ".join(EFFECTS | SLIDER_EFFECTS)
        raise ConfigError(f"unknown effect {name!r}; known: {known}, or module:object for one of your own")
    return _complete(name, _load(name, module_name, object_name))


def active_effects(section, drive_unit="rad"):
    """Effects with their values from a mapping {effect: {parameter: value}}.

    Raises ConfigError for unknown names and for values out of bounds.
    """
    result = []
    for name, values in dict(section or {}).items():
        effect = find(name, drive_unit)
        if effect is None:
            known = ", ".join(LIBRARY[drive_unit])
            raise ConfigError(f"effect {name!r} is none of a robot with drives in {drive_unit}; known: {known}")
        for key, value in values.items():
            allowed = effect.parameters[key]
            if not allowed.low <= value <= allowed.high:
                bounds = f"{allowed.low} to {allowed.high}"
                raise ConfigError(f"effect {name}: {key} is {value} {allowed.unit}; allowed: {bounds}")
        result.append(ActiveEffect(effect, dict(values)))
    return tuple(result)


def _load(name, module_name, object_name):
    """The object that `module:object` stands for, an instance where it is a class."""
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.insert(0, here)
    try:
        module = importlib.import_module(module_name)
    except ImportError as error:
        place = f"{module_name!r} from {here} or the installed packages"
        raise ConfigError(f"effect {name!r}: cannot import {place}: {error}") from error
    if not hasattr(module, object_name):
        raise ConfigError(f"effect {name!r}: module {module_name} has no {object_name!r}")
    named = getattr(module, object_name)
    if not isinstance(named, type):
        return named
    try:
        return named()
    except TypeError as error:
        allowed = "a class without arguments, or an object"
        raise ConfigError(f"effect {name!r}: cannot make one: {error}; allowed: {allowed}") from error


def _complete(name, own):
    """The user's effect with its contributions checked and with defaults for what it may leave out."""
    missing = [part for part in ("name", "parameters", "contribute") if not hasattr(own, part)]
    if missing:
        raise ConfigError(f"effect {name!r} lacks {', '.join(missing)}; needed: name, parameters, contribute")
    if not isinstance(own.parameters, ParameterSet) or not callable(own.contribute):
        raise ConfigError(f"effect {name!r}: parameters is no rrru.parameters.ParameterSet or contribute no function")
    if own.name in EFFECTS | SLIDER_EFFECTS:
        raise ConfigError(f"effect {name!r}: its name {own.name!r} belongs to the library; allowed: another one")
    coordinates = getattr(own, "coordinates", None)
    if coordinates is None:
        coordinates = _default_coordinates(name, own.parameters)
    law = partial(_checked, name, own.contribute)
    return Effect(own.name, own.parameters, coordinates, law, tuple(getattr(own, "needs", ())))


def _checked(name, contribute, motion, values):
    """A user's contribution in full shape; raises ConfigError where it fails or does not fit."""
    try:
        result = contribute(motion, values)
    except Exception as error:
        raise ConfigError(f"effect {name!r}: contribute failed with {type(error).__name__}: {error}") from error
    if not isinstance(result, Contribution):
        raise ConfigError(f"effect {name!r}: contribute gave a {type(result).__name__}; allowed: a Contribution")
    n = len(motion)
    shapes = {"drive": (n, 3), "length_mm": (n, 3, 5), "joint_mm": (n, 3, 3)}
    shapes |= {"displacement": (3, len(PLACES), 6), "frame": (6,)}
    return Contribution(**{key: _full(name, key, getattr(result, key), shape) for key, shape in shapes.items()})


def _full(name, key, value, shape):
    """A contribution's part in full shape, or the number 0."""
    if np.ndim(value) == 0 and value == 0.0:
        return 0.0
    try:
        return np.broadcast_to(np.asarray(value, dtype=float), shape)
    except ValueError as error:
        raise ConfigError(f"effect {name!r}: {key} has the shape {np.shape(value)}; allowed: {shape}") from error


def _default_coordinates(name, parameters):
    """Plain coordinates with a share of the bounds' width as typical sizes."""
    width = parameters.high - parameters.low
    for parameter in np.array(parameters.names)[~np.isfinite(width)]:
        allowed = "finite bounds, or coordinates of the effect's own"
        raise ConfigError(f"effect {name!r}: {parameter} has no finite bounds; allowed: {allowed}")
    return plain_coordinates(parameters, _TYPICAL_SHARE * width)
