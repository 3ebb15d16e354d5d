"""Hexapod, 6-UPS: a platform on six legs whose lengths are driven (Stewart, Proc. Inst. Mech. Eng. 180, 1965).

Each leg is a bar between two ball joints, whose length is the actuator value. With 3 numbers of either joint's place
and one of the length, 42 numbers describe its errors. Lengths in mm, angles in rad.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from rrru.arrays import FloatArray
from rrru.errors import ConfigError
from rrru.kinematics.general_robot import GeneralRobot
from rrru.kinematics.legs import Bar, Drive, Joint, Leg, Legs, Parts, unit_twist


def hexapod(
    base_mm: npt.ArrayLike,
    platform_mm: npt.ArrayLike,
    height_mm: float,
    stroke_mm: float = 100.0,
    name: str = "hexapod",
    **options: Any,
) -> GeneralRobot:
    """The GeneralRobot of joints base_mm (6, 3) on the base and platform_mm (6, 3) on the platform.

    height_mm: of the platform's frame over the base's in its home pose, from which a leg's length changes by up to
    stroke_mm. Columns of the actuator values: l1_mm to l6_mm. Raises ConfigError for another number of joints.
    """
    base, platform = np.asarray(base_mm, dtype=float), np.asarray(platform_mm, dtype=float)
    if base.shape != platform.shape or base.shape != (6, 3):
        raise ConfigError(f"{name}: {base.shape} base and {platform.shape} platform joints; allowed: six of each")
    home = np.array([0.0, 0.0, height_mm])
    lengths = np.linalg.norm(platform + home - base, axis=1)
    bars = driven_bars(base, platform)
    return GeneralRobot(
        name=name,
        legs=Legs(bars, lengths, home),
        parts=bar_parts(bars),
        drive_range=np.stack([lengths - stroke_mm, lengths + stroke_mm], axis=1),
        characteristic_length_mm=float(np.linalg.norm(platform, axis=1).mean()),
        **options,
    )


def driven_bars(base_mm: FloatArray, platform_mm: FloatArray) -> tuple[Leg, ...]:
    """Legs of bars with driven lengths from joints (k, 3) on the base to joints (k, 3) on the platform."""
    return tuple(
        Leg(f"leg {k}", (Joint(f"leg {k} root"), Joint(f"leg {k} base", shift_mm=near)), bar=Bar(0.0, far, k - 1))
        for k, (near, far) in enumerate(zip(base_mm, platform_mm, strict=True), 1)
    )


def bar_parts(bars: tuple[Leg, ...]) -> Parts:
    """Parts of driven bars: each is a drive and a member."""
    drives = tuple(Drive(f"l{k}_mm", "mm", bar.bar_sites[0], unit_twist(0)) for k, bar in enumerate(bars, 1))
    return Parts(drives=drives, members=tuple((bar.bar_sites[0],) for bar in bars))
