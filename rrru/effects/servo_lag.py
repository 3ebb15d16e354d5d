"""Servo lag: the joint follows its command late.

A drive whose position loop has the gain K_v follows a command of constant speed at the distance theta' / K_v, which is
as if it were late by T = 1 / K_v; so do delays in the controller. With the delay T_i of drive i

    dtheta_i(t) = theta_i(t - T_i) - theta_i(t) = -T_i theta_i'(t) + T_i^2 theta_i''(t) / 2 + ...

It enters at the drive angle, one delay per leg. The terms left out, T^3 theta''' / 6, are below 1e-8 rad for some
milliseconds at speeds of 100 mm/s, and the quadratic one is small as well, so that the effect is nearly linear in T. It
vanishes at rest, grows with the speed, and turns its sign with the direction of motion. `backlash` turns its sign too,
but does not grow with the speed.

Assumptions: the motion has lasted longer than T (a point at which it just starts gets T^2 theta'' / 2 too much); the
tracker samples in time with the command (an offset of its clock is a delay common to all drives); no overshoot. Where
the speed is unknown the contribution is zero.

Source: velocity lag of a type-1 servo: Franklin, Powell and Emami-Naeini, Feedback Control of Dynamic Systems, on
system type and steady-state error. Sizes assumed: position-loop gains of machine tools and robots are 20 to 300 per
second.
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import Contribution, Effect, Motion, leg_parameters, plain_coordinates
from rrru.kinematics.robot import Robot
from rrru.parameters import ParameterSet

_LAG = ("s", 0.0, 0.1)
_SOURCE = "inverse of the position loop's gain, assumed"


def for_robot(robot: Robot) -> Effect:
    """The effect model for all drives."""
    lags = leg_parameters(_SOURCE, ("lag", *_LAG), count=len(robot.parts.drives))
    parameters = ParameterSet(lags)
    return Effect("servo_lag", parameters, plain_coordinates(parameters, 0.003), _late, ("drive_rate",))


def _late(motion: Motion, delay: FloatArray) -> Contribution:
    """Changes of the actuator values under delays (K,) in s."""
    curvature, rate = np.nan_to_num(motion.drive_acceleration), np.nan_to_num(motion.drive_rate)
    return motion.at_drives(0.5 * delay**2 * curvature - delay * rate)
