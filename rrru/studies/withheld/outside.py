"""Causes of a gap that the library does not hold, so that a diagnosis has to say "unexplained". Lengths mm, angles rad.

Effects as the library's are, used by the plant alone; sizes and places are assumed.
"""

import numpy as np

from rrru.effects.library import HOLDS, library
from rrru.effects.protocol import Effect, leg_parameters, plain_coordinates
from rrru.parameters import Parameter, ParameterSet
from rrru.robots.dynamics import GRAVITY_MM_S2, Masses
from rrru.robots.legs import WORLD
from rrru.robots.rrru3 import Rrru3

# a rest this long ends a run
_REST_S = 10.0
# with half of each forearm
_PLATFORM_KG = Masses().platform_kg + 1.5 * Masses().forearm_kg
_ANCHOR_MM = np.array([100.0, 900.0, 0.0])
_SLACK_MM = 1080.0
_PERIODS_S = (7.3, 19.0, 41.0)
_TOOTH_RAD = 0.08
_TEETH_RAD = (-0.3, 0.0, 0.3)


def _shifted(motion, shift_mm):
    """What is measured shifted by (n, 3)."""
    return motion.at({WORLD: np.concatenate([shift_mm, np.zeros_like(shift_mm)], axis=1)})


def _rehoming(motion, values):
    """Drives that find their zero anew before every run, off by up to their switch's repeatability (rad)."""
    run = np.cumsum(np.diff(motion.time_s, prepend=motion.time_s[0]) > _REST_S)
    offset = np.random.default_rng(int(values[3])).uniform(-1.0, 1.0, (run[-1] + 1, 3))
    return motion.at_drives(values[:3] * offset[run])


def _tripod_sway(motion, values):
    """The tracker's tripod sways: a sine in time with an amplitude (mm) per axis."""
    return _shifted(motion, np.sin(2.0 * np.pi * motion.time_s / values[3])[:, None] * values[:3])


def _tripod_creep(motion, values):
    """The tracker's tripod sinks into the floor at a constant speed (mm/s) per axis."""
    return _shifted(motion, motion.time_s[:, None] * values)


def _cable_pull(motion, values):
    """A cable to a fixed anchor, slack when near, pulls the platform off like a spring: mm per mm of stretch."""
    reach = _ANCHOR_MM - motion.position_mm
    length = np.linalg.norm(reach, axis=1, keepdims=True)
    return _shifted(motion, values[0] * np.maximum(length - _SLACK_MM, 0.0) * reach / length)


def _floor_tilt(motion, values):
    """The base, not the tracker, tilts on a soft floor under platform and payload: rad per N mm about x and y."""
    weight = (_PLATFORM_KG + np.nan_to_num(motion.payload_kg))[:, None] * (GRAVITY_MM_S2 / 1000.0)
    moment = weight * motion.position_mm[:, [1, 0]] * [1.0, -1.0]
    tilt = np.concatenate([values * moment, np.zeros((len(motion), 1))], axis=1)
    return _shifted(motion, np.cross(tilt, motion.position_mm))


def _damaged_tooth(motion, values):
    """A tooth of each drive's wheel is dented: the arm lags (rad) where it meets, a few degrees wide."""
    return motion.at_drives(values[:3] * np.exp(-(((motion.drive - values[3]) / _TOOTH_RAD) ** 2)))


def _make(law, parameters, typical, shapes=({},)):
    """The cause of a law with its parameters, typical sizes of those that no shape fixes, and its shapes."""
    parameters = ParameterSet(parameters)
    coordinates = plain_coordinates(parameters, typical, shapes)
    return Effect(law.__name__.strip("_"), parameters, coordinates, law, ("time_s",))


def _axes(name, unit, limit):
    """Parameters along x, y and z."""
    return tuple(Parameter(f"{name}_{axis}", unit, 0.0, -limit, limit, "assumed") for axis in "xyz")


_REPEATABILITY = leg_parameters("assumed", ("repeatability", "rad", 0.0, 0.01))
_PATTERN = Parameter("pattern", "1", 1.0, 1.0, 1e6, "draw")
_PERIOD = Parameter("period", "s", 20.0, 1.0, 1e4, "assumed")
_YIELDING = Parameter("yielding", "mm/mm", 0.0, 0.0, 0.1, "assumed")
_SOFTNESS = tuple(Parameter(f"softness_{axis}", "rad/(N mm)", 0.0, 0.0, 1e-6, "assumed") for axis in "xy")
_DENTS = leg_parameters("assumed", ("dent", "rad", -0.01, 0.01))
_TOOTH = Parameter("tooth", "rad", 0.0, -1.0, 1.0, "assumed")

OUTSIDE = {
    cause.name: cause
    for cause in (
        _make(_rehoming, (*_REPEATABILITY, _PATTERN), 3e-4, tuple({"pattern": float(k)} for k in range(1, 9))),
        _make(_tripod_sway, (*_axes("amplitude", "mm", 5.0), _PERIOD), 0.1, tuple({"period": s} for s in _PERIODS_S)),
        _make(_tripod_creep, _axes("speed", "mm/s", 0.1), 1e-4),
        _make(_cable_pull, (_YIELDING,), 1e-3),
        _make(_floor_tilt, _SOFTNESS, 5e-9),
        _make(_damaged_tooth, (*_DENTS, _TOOTH), 3e-4, tuple({"tooth": rad} for rad in _TEETH_RAD)),
    )
}
_LIBRARY = library(Rrru3())
# of the library and from outside, whatever may act in a robot of the check, all of which are 3-RRRUs; what holds others
# is a background, no cause that is drawn
EFFECTS = {name: effect for name, effect in _LIBRARY.items() if name not in HOLDS}
CAUSES = _LIBRARY | OUTSIDE
