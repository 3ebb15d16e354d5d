"""Transmission error: a periodic drive-angle error with a whole number of periods per turn of the drive arm.

The motor turns N times per turn of the arm (N the gear ratio). Eccentric wheels, a wave generator out of round and the
errors of its teeth make the output lead and lag once per turn of the motor, hence N times per turn of the arm:

    dtheta_i = a_i sin(N theta_i + p_i)

It enters at the drive angle. With s_i = a_i cos(p_i) and c_i = a_i sin(p_i) it is linear for a given N:

    dtheta_i = s_i sin(N theta_i) + c_i cos(N theta_i)

A screw of lead h, or a drum of circumference h, leads and lags once per turn as well:

    db_i = a_i sin(2 pi b_i / h + p_i)

In robots with drives of both kinds it acts at those that turn.

Assumptions: one harmonic, the same ratio in all drives; the error depends on the angle only, not on load or direction
of motion. The ratio is a number of the drive's data sheet. Where it is not stated, it is searched in addition to the
default, see `rrru.diagnosis.drive_spectra`. With N = 50 the error repeats every 7.2 degrees of the arm; a campaign
must sample more densely than every 3.6 degrees, or the error is aliased.

Source: Litvin and Fuentes, Gear Geometry and Applied Theory, 2004, on functions of transmission errors; the ratio of 50
is a common ratio of harmonic drives. The size is assumed: one arc minute is 3e-4 rad.
"""

from dataclasses import replace

import numpy as np

from rrru.arrays import FloatArray, IntArray
from rrru.effects.harmonic import at_harmonic, drives_of, harmonic_coordinates, harmonic_parameters
from rrru.effects.protocol import Contribution, Effect, EffectModel, Motion, Search
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

_RATIO = Parameter("ratio", "1", 50.0, 1.0, 1000.0, "gear ratio, 50 by default")
_LEAD = Parameter("lead", "mm", 10.0, 0.5, 2000.0, "lead of the screw or circumference of the drum, 10 by default")
_GEAR, _SCREW = "assumed: up to some arc minutes", "screw out of true, assumed: up to some hundredths of a millimetre"


def _inverse(number: float) -> float:
    """Radians of the wave per millimetre of the slide for a lead, and the other way."""
    return 2.0 * np.pi / number


# waves per turn of the arm, and radians of the wave per millimetre of the slide
_RATIOS = Search("ratio", "rad", _RATIO.low, 200.0, float, float)
_LEADS = Search("lead", "mm", _inverse(_LEAD.high), _inverse(_LEAD.low), _inverse, _inverse)


def for_robot(robot: Robot) -> Effect:
    """The effect model for the drives that turn, or for all where none does."""
    turning = drives_of(robot, "rad")
    return _of_gears(turning) if len(turning) else _of_screws(drives_of(robot, "mm"))


def _of_gears(drives: IntArray) -> Effect:
    """The effect model for turning drives (k,)."""

    def gear_error(motion: Motion, values: FloatArray) -> Contribution:
        return at_harmonic(motion, drives, values[-1], values)

    return _effect(harmonic_parameters(drives, _GEAR), _RATIO, _RATIOS, 3e-4, gear_error)


def _of_screws(drives: IntArray) -> Effect:
    """The effect model for sliding drives (k,)."""

    def screw_error(motion: Motion, values: FloatArray) -> Contribution:
        return at_harmonic(motion, drives, _inverse(values[-1]), values)

    return _effect(harmonic_parameters(drives, _SCREW, "mm", 1.0), _LEAD, _LEADS, 0.01, screw_error)


def _effect(
    sizes: tuple[Parameter, ...], known: Parameter, search: Search, typical: float, error: EffectModel
) -> Effect:
    """The Effect of amplitudes and phases, and of a ratio or lead that is known or searched; error: its function."""
    parameters = ParameterSet((*sizes, known))
    coordinates = harmonic_coordinates(parameters, typical, ({known.name: known.nominal},))
    return Effect("transmission_error", parameters, replace(coordinates, searched=search), error, of_drive_value=True)
