"""Transmission error: a periodic drive-angle error with a whole number of periods per turn of the drive arm.

The motor turns N times per turn of the arm (N the gear ratio). Eccentric wheels, a wave generator out of round and the
errors of its teeth make the output lead and lag once per turn of the motor, hence N times per turn of the arm:

    dtheta_i = a_i sin(N theta_i + p_i)

It enters at the drive angle. With s_i = a_i cos(p_i) and c_i = a_i sin(p_i) it is linear for a given N:

    dtheta_i = s_i sin(N theta_i) + c_i cos(N theta_i)

A screw of lead h leads and lags once per turn as well: db_i = a_i sin(2 pi b_i / h + p_i).

Assumptions: one harmonic, the same ratio in all drives; the error depends on the angle only, not on load or direction
of motion. The ratio is a number of the drive's data sheet and is not fitted: with N = 50 the error repeats every 7.2
degrees of the arm, and a campaign must sample more densely than every 3.6 degrees to see it as what it is.

Source: Litvin and Fuentes, Gear Geometry and Applied Theory, 2004, on functions of transmission errors; the ratio of 50
is a common ratio of harmonic drives. The size is assumed: one arc minute is 3e-4 rad.
"""

import numpy as np

from rrru.effects.harmonic import harmonic, harmonic_coordinates, harmonic_parameters
from rrru.effects.protocol import Contribution, Effect
from rrru.parameters import Parameter, ParameterSet


def _effect(drive_unit, parameters, typical, law):
    """The law for drives of one kind, with its parameters, the last of them known from a data sheet."""
    known = parameters[-1]
    parameters = ParameterSet(parameters)
    coordinates = harmonic_coordinates(parameters, typical, ({known.name: known.nominal},))
    return Effect("transmission_error", parameters, coordinates, law, drives=(drive_unit,))


def _gear(motion, values):
    """Changes (n, 3) of the drive angles under amplitudes (3,), phases (3,) in rad and the ratio."""
    return Contribution(drive=harmonic(motion.drive, values[6], values))


def _screw(motion, values):
    """Changes (n, 3) of the slider positions under amplitudes (3,) in mm, phases (3,) in rad and the lead in mm."""
    return Contribution(drive=harmonic(motion.drive, 2.0 * np.pi / values[6], values))


_RATIO = Parameter("ratio", "1", 50.0, 1.0, 1000.0, "gear ratio, 50 by default")
_LEAD = Parameter("lead", "mm", 10.0, 0.5, 100.0, "lead of the screw, 10 by default")
_OUT_OF_TRUE = harmonic_parameters("screw out of true, assumed: up to some hundredths of a millimetre", "mm", 1.0)
EFFECTS = (
    _effect("rad", (*harmonic_parameters("assumed: up to some arc minutes"), _RATIO), 3e-4, _gear),
    _effect("mm", (*_OUT_OF_TRUE, _LEAD), 0.01, _screw),
)
