"""Axis tilt: a drive axis that is neither tangential nor horizontal.

In the frame of leg k (x radial, y tangential, z down) the drive axis lies along y. Its seat on the base is turned by
the rotation vector

    w_k = (tilt_x_k, 0, tilt_z_k)

about the seat's own place: tilt_x about the radial axis lifts one end of the drive axis, tilt_z about the vertical
swings it. The third entry, a turn about the drive axis itself, is a constant drive error and belongs to the
calibration. It enters as a displacement at the place `base`, six numbers.

The whole leg leans with its axis, and its U-joint with it: the platform, which three parallel legs hold upright, turns
as well (up to a like angle), and more so near a constraint singularity. Eq. (8) does not know of this; the full spatial
closure does. To first order (`rrru.robots.first_order`) the platform's motion is linear in the tilts.

Assumptions: rigid seat, constant over the campaign; axes of the other joints parallel to the drive axis as built.

Source: geometry; tolerances of drive axes as in Mooring, Roth and Driels, Fundamentals of Manipulator Calibration,
1991. Typical size assumed: 0.1 mm over a bearing distance of 100 mm.
"""

import numpy as np

from rrru.effects.protocol import Contribution, Effect, base_displacement, leg_parameters, plain_coordinates
from rrru.parameters import ParameterSet

_TILTS = (("tilt_x", "rad", -0.03, 0.03), ("tilt_z", "rad", -0.03, 0.03))
_PARAMETERS = ParameterSet(leg_parameters("seat of the drive, size assumed", *_TILTS))


def _seats(_, values):
    """Displacement of the legs' seats under tilts about x and z of leg 1, then of legs 2 and 3, (6,) in rad."""
    turn = np.zeros((3, 3))
    turn[:, [0, 2]] = np.reshape(values, (3, 2))
    return Contribution(displacement=base_displacement(np.zeros((3, 3)), turn))


EFFECTS = (Effect("axis_tilt", _PARAMETERS, plain_coordinates(_PARAMETERS, 1e-3), _seats, drives=("rad",)),)
