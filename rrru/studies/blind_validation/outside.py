"""Causes of a gap outside the library, for which the correct verdict is "unexplained". Lengths mm, angles rad.

They are Effects like those of the library, but only the plant uses them. Sizes and places are assumed.
"""

import numpy as np

from rrru.effects.library import HOLDS, library
from rrru.effects.protocol import Effect, leg_parameters, plain_coordinates
from rrru.kinematics.legs import WORLD
from rrru.parameters import Parameter, ParameterSet
from rrru.robots.rrru3 import Rrru3

# a rest this long ends a run
_REST_S = 10.0
_ANCHOR_MM = np.array([100.0, 900.0, 0.0])
_SLACK_MM = 1080.0
_PERIODS_S = (7.3, 19.0, 41.0)
_SHARES = (0.3, 0.5, 0.7)


def _shifted(motion, shift_mm):
    """The measured positions shifted by (n, 3)."""
    return motion.at({WORLD: np.concatenate([shift_mm, np.zeros_like(shift_mm)], axis=1)})


def _rehoming(motion, values):
    """The drives are homed before every run, with errors up to their switch's repeatability (rad)."""
    run = np.cumsum(np.diff(motion.time_s, prepend=motion.time_s[0]) > _REST_S)
    offset = np.random.default_rng(int(values[3])).uniform(-1.0, 1.0, (run[-1] + 1, 3))
    return motion.at_drives(values[:3] * offset[run])


def _tripod_sway(motion, values):
    """The tracker's tripod sways: a sine in time with an amplitude (mm) per axis."""
    return _shifted(motion, np.sin(2.0 * np.pi * motion.time_s / values[3])[:, None] * values[:3])


def _tracker_bump(motion, values):
    """The tracker is bumped once: after a fraction of the campaign's time its readings are shifted (mm) per axis."""
    passed = (motion.time_s - motion.time_s[0]) / np.ptp(motion.time_s)
    return _shifted(motion, (passed > values[3])[:, None] * values[:3])


def _cable_pull(motion, values):
    """A cable to a fixed anchor, slack when near, pulls the platform off like a spring: mm per mm of stretch."""
    reach = _ANCHOR_MM - motion.position_mm
    length = np.linalg.norm(reach, axis=1, keepdims=True)
    return _shifted(motion, values[0] * np.maximum(length - _SLACK_MM, 0.0) * reach / length)


def _make(contribution, parameters, typical, shapes=({},)):
    """The Effect of a contribution with its parameters, typical sizes of those that no shape fixes, and its shapes."""
    parameters = ParameterSet(parameters)
    coordinates = plain_coordinates(parameters, typical, shapes)
    return Effect(contribution.__name__.strip("_"), parameters, coordinates, contribution, ("time_s",))


def _axes(name, unit, limit):
    """Parameters along x, y and z."""
    return tuple(Parameter(f"{name}_{axis}", unit, 0.0, -limit, limit, "assumed") for axis in "xyz")


_REPEATABILITY = leg_parameters("assumed", ("repeatability", "rad", 0.0, 0.01))
_PATTERN = Parameter("pattern", "1", 1.0, 1.0, 1e6, "draw")
_PERIOD = Parameter("period", "s", 20.0, 1.0, 1e4, "assumed")
_YIELDING = Parameter("yielding", "mm/mm", 0.0, 0.0, 0.1, "assumed")
_BUMPED = Parameter("bumped", "1", 0.5, 0.0, 1.0, "assumed")

OUTSIDE = {
    cause.name: cause
    for cause in (
        _make(_rehoming, (*_REPEATABILITY, _PATTERN), 3e-4, tuple({"pattern": float(k)} for k in range(1, 9))),
        _make(_tripod_sway, (*_axes("amplitude", "mm", 5.0), _PERIOD), 0.1, tuple({"period": s} for s in _PERIODS_S)),
        _make(_tracker_bump, (*_axes("shift", "mm", 5.0), _BUMPED), 0.1, tuple({"bumped": at} for at in _SHARES)),
        _make(_cable_pull, (_YIELDING,), 1e-3),
    )
}
_LIBRARY = library(Rrru3())
# these campaigns cannot show them: no stops at points, no temperature recorded, all lengths calibrated
_UNSEEN = ("read_before_rest", "thermal_expansion", "tracker_scale")


def drawn_effects(known):
    """Effects by name of a robot's library that may be drawn as causes.

    An effect with others as special cases is a background and not drawn.
    """
    return {name: effect for name, effect in known.items() if name not in (*HOLDS, *_UNSEEN)}


# every effect, of the library and from outside it, that may act in a 3-RRRU of the check
EFFECTS = drawn_effects(_LIBRARY)
CAUSES = _LIBRARY | OUTSIDE
