"""Cable robots: a platform on taut cables, whose lengths are driven, in space or in a plane.

A cable is a bar under tension; the forces that keep it taut are not modelled. More cables than the platform has degrees
of freedom share what they contradict each other in as elastic ones do (`rrru.kinematics.closure`). In a plane a leg of
two slides and a turn, none driven, keeps the platform in x, y. Lengths in mm, angles in rad.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from rrru.arrays import FloatArray
from rrru.errors import ConfigError
from rrru.kinematics.general_robot import GeneralRobot
from rrru.kinematics.legs import Joint, Leg, Legs, X, Y, Z
from rrru.robots.hexapod import bar_parts, driven_bars


def cable(
    anchors_mm: npt.ArrayLike,
    platform_mm: npt.ArrayLike,
    home_mm: npt.ArrayLike,
    stroke_mm: float = 300.0,
    planar: bool = False,
    name: str = "cable",
    **options: Any,
) -> GeneralRobot:
    """The GeneralRobot of cables from anchors_mm (k, 3) to platform_mm (k, 3), points of the platform.

    home_mm (3,): the platform in its home pose, from which a cable's length changes by up to stroke_mm; planar: the
    platform stays in the plane z = home z and turns about z only. Columns: l1_mm, l2_mm, ... Raises ConfigError for too
    few cables.
    """
    anchors, platform, home = (np.asarray(values, dtype=float) for values in (anchors_mm, platform_mm, home_mm))
    fewest = 3 if planar else 6
    if anchors.shape != platform.shape or len(anchors) < fewest:
        raise ConfigError(f"{name}: {len(anchors)} anchors and {len(platform)} points; allowed: {fewest} or more pairs")
    lengths, bars = np.linalg.norm(platform + home - anchors, axis=1), driven_bars(anchors, platform)
    return GeneralRobot(
        name=name,
        legs=Legs((*bars, *([_plane(home)] if planar else [])), lengths, home),
        parts=bar_parts(bars),
        drive_range=np.stack([lengths - stroke_mm, lengths + stroke_mm], axis=1),
        characteristic_length_mm=float(np.linalg.norm(platform, axis=1).mean()) or 100.0,
        **options,
    )


def _plane(home_mm: FloatArray) -> Leg:
    """The leg that keeps a platform in its plane."""
    return Leg(
        "plane",
        (
            Joint("plane x", "P", X, home_mm[2] * Z, home=home_mm[0]),
            Joint("plane y", "P", Y, home=home_mm[1]),
            Joint("plane turn", "R", Z),
        ),
    )
