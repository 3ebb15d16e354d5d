"""Rail tilt: a slider's rail does not point where the drawing says.

In the frame of leg k (x radial, y tangential, z up) the rail runs through its zero mark, turned there by the rotation
vector

    w_k = (lean_k, -rise_k, swing_k)

rise lifts a horizontal rail's outer end or leans an upright one inwards, swing turns a horizontal rail about the
vertical, lean an upright one to the side. The carriage at the distance b_k from the zero mark is off by w_k x b_k d_k,
which grows along the rail; this separates it from the zero offset of a slider. It enters as a twist at the legs'
feet, nine numbers of which six have an effect, and is linear in them.

Assumptions: straight rail, true at its zero mark; joints on the carriage that lean with it, so that the platform turns;
constant over the campaign.

Source: geometry; squareness and parallelism of guides as in Slocum, Precision Machine Design, 1992. Typical size
assumed: 0.3 mm over 300 mm.
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import Contribution, Effect, Motion, leg_parameters, plain_coordinates
from rrru.kinematics.robot import Robot
from rrru.parameters import ParameterSet

_TURNS = tuple((kind, "rad", -0.05, 0.05) for kind in ("lean", "rise", "swing"))


def for_robot(robot: Robot) -> Effect | None:
    """The effect model for legs whose drives slide on rails on the base, None without such."""
    feet = robot.parts.feet
    if not feet or "rad" in robot.parts.units:
        return None
    parameters = ParameterSet(leg_parameters("seat of the rail, size assumed", *_TURNS, count=len(feet)))
    return Effect("rail_tilt", parameters, plain_coordinates(parameters, 1e-3), _seats)


def _seats(motion: Motion, values: FloatArray) -> Contribution:
    """Twists of the rails' seats under lean, rise and swing of leg 1, then of the others, (3 legs,) in rad."""
    return motion.at_feet(np.reshape(values, (-1, 3)) * [1.0, -1.0, 1.0])
