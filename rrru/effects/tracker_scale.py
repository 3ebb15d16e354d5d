"""Tracker scale: the instrument's millimetre is not the robot's.

A wrong refractive index of the air, a wrong scale bar or a frame set on marks of a base that has since warmed up makes
all measured distances too long by one factor. A point at p in the robot's frame is reported at

    p' = (1 + m) p

It enters at the world, one number. About another point than the frame's origin the same scale comes with a shift of the
frame. The robot itself does nothing wrong; a calibration puts the scale into its lengths, which then are wrong by it.

A calibration of all lengths of the robot absorbs the scale entirely: positions alone do not separate a larger robot
from a smaller millimetre. The scale is identifiable for a robot with slides, whose drives have a millimetre of their
own, or for one whose lengths are not calibrated.

Assumptions: one factor for all directions and all of the campaign; the measured point lies at the tool, so that
reflectors far from it, or next to the robot, are moved a little wrongly.

Source: refraction: Ciddor, Refractive index of air, Applied Optics 35, 1996: 1e-6 per kelvin and 0.27e-6 per hPa, so
that a weather station that is off makes 1e-5; scale bars and thermal growth of the base (2.3e-5 per kelvin for
aluminium) make more, sizes assumed.
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import Contribution, Effect, Motion, plain_coordinates
from rrru.kinematics.legs import WORLD
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

_PARAMETERS = ParameterSet((Parameter("scale", "1", 0.0, -1e-3, 1e-3, "refraction or temperature, size assumed"),))
_COORDINATES = plain_coordinates(_PARAMETERS, 5e-5)


def _scaled(motion: Motion, values: FloatArray) -> Contribution:
    """The world's twist at every point under the share by which distances are too long."""
    shift = values[0] * motion.position_mm
    return motion.at({WORLD: np.concatenate([shift, np.zeros_like(shift)], axis=1)})


def for_robot(_robot: Robot) -> Effect:
    """The effect model, the same for every robot."""
    return Effect("tracker_scale", _PARAMETERS, _COORDINATES, _scaled)
