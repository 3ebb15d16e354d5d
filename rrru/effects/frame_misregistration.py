"""Frame misregistration: the tracker's frame is not the robot's.

The tracker's frame was set on marks of the base with errors of its own. A point at p in the robot's frame is reported
at

    p' = Q(w) p + s

with the shift s = (shift_x, shift_y, shift_z) and the rotation Q of the rotation vector w = (turn_x, turn_y, turn_z)
about the robot frame's origin, the centre of the base. It enters at the frame, six numbers; to first order p' = p + s +
w x p. The robot itself has no error, and no compensation by the controller is right for it: the registration has to be
done anew.

The calibration absorbs part of it (a shift along z by the drives, a turn about z hardly at all). The remainder is the
same in every run, direction, speed and payload.

Assumptions: the frame does not move during the campaign, and the tracker's scale is right.

Source: rigid motion between point sets: Arun, Huang and Blostein, Least-squares fitting of two 3-D point sets, IEEE
Transactions on Pattern Analysis and Machine Intelligence 9, 1987. Sizes assumed: marks off by 0.5 mm, a metre apart.
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import Contribution, Effect, Motion, plain_coordinates
from rrru.kinematics.legs import WORLD
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

_KINDS = (("shift", "mm", 100.0), ("turn", "rad", 0.1))
_PARAMETERS = ParameterSet(
    tuple(
        Parameter(f"{kind}_{axis}", unit, 0.0, -limit, limit, "setting of the tracker's frame, size assumed")
        for kind, unit, limit in _KINDS
        for axis in "xyz"
    )
)
_COORDINATES = plain_coordinates(_PARAMETERS, np.repeat([0.5, 5e-4], 3))


def _moved(motion: Motion, values: FloatArray) -> Contribution:
    """The world's twist by the frame's shift (mm) and rotation vector (rad), (6,)."""
    return motion.at({WORLD: values[None]})


def for_robot(_robot: Robot) -> Effect:
    """The effect model, the same for every robot."""
    return Effect("frame_misregistration", _PARAMETERS, _COORDINATES, _moved)
