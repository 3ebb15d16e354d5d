"""Base placement: a leg stands elsewhere on the base than the drawing says.

In the frame of leg k (x radial, y tangential, z down) its foot belongs at (R, 0, 0). With an azimuth error b, a radius
error p and a height error h it stands, turned by b about the vertical, at

    foot = Rz(b) (R + p, 0, 0) + (0, 0, h)

so that, as a twist at the legs' feet,

    shift = ((R + p) cos b - R, (R + p) sin b, h),    w = (0, 0, b)

nine numbers, linear to first order: shift = (p, R b, h). What is common to the legs is known elsewhere: a common radius
is the calibration's r - R; a common height shifts the whole robot along z and a common azimuth turns it, platform
included, about z, as a wrong frame would. One leg's azimuth error turns that leg's plane against the others', and the
platform with it.

Assumptions: rigid base; the platform's side is as drawn; constant over the campaign.

Source: geometry; leg placement as in Mooring, Roth and Driels, Fundamentals of Manipulator Calibration, 1991. Sizes
assumed: a base drilled to 0.5 mm on a radius of 400 mm, that is about 1e-3 rad.
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import Contribution, Effect, Motion, leg_parameters, plain_coordinates
from rrru.kinematics.robot import Robot
from rrru.parameters import ParameterSet

_KINDS = (("azimuth", "rad", -0.03, 0.03), ("radius", "mm", -30.0, 30.0), ("height", "mm", -30.0, 30.0))


def for_robot(robot: Robot) -> Effect | None:
    """The effect model for all legs with a foot on the base, None without such."""
    feet = robot.parts.feet
    if not feet:
        return None
    parameters = ParameterSet(leg_parameters("drilling of the base, size assumed", *_KINDS, count=len(feet)))
    return Effect(
        "base_placement", parameters, plain_coordinates(parameters, np.tile([1e-3, 0.5, 0.5], len(feet))), _placed
    )


def _placed(motion: Motion, values: FloatArray) -> Contribution:
    """Twists of the feet under azimuth (rad), radius and height (mm) of leg 1, then of the others, (3 legs,)."""
    shifts = {joint.name: joint.shift_mm for joint in motion.robot.legs.joints}
    drawn = np.array([shifts[site][0] for site in motion.robot.parts.feet])
    azimuth, radius, height = np.reshape(values, (-1, 3)).T
    placed, nothing = drawn + radius, np.zeros(len(drawn))
    shift = np.stack([placed * np.cos(azimuth) - drawn, placed * np.sin(azimuth), height], axis=1)
    return motion.at_feet(np.stack([nothing, nothing, azimuth], axis=1), shift)
