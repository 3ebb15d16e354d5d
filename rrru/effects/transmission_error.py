"""Transmission error: a periodic drive-angle error with a whole number of periods per turn of the drive arm.

The motor turns N times per turn of the arm (N the gear ratio). Eccentric wheels, a wave generator out of round and the
errors of its teeth make the output lead and lag once per turn of the motor, hence N times per turn of the arm:

    dtheta_i = a_i sin(N theta_i + p_i)

It enters at the drive angle. With s_i = a_i cos(p_i) and c_i = a_i sin(p_i) it is linear for a given N:

    dtheta_i = s_i sin(N theta_i) + c_i cos(N theta_i)

A screw of lead h leads and lags once per turn as well: db_i = a_i sin(2 pi b_i / h + p_i).

Assumptions: one harmonic, the same ratio in all drives; the error depends on the angle only, not on load or direction
of motion. The ratio is a number of the drive's data sheet; where nobody states it, it is searched beside that of the
data sheet, see `rrru.gap.orders`. With N = 50 the error repeats every 7.2 degrees of the arm, and a campaign must
sample more densely than every 3.6 degrees to see it as what it is.

Source: Litvin and Fuentes, Gear Geometry and Applied Theory, 2004, on functions of transmission errors; the ratio of 50
is a common ratio of harmonic drives. The size is assumed: one arc minute is 3e-4 rad.
"""

from dataclasses import replace

import numpy as np

from rrru.effects.harmonic import harmonic, harmonic_coordinates, harmonic_parameters
from rrru.effects.protocol import Effect, Search
from rrru.parameters import Parameter, ParameterSet

_RATIO = Parameter("ratio", "1", 50.0, 1.0, 1000.0, "gear ratio, 50 by default")
_LEAD = Parameter("lead", "mm", 10.0, 0.5, 100.0, "lead of the screw, 10 by default")
_GEAR, _SCREW = "assumed: up to some arc minutes", "screw out of true, assumed: up to some hundredths of a millimetre"

# waves per turn of the arm, and radians of the wave per millimetre of the slide
_RATIOS = Search("ratio", 200.0, float, float)
_LEADS = Search("lead", 2.0 * np.pi / _LEAD.low, lambda order: 2.0 * np.pi / order, lambda lead: 2.0 * np.pi / lead)


def for_robot(robot):
    """The law for robots whose drives all turn or all slide, None for others."""
    units, count = set(robot.parts.units), len(robot.parts.drives)
    if len(units) > 1:
        return None
    known, typical, law = (_RATIO, 3e-4, _turned) if units == {"rad"} else (_LEAD, 0.01, _slid)
    sizes = harmonic_parameters(count, _GEAR) if units == {"rad"} else harmonic_parameters(count, _SCREW, "mm", 1.0)
    parameters = ParameterSet((*sizes, known))
    search = _RATIOS if units == {"rad"} else _LEADS
    coordinates = harmonic_coordinates(parameters, typical, ({known.name: known.nominal},))
    return Effect("transmission_error", parameters, replace(coordinates, searched=search), law)


def _turned(motion, values):
    """Changes of the drive angles under amplitudes, phases (K,) in rad and the ratio."""
    return motion.at_drives(harmonic(motion.drive, values[-1], values))


def _slid(motion, values):
    """Changes of the slider positions under amplitudes (K,) in mm, phases (K,) in rad and the lead in mm."""
    return motion.at_drives(harmonic(motion.drive, 2.0 * np.pi / values[-1], values))
