"""Thermal growth: all links grow with time towards a limit while the robot warms up.

A body of heat capacity C that absorbs a constant power and loses heat in proportion to its excess temperature warms up
as 1 - exp(-t / tau) (Newtonian cooling). With its coefficient of expansion every length l of R, L1, L2, L3, r grows by

    dl(t) = l e (1 - exp(-t / tau))

where e is the final strain and t the time since the campaign's start, when the robot was at the temperature of its
drawing. It enters at the lengths. It is linear in e, and not in tau, for which a grid of time constants is tried.

A grown 3-RRRU is similar to the nominal one: since all angles stay, the platform moves along the ray from the base's
centre by the strain itself, p' = (1 + e(t)) p. Only repeated passes separate it from errors of the lengths: the same
pass, driven later, ends elsewhere.

Assumptions: one temperature for base, links and platform, one material, constant power over the campaign whether it
moves or rests; no drift of the tracker.

Source: Incropera and DeWitt, Fundamentals of Heat and Mass Transfer, lumped capacitance method (ch. 5). Sizes:
aluminium has 2.3e-5 per kelvin, so that 10 K make 2.3e-4; time constants from half a minute to an hour assumed.
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import Contribution, Effect, Motion, plain_coordinates
from rrru.kinematics.legs import Legs
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

TIME_CONSTANT = Parameter("time_constant", "s", 600.0, 1.0, 1e5, "lumped body, assumed")
SHAPES = tuple({TIME_CONSTANT.name: tau} for tau in (30.0, 60.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0))
_PARAMETERS = ParameterSet(
    (
        Parameter("strain", "1", 0.0, 0.0, 1e-2, "aluminium 2.3e-5 per kelvin; temperature assumed"),
        TIME_CONSTANT,
    )
)


def warm_up_fraction(motion: Motion, time_constant: float) -> FloatArray:
    """Excess temperature (n,) over the final one, 1 - exp(-t / tau), with tau in s; 0 where the time is unknown."""
    return -np.expm1(-np.nan_to_num(motion.time_s) / time_constant)


def _grown(motion: Motion, values: FloatArray) -> Contribution:
    """Shifts in mm of every link's end by its growth; values: final strain, time constant in s."""
    final_strain, time_constant = values
    strain = final_strain * warm_up_fraction(motion, time_constant)
    return Contribution(np.multiply.outer(strain, growth_twists(motion.robot.legs)))


def growth_twists(legs: Legs) -> FloatArray:
    """Twists (sites, 6) under a strain of 1, which doubles all lengths: the vector in mm of each length at its site."""
    result = np.zeros((len(legs.sites), 6))
    for leg in legs.legs:
        for joint in leg.joints[1:]:
            result[legs.site_numbers[joint.name], :3] = joint.turn.T @ joint.shift_mm
        if leg.bar:
            bar, end = (legs.site_numbers[name] for name in leg.bar_sites)
            result[bar, 0], result[end, :3] = leg.bar.length_mm, -leg.bar.platform_mm
    return result


def for_robot(_robot: Robot) -> Effect:
    """The effect model, the same for every robot."""
    return Effect("thermal_growth", _PARAMETERS, plain_coordinates(_PARAMETERS, 2e-4, SHAPES), _grown, ("time_s",))
