"""Basis of the model discrepancy: smooth functions with many free coefficients each.

They compete with the library on the same data. An effect that acts has few parameters and wins. Where a function wins,
the gap depends on the drives, the time, the place or the load in a way that the library does not hold. The verdict then
is "unexplained".
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import chebyshev

from rrru.effects.protocol import Coordinates
from rrru.kinematics.legs import WORLD

_DRIVE_ORDERS, _TIME_ORDERS = (1, 2, 3, 4, 5, 6), (1, 2, 3)


@dataclass(frozen=True)
class Unknown:
    """A smooth function; basis: motion, or a drive's values per_leg, to (n, k) functions of about unit size.

    per_leg: added to each actuator value, else to each axis; typical: size of coefficients in the drive's unit or mm.
    """

    name: str
    follows: str
    basis: object
    count: int
    needs: tuple
    per_leg: bool = False
    typical: float = 0.1

    drives: int = 3
    # capabilities of an `rrru.effects.protocol.Effect` that no function has
    along_drives = with_waves = None
    switches = False

    @property
    def coordinates(self):
        """One coefficient per function and drive or axis, in the drive's unit or mm."""
        legs = np.zeros((self.drives if self.per_leg else 3) * self.count, dtype=int)
        return Coordinates(np.full(len(legs), self.typical), legs, legs > 0, lambda values, _: values)

    def contribute(self, motion, values):
        """Changes under coefficients (drives or axes times k,)."""
        coefficients = np.reshape(values, (-1, self.count))
        if self.per_leg:
            functions = self._cached(motion, lambda: np.stack([self.basis(drive) for drive in motion.drive.T], axis=1))
            return motion.at_drives(np.einsum("nlk,lk->nl", functions, coefficients))
        shift = self._cached(motion, lambda: self.basis(motion)) @ coefficients.T
        return motion.at({WORLD: np.concatenate([shift, np.zeros_like(shift)], axis=1)})

    def _cached(self, motion, make):
        """The functions along a motion, computed once."""
        if self.name not in motion.cache:
            motion.cache[self.name] = make()
        return motion.cache[self.name]


def _unit(values):
    """Values (n, ...) mapped to -1 to 1 over their range."""
    low, high = np.nanmin(values, axis=0), np.nanmax(values, axis=0)
    return 2.0 * (values - low) / np.maximum(high - low, 1e-9) - 1.0


def _of_angle(angle):
    """Chebyshev functions (n, k) of one drive's values."""
    return chebyshev.chebvander(_unit(angle), max(_DRIVE_ORDERS))[:, _DRIVE_ORDERS]


def _of_time(motion):
    """Chebyshev functions (n, k) of the time."""
    return chebyshev.chebvander(_unit(motion.time_s), max(_TIME_ORDERS))[:, _TIME_ORDERS]


def _of_place(motion):
    """The ten functions (n, 10) of second degree of the commanded position."""
    x, y, z = _unit(motion.position_mm).T
    return np.stack([np.ones_like(x), x, y, z, x * x, y * y, z * z, x * y, y * z, z * x], axis=-1)


def _of_load(motion):
    """The payload (n, 10) alone and with functions of the place."""
    load = motion.payload_kg / max(np.nanmax(motion.payload_kg), 1e-9)
    return load[:, None] * _of_place(motion)


UNKNOWN = {
    function.name: function
    for function in (
        Unknown("unknown_drive", "the drives", _of_angle, len(_DRIVE_ORDERS), (), True, 1e-4),
        Unknown("unknown_drift", "the time", _of_time, len(_TIME_ORDERS), ("time_s",)),
        Unknown(
            "unknown_affine",
            "the place as a rigid motion or a change of scale does",
            lambda motion: _of_place(motion)[:, :4],
            4,
            (),
        ),
        Unknown("unknown_place", "the place", _of_place, 10, ()),
        Unknown("unknown_load", "the payload", _of_load, 10, ("payload_kg",)),
    )
}
# typical size of an error of a drive, and so of a function of its value
_TYPICAL = {"rad": 1e-4, "mm": 0.01}


def unknown_functions(robot):
    """UNKNOWN for a robot's drives; for those of several units the first's typical size."""
    units = robot.parts.units
    return {
        name: replace(function, typical=_TYPICAL[units[0]], drives=len(units)) if function.per_leg else function
        for name, function in UNKNOWN.items()
    }
