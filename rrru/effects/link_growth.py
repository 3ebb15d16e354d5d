"""Link growth: single links of an arm grow with time towards a limit, as where the heat of one motor warms its link.

As in `thermal_growth`, but with a final strain e_k of its own for all lengths l that drive k moves and drive k + 1 does
not:

    dl(t) = l e_k (1 - exp(-t / tau))

One time constant tau holds for all links. The column below the first drive is no link: its growth moves the whole robot
as a drift of the base does. A length behind a joint that follows drives is of the link of the drive before it.

Assumptions: each link has one temperature; constant power over the campaign.

Source: as `thermal_growth`; Mayr et al., Thermal issues in machine tools, CIRP Annals 61, 2012 (heat of single drives).
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import Contribution, Effect, Motion, plain_coordinates
from rrru.effects.thermal_growth import SHAPES, TIME_CONSTANT, growth_twists, warm_up_fraction
from rrru.kinematics.legs import Legs
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

_TYPICAL, _MOST, _SOURCE = 2e-4, 1e-2, "aluminium 2.3e-5 per kelvin; temperature assumed"


def for_robot(robot: Robot) -> Effect | None:
    """The effect model for an arm with two links or more behind drives of their own, None for others."""
    legs = robot.legs
    if len(legs.legs) != 1 or not legs.arm_joints:
        return None
    drives = [*_links(legs)]
    if len(drives) < 2:
        return None
    parameters = ParameterSet(
        (*(Parameter(f"strain{k}", "1", 0.0, 0.0, _MOST, _SOURCE, k) for k in drives), TIME_CONSTANT)
    )

    def grown(motion: Motion, values: FloatArray) -> Contribution:
        """Shifts of the links' ends by their growth under the strains and the time constant in s."""
        *strains, time_constant = values
        # the measured robot may have more sites, those of reflectors
        links = _links(motion.robot.legs)
        longer = sum(strain * links[k] for k, strain in zip(drives, strains, strict=True))
        return Contribution(np.multiply.outer(warm_up_fraction(motion, time_constant), longer))

    return Effect("link_growth", parameters, plain_coordinates(parameters, _TYPICAL, SHAPES), grown, ("time_s",))


def _links(legs: Legs) -> dict[int, FloatArray]:
    """Twists (sites, 6) that make all lengths of a link longer by their own size, by number of the drive from 1 on."""
    (leg,), every, drive = legs.legs, growth_twists(legs), None
    result: dict[int, FloatArray] = {}
    for joint in leg.joints:
        site = legs.site_numbers[joint.name]
        if drive is not None and every[site].any():
            result.setdefault(drive + 1, np.zeros_like(every))[site] = every[site]
        # driven values of joints that follow drives come after those of the drives
        if joint.drive is not None and joint.drive < len(legs.home_drives):
            drive = joint.drive
    return result
