"""Thermal expansion: all links have the length that belongs to the temperature that was measured.

With its coefficient of expansion a every length l of the drawing, which holds at 20 degrees, is at the temperature T

    l (1 + a (T - 20 C))

It enters at the lengths. `thermal_growth` is about a robot that warms up by itself and has a limit; this effect follows
the temperatures of a file, up and down. The evidence decides between the two.

Assumptions: the robot has the temperature of the probe: one that sits on it, or in air that changes slowly; one
material, no drift of the tracker.

Source: ISO 1:2022 (reference temperature); coefficients 1.2e-5 (steel) and 2.3e-5 per kelvin (aluminium), Incropera and
DeWitt, Fundamentals of Heat and Mass Transfer, table A.1.
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import Contribution, Effect, Motion, plain_coordinates
from rrru.effects.thermal_growth import growth_twists
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

_PARAMETERS = ParameterSet((Parameter("expansion", "1/K", 0.0, 0.0, 1e-4, "aluminium 2.3e-5, steel 1.2e-5"),))
_TYPICAL, _DRAWN_C = 2e-5, 20.0


def for_robot(_robot: Robot) -> Effect:
    """The effect model, the same for every robot."""
    coordinates = plain_coordinates(_PARAMETERS, _TYPICAL)
    return Effect("thermal_expansion", _PARAMETERS, coordinates, _grown, ("temperature_c",))


def _grown(motion: Motion, values: FloatArray) -> Contribution:
    """Shifts of every link's end by its growth under a coefficient (1,); none where no temperature is known."""
    share = values[0] * np.nan_to_num(motion.temperature_c - _DRAWN_C)
    return Contribution(np.multiply.outer(share, growth_twists(motion.robot.legs)))
