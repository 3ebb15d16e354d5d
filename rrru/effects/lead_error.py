"""Lead error: a screw, rack or belt moves its slide by a constant share more or less than commanded.

A drive that counts revolutions multiplies them by the nominal lead, or by a number of steps per millimetre. With a true
lead of (1 + s_k) times that, the slide of drive k stands at (1 + s_k) q_k, so that

    dq_k = s_k q_k

All slides go one share too far where their screws are of one lot, or all as warm. The readings are those of an
instrument whose scale is off (`tracker_scale`), where all directions are those of slides.

It enters at the drive's value. The constant part is the zero offset of the drive, which the calibration finds. It is
linear, does not depend on time, load or direction, and repeats exactly.

Assumptions: one share over the whole stroke (what bends is `drive_error_function`); the share does not change with
temperature (`screw_growth`).

Source: ISO 230-2, mean bidirectional positional deviation; ISO 3408-3, travel deviation of ball screws: 23 um per
300 mm in grade 5, 52 in grade 7 and 210 in grade 10, which are 8e-5, 1.7e-4 and 7e-4.
"""

from dataclasses import replace

import numpy as np

from rrru.arrays import FloatArray, IntArray
from rrru.effects.harmonic import drives_of
from rrru.effects.protocol import Contribution, Effect, Motion, leg_parameters, plain_coordinates
from rrru.kinematics.robot import Robot
from rrru.parameters import ParameterSet

_TYPICAL, _MOST, _SOURCE = 2e-4, 1e-2, "ISO 3408-3, grades 5 to 10: 8e-5 to 7e-4"


def for_robot(robot: Robot) -> Effect | None:
    """The effect of all drives that slide, None where none does."""
    sliding = drives_of(robot, "mm")
    if not len(sliding):
        return None
    effect = proportional("lead_error", sliding, (_TYPICAL, _MOST, _SOURCE))
    return replace(effect, coordinates=replace(effect.coordinates, common=True))


def proportional(name: str, drives: IntArray, size: tuple[float, float, str]) -> Effect:
    """The effect of a name by which drives (k,), numbered from 0 on, go a constant share of their values too far.

    size: typical and largest share, and their source.
    """
    typical, most, source = size
    every = leg_parameters(source, (name, "1", -most, most), count=int(drives.max()) + 1)
    parameters = ParameterSet(tuple(parameter for parameter in every if parameter.leg - 1 in drives))

    def scaled(motion: Motion, values: FloatArray) -> Contribution:
        """Changes of the actuator values under shares (k,) of the drives."""
        change = np.zeros(motion.drive.shape)
        change[:, drives] = values * motion.drive[:, drives]
        return motion.at_drives(change)

    return Effect(name, parameters, plain_coordinates(parameters, typical), scaled, of_drive_value=True)
