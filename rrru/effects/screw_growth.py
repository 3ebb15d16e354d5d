"""Screw growth: the screws, racks or scales that make and measure a slide's way grow while they warm up.

A screw of drive k that is held at one end of the slide's range [l, u] pushes the carriage away from there as it grows.
With the strains a of one held at the lowest value and b of one held at the highest, and the warming-up of a lumped body
as in `thermal_growth`,

    dq_k(t) = [a_k (q_k - l_k) + b_k (q_k - u_k)] (1 - exp(-t / tau))

It enters at the drive's value. Both together are a screw that is held at a point between the ends, where the bracket
vanishes, with the strain a + b. Where the range of a drive is unknown, its screw is held at the value 0 and has the
first strain alone. The effect is linear in the strains; tau is fitted on a grid of time constants.

Assumptions: one temperature along each screw, one time constant for all; the structure that carries the screws stays
as it is (`thermal_growth` is about that); constant power over the campaign.

Source: Mayr et al., Thermal issues in machine tools, CIRP Annals 61, 2012; Incropera and DeWitt, Fundamentals of Heat
and Mass Transfer, lumped capacitance method (ch. 5). Sizes: steel has 1.2e-5 per kelvin, so that 10 K make 1.2e-4.
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import Contribution, Effect, Motion, plain_coordinates
from rrru.effects.thermal_growth import SHAPES, TIME_CONSTANT, warm_up_fraction
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

_TYPICAL, _MOST, _SOURCE = 1e-4, 5e-3, "steel 1.2e-5 per kelvin; temperature assumed"


def for_robot(robot: Robot) -> Effect | None:
    """The effect model for all drives that slide, None where none does."""
    held = [strain for k, unit in enumerate(robot.parts.units) if unit == "mm" for strain in _held(robot, k)]
    if not held:
        return None
    parameters = ParameterSet((*(parameter for parameter, *_ in held), TIME_CONSTANT))

    def grown(motion: Motion, values: FloatArray) -> Contribution:
        """Changes of the actuator values under the strains and the time constant in s."""
        *strains, time_constant = values
        change = np.zeros(motion.drive.shape)
        for (_, drive, end_mm), strain in zip(held, strains, strict=True):
            change[:, drive] += strain * (motion.drive[:, drive] - end_mm)
        return motion.at_drives(warm_up_fraction(motion, time_constant)[:, None] * change)

    return Effect("screw_growth", parameters, plain_coordinates(parameters, _TYPICAL, SHAPES), grown, ("time_s",))


def _held(robot: Robot, drive: int) -> list[tuple[Parameter, int, float]]:
    """Strains of a drive (its number from 0 on) by the ends at which its screw may be held: parameter, drive, value."""
    low, high = (0.0, np.nan) if robot.drive_range is None else robot.drive_range[drive]
    number = drive + 1
    known = (("low", low), ("high", high)) if np.isfinite([low, high]).all() else (("low", 0.0),)
    return [(Parameter(f"{end}_strain{number}", "1", 0.0, 0.0, _MOST, _SOURCE, number), drive, at) for end, at in known]
