"""Basis of the model discrepancy: smooth functions with many free coefficients each.

They compete with the library on the same data. An effect that acts has few parameters and wins. Where a function wins,
the gap depends on the drives, the time, the place or the load in a way that the library does not hold. The verdict then
is "unexplained". What moves once, such as an instrument that is bumped, is no smooth function of the time: it makes the
readings jump at a moment, which `rrru.diagnosis.time_jumps` finds.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TypeAlias

import numpy as np
from numpy.polynomial import chebyshev

from rrru.arrays import FloatArray
from rrru.effects.protocol import Contribution, Coordinates, Effect, Motion
from rrru.kinematics.legs import TOOL, WORLD
from rrru.kinematics.robot import Robot

# a frame that turns moves what is so far from the robot's as much as its shift does
_TURNED_ABOUT_MM = 1000.0
_DRIVE_ORDERS, _TIME_ORDERS = (1, 2, 3, 4, 5, 6), (1, 2, 3)


@dataclass(frozen=True)
class Unknown:
    """A smooth function, or a jump; basis: motion to functions (n, k), or (n, K, k) of each drive, of about unit size.

    per_leg: added to each actuator value, else to each axis of each of the sites; typical: size of coefficients in the
    drive's unit or mm; turns: whether the sites turn as well; moment: of a jump, in s, None of a smooth function;
    log_prior: log probability of its moment.
    """

    name: str
    follows: str
    basis: Callable[[Motion], FloatArray]
    count: int
    needs: tuple[str, ...]
    per_leg: bool = False
    typical: float = 0.1

    drives: int = 3
    sites: tuple[str, ...] = (WORLD,)
    turns: bool = False
    moment: float | None = None
    log_prior: float = 0.0
    # capabilities of an `rrru.effects.protocol.Effect` that no function has
    with_waves = None
    switches = False
    steps = 0.0

    @property
    def along_drives(self) -> Callable[[Motion], list[FloatArray]] | None:
        """Functions (n, k) of a motion for each drive, zero where unknown; None for those of the axes."""
        return self._of_each_drive if self.per_leg else None

    def _of_each_drive(self, motion: Motion) -> list[FloatArray]:
        functions = np.nan_to_num(self._cached(motion))
        each = functions if functions.ndim == 3 else functions[:, None]
        return [*np.broadcast_to(each, (len(each), self.drives, self.count)).transpose(1, 0, 2)]

    @cached_property
    def coordinates(self) -> Coordinates:
        """One coefficient per function and drive, or axis of a site, in the drive's unit, mm or rad."""
        each = [self.typical] * 3 + [self.typical / _TURNED_ABOUT_MM] * (3 if self.turns else 0)
        size = np.repeat([self.typical] * self.drives if self.per_leg else each * len(self.sites), self.count)
        legs = np.zeros(len(size), dtype=int)
        return Coordinates(size, legs, legs > 0, lambda values, _: values, log_prior=self.log_prior)

    def contribute(self, motion: Motion, values: FloatArray) -> Contribution:
        """Changes under coefficients (drives, or sites times axes, times k,)."""
        coefficients, functions = np.reshape(values, (-1, self.count)), self._cached(motion)
        if self.per_leg:
            return motion.at_drive_functions(self._of_each_drive(motion), coefficients)
        twists = np.zeros((len(functions), len(self.sites), 6))
        moved = (functions @ coefficients.T).reshape(len(functions), len(self.sites), -1)
        twists[..., : moved.shape[-1]] = moved
        return motion.at({site: twists[:, k] for k, site in enumerate(self.sites)})

    def _cached(self, motion: Motion) -> FloatArray:
        """The functions along a motion, computed once."""
        if self.basis not in motion.cache:
            motion.cache[self.basis] = self.basis(motion)
        functions: FloatArray = motion.cache[self.basis]
        return functions


def _unit(values: FloatArray) -> FloatArray:
    """Values (n, ...) mapped to -1 to 1 over their range."""
    low, high = np.nanmin(values, axis=0), np.nanmax(values, axis=0)
    return np.asarray(2.0 * (values - low) / np.maximum(high - low, 1e-9) - 1.0)


def _chebyshev(values: FloatArray, orders: tuple[int, ...]) -> FloatArray:
    """Chebyshev functions (n, k) of some orders of values (n,) over their range."""
    return np.asarray(chebyshev.chebvander(_unit(values), max(orders))[:, orders], dtype=float)


def _of_drives(motion: Motion) -> FloatArray:
    """Chebyshev functions (n, K, k) of each drive's values."""
    return np.stack([_chebyshev(drive, _DRIVE_ORDERS) for drive in motion.drive.T], axis=1)


def _of_time(motion: Motion) -> FloatArray:
    """Chebyshev functions (n, k) of the time."""
    return _chebyshev(motion.time_s, _TIME_ORDERS)


