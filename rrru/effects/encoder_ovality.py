"""Encoder ovality: the encoder's ring is out of round, or its disc tilted, and it errs twice per turn of the drive arm.

A ring that its seat has pressed to an oval, its diameters d differing by e, carries its lines to and fro along itself
by e / 4 sin, so that it errs by e / (4 d). A flat disc
tilted by t against its shaft is seen foreshortened across the tilt: the head reads atan2(cos(t) sin, cos) of the angle
about it, short by (t^2 / 4) sin(2 theta) to leading order. Either way the arm errs by the second harmonic

    dtheta_i = a_i sin(2 theta_i + p_i)

It enters at the drive angle. With s_i = a_i cos(p_i) and c_i = a_i sin(p_i) it is linear:

    dtheta_i = s_i sin(2 theta_i) + c_i cos(2 theta_i)

Assumptions: the encoder on the arm's own axis; one reading head or two opposite ones, which cancel the first harmonic,
`encoder_eccentricity`, but not this one; the commanded angle replaces the true one, an error of second order. Over the
part of a turn that an arm swings through, much of the second harmonic is confounded with the first. They are separable
where a drive swings through half a turn or so.

Source: geometry of the projected circle; Lu, Graetz, Amin-Shahidi and Smeds, On-axis self-calibration of angle
encoders, CIRP Annals 59, 2010, on harmonics of encoders. The size is assumed: a ring of 40 mm whose diameters differ by
30 um makes 2e-4 rad, a disc that is tilted by 30 mrad as much.
"""

from rrru.effects.harmonic import of_encoders
from rrru.effects.protocol import Effect
from rrru.kinematics.robot import Robot

_SOURCE = "difference of diameters over four of them, or tilt squared over four, assumed"


def for_robot(robot: Robot) -> Effect | None:
    """The effect model for the drives that turn, None for robots without any."""
    return of_encoders(robot, "encoder_ovality", periods=2.0, source=_SOURCE, typical_rad=2e-4)
