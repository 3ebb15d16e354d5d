"""Bar mismatch: the two bars of one arm differ in length.

Two bars side by side keep the platform's side parallel to their arm's, as long as they are equally long. Where they
differ by d, the one is longer by d / 2 and the other shorter,

    dL_a = d / 2,    dL_b = -d / 2

the platform turns by about d over the bars' distance, and its points move as far as they lie from the axis of that
turn. It enters at both bars, one number per arm, and is linear in it. What both bars share is a length of the
calibration.

Assumptions: rigid bars, constant over the campaign; ball joints without friction.

Source: geometry of the parallelogram; owners of Delta printers name unequal arms as the first cause of a tilted
effector. Typical size assumed: 0.1 mm.
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import Contribution, Effect, Motion, leg_parameters, plain_coordinates
from rrru.kinematics.robot import Robot
from rrru.parameters import ParameterSet


def for_robot(robot: Robot) -> Effect | None:
    """The effect model for arms of two bars, None for robots without."""
    members = robot.parts.members
    if not members or any(len(group) != 2 for group in members):
        return None
    sizes = leg_parameters("bars made in pairs, size assumed", ("mismatch", "mm", -5.0, 5.0), count=len(members))
    parameters = ParameterSet(sizes)
    return Effect("bar_mismatch", parameters, plain_coordinates(parameters, 0.1), _apart)


def _apart(motion: Motion, values: FloatArray) -> Contribution:
    """Shifts along the bars under differences (arms,) in mm."""
    first, second = zip(*motion.robot.parts.members, strict=True)
    bars = [(site,) for site in (*first, *second)]
    return motion.along(bars, 0.5 * np.concatenate([values, -values])[None])