def _of_place(motion: Motion) -> FloatArray:
    """The ten functions (n, 10) of second degree of the commanded position."""
    x, y, z = _unit(motion.position_mm).T
    return np.stack([np.ones_like(x), x, y, z, x * x, y * y, z * z, x * y, y * z, z * x], axis=-1)


def _of_load(motion: Motion) -> FloatArray:
    """The payload (n, 10) alone and with functions of the place."""
    load = motion.payload_kg / max(np.nanmax(motion.payload_kg), 1e-9)
    return np.asarray(load[:, None] * _of_place(motion))


def _of_rate(motion: Motion) -> FloatArray:
    """Speed (n, K, 2) of each drive, of unit size, and its square with the sense."""
    rate = motion.drive_rate / np.maximum(np.nanmax(np.abs(motion.drive_rate), axis=0), 1e-9)
    return np.stack([rate, rate * np.abs(rate)], axis=-1)


def _after(motion: Motion, moment: float) -> FloatArray:
    """A function (n, 1) that is 0 up to a moment in s, 1 after it, and NaN where the time is not known."""
    return np.where(np.isfinite(motion.time_s), motion.time_s > moment, np.nan)[:, None]


# what a term of a hypothesis may be of
TestedEffect: TypeAlias = Effect | Unknown
Library: TypeAlias = Mapping[str, TestedEffect]

_NO_MOMENT = partial(_after, moment=np.inf)
JUMPS = {
    function.name: function
    for function in (
        Unknown("unknown_jump", "a move of the instrument or the base", _NO_MOMENT, 1, ("time_s",), turns=True),
        Unknown("unknown_zero_jump", "zero offsets of the drives", _NO_MOMENT, 1, ("time_s",), True, 1e-4),
        Unknown("unknown_target_jump", "shifts of the targets", _NO_MOMENT, 1, ("time_s",)),
    )
}
_SMOOTH = {
    function.name: function
    for function in (
        Unknown("unknown_drive", "the drives", _of_drives, len(_DRIVE_ORDERS), (), True, 1e-4),
        Unknown("unknown_zeros", "the time, drive by drive", _of_time, len(_TIME_ORDERS), ("time_s",), True, 1e-4),
        Unknown("unknown_drift", "the time", _of_time, len(_TIME_ORDERS), ("time_s",)),
        Unknown("unknown_targets", "the time, target by target", _of_time, len(_TIME_ORDERS), ("time_s",)),
        Unknown(
            "unknown_affine",
            "the place as a rigid motion or a change of scale does",
            lambda motion: _of_place(motion)[:, :4],
            4,
            (),
        ),
        Unknown("unknown_place", "the place", _of_place, 10, ()),
        Unknown("unknown_load", "the payload", _of_load, 10, ("payload_kg",)),
        Unknown("unknown_rate", "the speeds of the drives", _of_rate, 2, ("drive_rate",), True, 1e-4),
    )
}
UNKNOWN = _SMOOTH | JUMPS
# typical size of an error of a drive, and so of a function of its value
_OF_TARGETS = ("unknown_targets", "unknown_target_jump")
_TYPICAL = {"rad": 1e-4, "mm": 0.01}


def target_sites(robot: Robot) -> tuple[str, ...]:
    """Sites of a robot's targets; none of a single one on a platform that never turns.

    There a target that moves on the platform is a base that moves.
    """
    targets: tuple[str, ...] = robot.legs.reflectors or (TOOL,)
    return targets if robot.orients or len(targets) > 1 else ()


def unknown_functions(robot: Robot) -> dict[str, Unknown]:
    """The smooth functions of UNKNOWN for a robot's drives and targets."""
    return {name: _of_robot(function, robot) for name, function in _SMOOTH.items() if _has_sites(function, robot)}


def lone_jump(effects: Collection[str]) -> frozenset[str]:
    """The jump among effects and functions, none next to another function: several together are no jump."""
    functions = UNKNOWN.keys() & set(effects)
    return frozenset(functions & JUMPS.keys() if len(functions) == 1 else ())


def jump_at(name: str, robot: Robot, moment: float, log_prior: float) -> Unknown:
    """The jump of a name in JUMPS for a robot's drives and targets, at a moment in s."""
    function = _of_robot(JUMPS[name], robot)
    return replace(function, basis=partial(_after, moment=moment), moment=moment, log_prior=log_prior)


def _of_robot(function: Unknown, robot: Robot) -> Unknown:
    """A function for a robot's drives, of the first's typical size if they are of several units, or its targets."""
    units = robot.parts.units
    if function.per_leg:
        return replace(function, typical=_TYPICAL[units[0]], drives=len(units))
    return replace(function, sites=target_sites(robot)) if function.name in _OF_TARGETS else function


def _has_sites(function: Unknown, robot: Robot) -> bool:
    """Whether a robot has what a function is of."""
    return function.name not in _OF_TARGETS or bool(target_sites(robot))
