"""Encoder eccentricity: the encoder's disc sits off its shaft's centre and errs once per turn of the drive arm.

A disc of grating radius rho whose centre lies at a distance e from the shaft's axis is read at the arc rho theta + e
sin(theta + p), where p is the direction in which the centre lies off. One reading head therefore sees an angle that
errs by e / rho at most. The controller moves the drive until its encoder reads the command, so that the arm errs by

    dtheta_i = a_i sin(theta_i + p_i),    a_i = e_i / rho

It enters at the drive angle, with two coefficients for each drive that turns. With s_i = a_i cos(p_i) and
c_i = a_i sin(p_i) it is linear:

    dtheta_i = s_i sin(theta_i) + c_i cos(theta_i)

Assumptions: one reading head per encoder (two opposite heads cancel it), the encoder on the arm's own axis (behind a
gear the error is that of `transmission_error`), higher harmonics small; the commanded angle replaces the true one, an
error of second order in a_i. Over the part of a turn that an arm swings through, most of the cosine is confounded with
a constant drive error; only the curvature separates them.

Source: geometry of an eccentric circle; Fraden, Handbook of Modern Sensors, 2010, on optical encoders. The typical
size of a_i is assumed: 10 um off at a grating radius of 20 mm make 5e-4 rad, about 3e-4 rad of each of s_i and c_i.
"""

from rrru.effects.harmonic import of_encoders
from rrru.effects.protocol import Effect
from rrru.kinematics.robot import Robot

_SOURCE = "eccentricity over grating radius; up to some arc minutes, assumed"


def for_robot(robot: Robot) -> Effect | None:
    """The effect model for the drives that turn, None for robots without any."""
    return of_encoders(robot, "encoder_eccentricity", periods=1.0, source=_SOURCE, typical_rad=3e-4)
