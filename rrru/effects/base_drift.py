"""Base drift: robot and instrument creep against each other while a campaign lasts.

A tracker's stand settles, a floor warms, a base creeps. The world of the instrument then shifts and turns against that
of the robot, steadily with the time:

    v = s (t - t_0),   w = r (t - t_0)

with three speeds s and three rates r. It enters at the world. `thermal_growth` changes the robot's own lengths and ends
at a limit; this effect changes none.

Assumptions: a constant speed, no temperature. Where a file has no times, the order of its rows replaces them.

Source: ISO/TR 230-2 and ISO 9283 ask for a warmed-up robot and instrument for this reason; the size is assumed: some
hundredths of a millimetre and microradians in an hour.
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import Contribution, Effect, Motion, plain_coordinates
from rrru.kinematics.legs import WORLD
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

_KINDS = (("speed", "mm/s", 0.01), ("rate", "rad/s", 1e-5))
_TYPICAL = np.repeat([1e-5, 1e-8], 3)


def for_robot(_robot: Robot) -> Effect:
    """The effect model, for every robot."""
    named = [(f"{kind}_{axis}", unit, most) for kind, unit, most in _KINDS for axis in "xyz"]
    parameters = ParameterSet(tuple(Parameter(name, unit, 0.0, -most, most, "assumed") for name, unit, most in named))
    return Effect("base_drift", parameters, plain_coordinates(parameters, _TYPICAL), _creep, ("time_s",))


def _creep(motion: Motion, values: FloatArray) -> Contribution:
    """The world's twist under speeds (3,) and rates (3,)."""
    # NaN, without a warning, where no time is known
    return motion.at({WORLD: np.outer(motion.time_s - np.fmin.reduce(motion.time_s), values)})
