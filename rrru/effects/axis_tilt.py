"""Axis tilt: a drive axis that is neither tangential nor horizontal.

In the frame of leg k (x radial, y tangential, z down) the drive axis lies along y. Its seat on the base is turned by
the rotation vector

    w_k = (tilt_x_k, 0, tilt_z_k)

about the seat's own place: tilt_x about the radial axis lifts one end of the drive axis, tilt_z about the vertical
swings it. The third entry, a turn about the drive axis itself, is a constant drive error and belongs to the
calibration. It enters as a twist at the legs' feet, six numbers.

The whole leg leans with its axis, and its U-joint with it: the platform, which three parallel legs hold upright, turns
as well (up to a like angle), and more so near a constraint singularity. Eq. (8) does not know of this; the full spatial
closure does. To first order (`rrru.kinematics.parameter_jacobian`) the platform's motion is linear in the tilts.

Assumptions: rigid seat, constant over the campaign; axes of the other joints parallel to the drive axis as built.

Source: geometry; tolerances of drive axes as in Mooring, Roth and Driels, Fundamentals of Manipulator Calibration,
1991. Typical size assumed: 0.1 mm over a bearing distance of 100 mm.
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import Contribution, Effect, Motion, leg_parameters, plain_coordinates
from rrru.kinematics.robot import Robot
from rrru.parameters import ParameterSet

_TILTS = (("tilt_x", "rad", -0.03, 0.03), ("tilt_z", "rad", -0.03, 0.03))


def for_robot(robot: Robot) -> Effect | None:
    """The effect model for legs whose drives turn about an axis on the base, None without such."""
    feet = robot.parts.feet
    if not feet or "mm" in robot.parts.units:
        return None
    parameters = ParameterSet(leg_parameters("seat of the drive, size assumed", *_TILTS, count=len(feet)))
    return Effect("axis_tilt", parameters, plain_coordinates(parameters, 1e-3), _seats)


def _seats(motion: Motion, values: FloatArray) -> Contribution:
    """Twists of the feet under tilts about x and z of leg 1, then of the others, (2 legs,) in rad."""
    return motion.at_feet(np.insert(np.reshape(values, (-1, 2)), 1, 0.0, axis=1))
