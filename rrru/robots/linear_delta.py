"""A linear delta as its firmware describes it: the 3-PTT with upright rails and own nominal numbers of every tower."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from rrru.arrays import FloatArray
from rrru.errors import ConfigError
from rrru.robots.ptt3 import Ptt3

# ASSUME firmware states only the difference of the radii; this platform radius acts on its tilt only
_PLATFORM_MM = 30.0


@dataclass(frozen=True)
class LinearDelta(Ptt3):
    """Ptt3 whose slider positions count up from the frame's zero marks plus zero_mm; see `linear_delta`.

    arms_mm, zero_mm: per tower.
    """

    arms_mm: tuple[float, float, float] = (350.0, 350.0, 350.0)
    zero_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @cached_property
    def nominal_legs(self) -> FloatArray:
        """Numbers of the legs (3, 6) without errors."""
        legs = np.zeros((3, 6))
        legs[:, 0], legs[:, 1], legs[:, 2] = self.zero_mm, self.arms_mm, self.R_mm - self.r_mm
        return legs


def linear_delta(
    radius_mm: float,
    azimuth_rad: Sequence[float],
    arms_mm: npt.ArrayLike,
    endstop_mm: npt.ArrayLike,
    parameter_set: str,
    angle_limit_rad: float = 1.0,
    length_limit_mm: float = 1e4,
) -> LinearDelta:
    """The mechanism of a printer, whose slider positions are minus the distance down from their endstops.

    radius_mm: tower circle less joint offsets; azimuth_rad, arms_mm, endstop_mm: (3,) per tower; parameter_set:
    "heights" or "distances" of the 3-PTT. The carriage's height is endstop + sqrt(arm^2 - radius^2) less that distance.
    Raises ConfigError for arms that are too short.
    """
    arms = np.asarray(arms_mm, dtype=float)
    if not (arms > radius_mm).all():
        allowed = f"longer than the radius, {radius_mm:g} mm"
        raise ConfigError(f"linear delta: an arm of {arms.min():g} mm; allowed: {allowed}")
    first, second, third = azimuth_rad
    zero = np.asarray(endstop_mm, dtype=float) + np.sqrt(arms**2 - radius_mm**2)
    return LinearDelta(
        L_mm=float(arms.mean()),
        R_mm=radius_mm + _PLATFORM_MM,
        r_mm=_PLATFORM_MM,
        rail_inclination_rad=np.pi / 2.0,
        azimuth_rad=(first, second, third),
        parameter_set=parameter_set,
        angle_limit_rad=angle_limit_rad,
        length_limit_mm=length_limit_mm,
        arms_mm=tuple(arms),
        zero_mm=tuple(zero),
    )
