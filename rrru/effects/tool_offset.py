"""Tool offset: the measured point does not sit on the platform where it should.

In the platform's frame the reflector is off by the shift c = (offset_x, offset_y, offset_z), so that with the
platform's orientation R it is measured off by

    dp = R c

It enters at the tool, three numbers, and is linear in them. A platform that never turns makes a constant shift of it,
which a wrong frame makes too; it is tried only where the drives can turn the platform.

Assumptions: constant over the campaign; the platform's orientation as commanded, an error of second order.

Source: geometry; part of every complete calibration model of a serial arm (Mooring, Roth and Driels, Fundamentals of
Manipulator Calibration, 1991). Typical size assumed: 0.5 mm.
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import Contribution, Effect, Motion, plain_coordinates
from rrru.kinematics.legs import TOOL
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

_SOURCE = "seat of the reflector, size assumed"
_PARAMETERS = ParameterSet(tuple(Parameter(f"offset_{axis}", "mm", 0.0, -50.0, 50.0, _SOURCE) for axis in "xyz"))
# drives that move the point alone
_POSITION_ONLY = 3


def for_robot(robot: Robot) -> Effect | None:
    """The effect model for robots whose drives turn the platform, None for others."""
    if len(robot.parts.drives) <= _POSITION_ONLY:
        return None
    return Effect("tool_offset", _PARAMETERS, plain_coordinates(_PARAMETERS, 0.5), _seated)


def _seated(motion: Motion, values: FloatArray) -> Contribution:
    """The tool's shift by offsets (3,) in mm."""
    return motion.at({TOOL: np.concatenate([values, np.zeros(3)])[None]})
