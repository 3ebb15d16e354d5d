"""Zero drift: the zeros of an arm's drives move with time towards a limit, as where heat turns gear or encoder's seat.

The motor warms gear, bearing and what holds the encoder, which are no link: the angle, or the way, that drive k makes
beyond what its encoder reads goes to z_k as the excess temperature of a lumped body does:

    dq_k(t) = z_k (1 - exp(-t / tau))

One time constant tau holds for all drives. The first drive of an arm turns or shifts the whole robot, as `base_drift`
does, and so do the slides of a gantry; these have no drift here. `link_growth` makes links longer and changes no angle.

Assumptions: the zero follows the temperature in proportion, with either sign; constant power over the campaign. What a
belt or coupling slips is a step, which follows none of these.

Source: Heisel, Richter and Wurst, Thermal behaviour of industrial robots and possibilities for error compensation, CIRP
Annals 46, 1997; sizes assumed: 20 arc seconds are 1e-4 rad.
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import Contribution, Effect, Motion, of_drives, plain_coordinates
from rrru.effects.thermal_growth import SHAPES, TIME_CONSTANT, warm_up_fraction
from rrru.kinematics.legs import Leg
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

_TYPICAL = {"rad": 1e-4, "mm": 0.01}
_MOST = {"rad": 0.01, "mm": 1.0}
_SOURCE = "heat of motor and gear, size assumed"


def for_robot(robot: Robot) -> Effect | None:
    """The effect model for an arm with drives whose drift is no motion of the whole robot, None for others."""
    if len(robot.legs.legs) != 1 or not robot.legs.arm_joints:
        return None
    own = _own_drives(robot.legs.legs[0])
    numbers = [k for k, drive in enumerate(robot.parts.drives) if drive.site in own]
    if not numbers:
        return None
    drives = [robot.parts.drives[k] for k in numbers]
    parameters = ParameterSet(
        (
            *(
                Parameter(f"drift{k + 1}", drive.unit, 0.0, -_MOST[drive.unit], _MOST[drive.unit], _SOURCE, k + 1)
                for k, drive in zip(numbers, drives, strict=True)
            ),
            TIME_CONSTANT,
        )
    )

    def drifted(motion: Motion, values: FloatArray) -> Contribution:
        """Changes of the actuator values under final drifts (k,) and the time constant in s."""
        *drifts, time_constant = values
        change = np.zeros(motion.drive.shape)
        change[:, numbers] = np.outer(warm_up_fraction(motion, time_constant), drifts)
        return motion.at_drives(change)

    coordinates = plain_coordinates(parameters, of_drives(drives, _TYPICAL), SHAPES)
    return Effect("zero_drift", parameters, coordinates, drifted, ("time_s",))


def _own_drives(leg: Leg) -> set[str]:
    """Sites of the driven joints of a leg whose motion is none of the whole robot: not the first one that turns, unless
    others move its axis, and no slide whose direction is fixed.
    """
    own, before = set(), ""
    for joint in leg.joints:
        if joint.drive is None:
            continue
        if before.replace("P", "") or (before and joint.kind == "R"):
            own.add(joint.name)
        before += joint.kind
    return own
