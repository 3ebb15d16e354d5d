"""Gain error: a turning joint of an arm turns by a constant share more or less than commanded.

The controller multiplies what the sensor of joint k counts by the nominal ratio of gear, belt or cable and by the
nominal gain of the sensor. With true values of (1 + g_k) times these the joint stands at (1 + g_k) q_k, so that

    dq_k = g_k q_k

It enters at the drive angle. The constant part is the zero offset of the drive, which the calibration finds. It is
linear, does not depend on time, load or direction, and repeats exactly. An encoder on the joint that closes after a
turn, and toothed wheels of known numbers, have none: a ratio that was entered wrongly has, and drums and pulleys of
cables, bands and flat belts, friction wheels, potentiometers, resolvers and incremental encoders with a wrong number of
lines do.

Assumptions: one share over the whole range (what bends is `encoder_eccentricity` or `drive_error_function`); of arms
only: cranks of parallel robots swing through so little of a turn that a gain is the slope of an eccentricity there.
`lead_error` is the same of a slide.

Source: Hollerbach, Khalil and Gautier, Model identification, Springer Handbook of Robotics, 2016 (joint-based
parameters of sensing and transmission). The size is assumed: a drum of 50 mm that is 25 um off makes 5e-4.
"""

from rrru.effects.harmonic import drives_of
from rrru.effects.lead_error import proportional
from rrru.effects.protocol import Effect
from rrru.kinematics.robot import Robot

_TYPICAL, _MOST, _SOURCE = 5e-4, 2e-2, "diameter of a drum or gain of a sensor, assumed"


def for_robot(robot: Robot) -> Effect | None:
    """The effect of all turning drives of an arm, None for other robots."""
    turning = drives_of(robot, "rad")
    if robot.legs.parallel or not len(turning):
        return None
    return proportional("gain_error", turning, (_TYPICAL, _MOST, _SOURCE))
