"""Read before rest: the drives were read, or stated, before the arm stood still; the point was measured when it did.

At a stop that a drive has reached by a move m_i from the one before, the value in the file is short of the one at the
measurement by a share of that move:

    dtheta_i = k_i m_i / (M / 1 rad)^p,    M = max_j |m_j|

How much of a move is left at a given time depends on how the arm comes to rest. A first-order settling (time constant
tau, read t after the command has ended) leaves the share exp(-t / tau) of every move: p = 0. In a coordinated move all
drives take the time of the slowest one; read a time t before its end, the arm has still to go m_i t / T, with T growing
as M where its speed is limited, p = 1, and as the root of M where its acceleration is, p = 1/2. p is fitted from these
starts. k_i > 0 where the values were read too early, k_i < 0 where it was the point that was measured before the arm
had reached the values that were sent, or where the arm overshoots.

`backlash` turns its sign with the last move as well, but does not grow with it; `servo_lag` needs a speed and acts at
points that are passed. Moves of many sizes, as between poses in random order, separate them.

Assumptions: rows in the order driven, every stop among them (a row that is held out of the fits remains one); one time
between reading and measuring for all rows, its mean where it varies; a slide of 500 mm takes as long as a turn of
1 rad. Where the robot does not stop at its points, or at the first one, the contribution is zero.

Source: settling of a first-order system and trapezoidal profiles: Siciliano, Sciavicco, Villani and Oriolo, Robotics:
Modelling, Planning and Control, 2009, sections 4.2 and 8.3. Sizes assumed: 1 mrad is left of a move of 1 rad.
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import Contribution, Effect, Motion, leg_parameters, plain_coordinates
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

_SHARE = ("1", -0.05, 0.05)
_SOURCE = "share of a move that is left, size assumed"
_EXPONENT = Parameter("exponent", "1", 0.0, 0.0, 1.0, "how a move comes to rest: 0 settling, 1 limited speed")
_SPOILS = "the drives were read, or stated, before the arm stood still"
_STARTS = (0.0, 0.5, 1.0)
_TYPICAL = 1e-3
# a move of each unit that takes as long as one of 1 rad
_AS_LONG = {"rad": 1.0, "mm": 500.0}
# shorter moves are scaled as if they were this long, so that the share stays finite at a move of zero
_SHORTEST = 1e-3


def for_robot(robot: Robot) -> Effect:
    """The effect model for all drives."""
    shares = leg_parameters(_SOURCE, ("share", *_SHARE), count=len(robot.parts.drives))
    parameters = ParameterSet((*shares, _EXPONENT))
    shapes = tuple({"exponent": start} for start in _STARTS)
    coordinates = plain_coordinates(parameters, _TYPICAL, shapes)
    return Effect("read_before_rest", parameters, coordinates, _short, ("last_move",), _SPOILS)


def _short(motion: Motion, values: FloatArray) -> Contribution:
    """Changes of the actuator values under shares (K,) and an exponent."""
    units = np.array([_AS_LONG[unit] for unit in motion.robot.parts.units])
    move = np.nan_to_num(motion.last_move)
    longest = np.maximum((np.abs(move) / units).max(axis=1, keepdims=True), _SHORTEST)
    return motion.at_drives(values[:-1] * move / longest ** values[-1])
