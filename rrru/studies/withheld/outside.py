"""Causes of a gap that the library does not hold: what virtual robots get whose diagnosis has to be "unexplained".
Lengths mm, angles rad.

They are used by the plant alone. All are effects as the library's are, and enter at the same places; sizes and places
are assumed.
"""

from dataclasses import dataclass

import numpy as np

from rrru.effects.effect import LEGS, Contribution, Coordinates, plain_coordinates
from rrru.parameters import Parameter, ParameterSet

# the truth in words: outside:<name>
PREFIX = "outside"
# a rest this long ends a run
_REST_S = 10.0
_GRAVITY_M_S2 = 9.80665
_PLATFORM_KG = 4.8
_ANCHOR_MM = np.array([100.0, 900.0, 0.0])
_SLACK_MM = 1080.0
_PATTERNS = tuple({"pattern": float(k)} for k in range(1, 9))


@dataclass(frozen=True)
class Outside:
    """A cause from outside the library; law: motion and values (p,) to a Contribution."""

    name: str
    parameters: ParameterSet
    coordinates: Coordinates
    law: object
    needs: tuple = ()

    def contribute(self, motion, values):
        """Changes at the points of a motion under parameter values (p,)."""
        return self.law(motion, np.asarray(values, dtype=float))


def _shifted(shift_mm):
    """The platform shifted by (n, 3): all three U joints alike."""
    return Contribution(joint_mm=np.repeat(shift_mm[:, None], 3, axis=1))


def _rehoming(motion, values):
    """Drives that find their zero anew before every run, off by up to the repeatability (rad) of their reference
    switch.
    """
    run = np.cumsum(np.diff(motion.time_s, prepend=motion.time_s[0]) > _REST_S)
    offset = np.random.default_rng(int(values[3])).uniform(-1.0, 1.0, (run[-1] + 1, 3))
    return Contribution(drive=values[:3] * offset[run])


def _tripod_sway(motion, values):
    """The tracker's tripod sways: a sine in time with an amplitude (mm) per axis."""
    return _shifted(np.sin(2.0 * np.pi * motion.time_s / values[3])[:, None] * values[:3])


def _tripod_creep(motion, values):
    """The tracker's tripod sinks into the floor at a constant speed (mm/s) per axis."""
    return _shifted(motion.time_s[:, None] * values)


def _cable_pull(motion, values):
    """A cable to a fixed anchor, slack when near, pulls the platform off like a spring: mm of platform per mm of
    stretch.
    """
    reach = _ANCHOR_MM - motion.position_mm
    length = np.linalg.norm(reach, axis=1, keepdims=True)
    return _shifted(values[0] * np.maximum(length - _SLACK_MM, 0.0) * reach / length)


def _floor_tilt(motion, values):
    """The base tilts on a soft floor under the moment of platform and payload: rad per N mm about x and y, tracker
    standing elsewhere.
    """
    moment = (
        (_PLATFORM_KG + np.nan_to_num(motion.payload_kg))[:, None]
        * _GRAVITY_M_S2
        * motion.position_mm[:, [1, 0]]
        * [1.0, -1.0]
    )
    turn = np.concatenate([values * moment, np.zeros((len(motion), 1))], axis=1)
    return _shifted(np.cross(turn, motion.position_mm))


def _pulley_ripple(motion, values):
    """A belt pulley off centre that turns five times per turn of the drive arm: sine and cosine (rad) per drive."""
    sine, cosine = np.reshape(values, (3, 2)).T
    return Contribution(drive=sine * np.sin(5.0 * motion.drive) + cosine * np.cos(5.0 * motion.drive))


def _make(law, free, typical, fixed=(), shapes=({},)):
    """The cause of a law: free parameters (name, unit, limit), positive ones with a limit below zero's opposite only,
    and its shapes.
    """
    parameters = ParameterSet(
        (*(Parameter(name, unit, 0.0, low, high, "assumed") for name, unit, low, high in free), *fixed)
    )
    return Outside(
        law.__name__.strip("_"), parameters, plain_coordinates(parameters, typical, shapes), law, ("time_s",)
    )


def _axes(name, unit, limit):
    """Free parameters along x, y and z."""
    return tuple((f"{name}_{axis}", unit, -limit, limit) for axis in "xyz")


OUTSIDE = {
    cause.name: cause
    for cause in (
        _make(
            _rehoming,
            tuple((f"repeatability{k}", "rad", 0.0, 0.01) for k in LEGS),
            3e-4,
            (Parameter("pattern", "1", 1.0, 1.0, 1e6, "draw"),),
            _PATTERNS,
        ),
        _make(
            _tripod_sway,
            _axes("amplitude", "mm", 5.0),
            0.1,
            (Parameter("period", "s", 20.0, 1.0, 1e4, "assumed"),),
            tuple({"period": period} for period in (7.3, 19.0, 41.0)),
        ),
        _make(_tripod_creep, _axes("speed", "mm/s", 0.1), 1e-4),
        _make(_cable_pull, (("yielding", "mm/mm", 0.0, 0.1),), 1e-3),
        _make(_floor_tilt, tuple((f"softness_{axis}", "rad/(N mm)", 0.0, 1e-6) for axis in "xy"), 5e-9),
        _make(
            _pulley_ripple, tuple((f"{part}{k}", "rad", -0.01, 0.01) for k in LEGS for part in ("sine", "cosine")), 3e-4
        ),
    )
}
