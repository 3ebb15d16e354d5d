"""Leg asymmetry: the three legs' link lengths differ.

Leg i has its own arm, offset and forearm,

    L1_i = L1 + dL1_i,    L2_i = L2 + dL2_i,    L3_i = L3 + dL3_i

where the calibration of paper A has one parameter per link for all legs (its 14 errors, tied to 8; 7 of them can be
identified). It enters at the lengths, nine parameters, and is linear in them; the position follows from eq. (8) leg by
leg, and the platform does not turn.

The part common to the legs, (dLk_1 + dLk_2 + dLk_3) / 3, is the calibration's own dLk and not identifiable from it, so
that two of the three parameters per link are new. L2 and L3 of one leg act nearly alike: rho = L2 + sqrt(L3^2 - v^2)
separates them only where the tangential offset v of the platform is large.

A robot with one link per leg has the three dL3_i only.

Assumptions: rigid links, constant over the campaign.

Source: paper A, section 2.2 (the 14 errors); the bounds are those of its calibration here. Typical size assumed: what a
workshop holds on welded or clamped links of this length, ISO 2768-1 class m (+-0.8 mm from 400 to 1000 mm).
"""

from rrru.arrays import FloatArray
from rrru.effects.protocol import Contribution, Effect, Motion, leg_parameters, plain_coordinates
from rrru.kinematics.robot import Robot
from rrru.parameters import ParameterSet

_SOURCE = "paper A, section 2.2, and workshop tolerance; bounds assumed"


def for_robot(robot: Robot) -> Effect | None:
    """The effect model for robots whose legs have links, None for others."""
    links = robot.parts.links
    if not links:
        return None
    groups = [group for leg in zip(*links.values(), strict=True) for group in leg]
    kinds = ((name, "mm", -4.0, 4.0) for name in links)
    parameters = ParameterSet(leg_parameters(_SOURCE, *kinds, count=len(groups) // len(links)))

    def lengths(motion: Motion, values: FloatArray) -> Contribution:
        """Shifts along the links under dL of the links of leg 1, then of the others, in mm."""
        return motion.along(groups, values[None])

    return Effect("leg_asymmetry", parameters, plain_coordinates(parameters, 0.3), lengths)
