"""Base placement: a leg stands elsewhere on the base than the drawing says.

In the frame of leg k (x radial, y tangential, z down) its foot belongs at (R, 0, 0). With an azimuth error b, a radius
error p and a height error h it stands, turned by b about the vertical, at

    foot = Rz(b) (R + p, 0, 0) + (0, 0, h)

so that, as a displacement at the place `base`,

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

from rrru.effects.protocol import Contribution, Effect, base_displacement, leg_parameters, plain_coordinates
from rrru.parameters import ParameterSet

_KINDS = (("azimuth", "rad", -0.03, 0.03), ("radius", "mm", -30.0, 30.0), ("height", "mm", -30.0, 30.0))
_PARAMETERS = ParameterSet(leg_parameters("drilling of the base, size assumed", *_KINDS))
_COORDINATES = plain_coordinates(_PARAMETERS, np.tile([1e-3, 0.5, 0.5], 3))


def _feet(motion, values):
    """Displacement of the legs' feet under azimuth (rad), radius and height (mm) of leg 1, then 2 and 3, (9,)."""
    azimuth, radius, height = np.reshape(values, (3, 3)).T
    foot = motion.lengths_mm[0] + radius
    nothing = np.zeros(3)
    shift = np.stack([foot * np.cos(azimuth) - motion.lengths_mm[0], foot * np.sin(azimuth), height], axis=-1)
    return Contribution(displacement=base_displacement(shift, np.stack([nothing, nothing, azimuth], axis=-1)))


EFFECTS = (Effect("base_placement", _PARAMETERS, _COORDINATES, _feet),)
