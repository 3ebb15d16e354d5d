"""The library of effects by name, and effects of one's own by `module:object`."""

import importlib
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rrru.effects import backlash, drive_compliance, joint_clearance, leg_asymmetry, link_flexure, transmission_error
from rrru.effects.axis_tilt import AxisTilt
from rrru.effects.backlash import Backlash
from rrru.effects.base_placement import BasePlacement
from rrru.effects.drive_compliance import DriveCompliance
from rrru.effects.effect import PLACES, ActiveEffect, Contribution, Coordinates, plain_coordinates
from rrru.effects.encoder_eccentricity import EncoderEccentricity
from rrru.effects.frame_misregistration import FrameMisregistration
from rrru.effects.joint_clearance import JointClearance
from rrru.effects.leg_asymmetry import LegAsymmetry
from rrru.effects.link_flexure import LinkFlexure
from rrru.effects.rail_tilt import RailTilt
from rrru.effects.servo_lag import ServoLag
from rrru.effects.thermal_growth import ThermalGrowth
from rrru.effects.transmission_error import TransmissionError
from rrru.errors import ConfigError
from rrru.parameters import ParameterSet

EFFECTS = {
    effect.name: effect
    for effect in (
        Backlash(),
        DriveCompliance(),
        LinkFlexure(),
        JointClearance(),
        LegAsymmetry(),
        AxisTilt(),
        BasePlacement(),
        FrameMisregistration(),
        EncoderEccentricity(),
        TransmissionError(),
        ThermalGrowth(),
        ServoLag(),
    )
}
# of robots with screw- or belt-driven sliders: some laws in other units, rails instead of axes
SLIDER_EFFECTS = {
    effect.name: effect
    for effect in (
        backlash.SLIDER,
        drive_compliance.SLIDER,
        link_flexure.SLIDER,
        joint_clearance.SLIDER,
        leg_asymmetry.SLIDER,
        RailTilt(),
        BasePlacement(),
        FrameMisregistration(),
        transmission_error.SLIDER,
        ThermalGrowth(),
        ServoLag(),
    )
}
LIBRARY = {"rad": EFFECTS, "mm": SLIDER_EFFECTS}
# a user's effect that names no typical sizes gets this share of its bounds' width
_TYPICAL_SHARE = 0.1


@dataclass(frozen=True)
class UserEffect:
    """An effect from outside the package: its law, with what it left out filled in. label: the `module:object` that it
    was found by.
    """

    name: str
    parameters: ParameterSet
    coordinates: Coordinates
    needs: tuple
    law: object
    label: str

    def contribute(self, motion, values):
        """Changes at the points of a motion under parameter values (p,), in full shape; raises ConfigError where it
        fails or does not fit.
        """
        try:
            result = self.law.contribute(motion, values)
        except Exception as error:
            raise ConfigError(
                f"effect {self.label!r}: contribute failed with {type(error).__name__}: {error}"
            ) from error
        if not isinstance(result, Contribution):
            raise ConfigError(
                f"effect {self.label!r}: contribute gave a {type(result).__name__}; allowed: a Contribution"
            )
        shapes = {
            "drive": (len(motion), 3),
            "length_mm": (len(motion), 3, 5),
            "joint_mm": (len(motion), 3, 3),
            "displacement": (3, len(PLACES), 6),
            "frame": (6,),
        }
        return Contribution(**{key: self._full(key, getattr(result, key), shape) for key, shape in shapes.items()})

    def _full(self, key, value, shape):
        """A contribution's part in full shape, or the number 0."""
        if np.ndim(value) == 0 and value == 0.0:
            return 0.0
        try:
            return np.broadcast_to(np.asarray(value, dtype=float), shape)
        except ValueError as error:
            raise ConfigError(
                f"effect {self.label!r}: {key} has the shape {np.shape(value)}; allowed: {shape}"
            ) from error


def find(name, drive_unit="rad"):
    """The effect of a library name or of `module:object`, an effect or a class without arguments in a module of the
    working directory.

    drive_unit: "rad" or "mm", that of the robot's actuator values. None for a name that is an effect of the other kind
    of drives only.

    A user's effect needs name, parameters and contribute; without `coordinates` these are the parameters with a tenth
    of their bounds' width as typical size, without `needs` nothing is needed. Raises ConfigError where there is none or
    where it is incomplete.
    """
    if any(name in library for library in LIBRARY.values()):
        return LIBRARY[drive_unit].get(name)
    module_name, colon, object_name = name.partition(":")
    if not (colon and object_name and all(part.isidentifier() for part in module_name.split("."))):
        raise ConfigError(
            f"unknown effect {name!r}; known: {', '.join(EFFECTS | SLIDER_EFFECTS)}, or module:object for one of your own"
        )
    return _complete(name, _load(name, module_name, object_name))


def active_effects(section, drive_unit="rad"):
    """Effects with their values from a mapping {effect: {parameter: value}}; raises ConfigError for unknown names and
    values out of bounds.
    """
    result = []
    for name, values in dict(section or {}).items():
        effect = find(name, drive_unit)
        if effect is None:
            raise ConfigError(
                f"effect {name!r} is none of a robot with drives in {drive_unit}; known: {', '.join(LIBRARY[drive_unit])}"
            )
        for key, value in values.items():
            allowed = effect.parameters[key]
            if not allowed.low <= value <= allowed.high:
                raise ConfigError(
                    f"effect {name}: {key} is {value} {allowed.unit}; allowed: {allowed.low} to {allowed.high}"
                )
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
        raise ConfigError(
            f"effect {name!r}: cannot import {module_name!r} from {here} or the installed packages: {error}"
        ) from error
    if not hasattr(module, object_name):
        raise ConfigError(f"effect {name!r}: module {module_name} has no {object_name!r}")
    found = getattr(module, object_name)
    if not isinstance(found, type):
        return found
    try:
        return found()
    except TypeError as error:
        raise ConfigError(
            f"effect {name!r}: cannot make one: {error}; allowed: a class without arguments, or an object"
        ) from error


def _complete(name, law):
    """The user's effect with defaults for what it may leave out."""
    missing = [part for part in ("name", "parameters", "contribute") if not hasattr(law, part)]
    if missing:
        raise ConfigError(f"effect {name!r} lacks {', '.join(missing)}; needed: name, parameters, contribute")
    if not isinstance(law.parameters, ParameterSet) or not callable(law.contribute):
        raise ConfigError(f"effect {name!r}: parameters is no rrru.parameters.ParameterSet or contribute no function")
    if law.name in EFFECTS | SLIDER_EFFECTS:
        raise ConfigError(f"effect {name!r}: its name {law.name!r} belongs to the library; allowed: another one")
    coordinates = getattr(law, "coordinates", None)
    if coordinates is None:
        coordinates = _default_coordinates(name, law.parameters)
    return UserEffect(law.name, law.parameters, coordinates, tuple(getattr(law, "needs", ())), law, name)


def _default_coordinates(name, parameters):
    """Plain coordinates with a share of the bounds' width as typical sizes."""
    width = parameters.high - parameters.low
    for parameter in np.array(parameters.names)[~np.isfinite(width)]:
        raise ConfigError(
            f"effect {name!r}: {parameter} has no finite bounds; allowed: finite bounds, or coordinates of the effect's own"
        )
    return plain_coordinates(parameters, _TYPICAL_SHARE * width)
