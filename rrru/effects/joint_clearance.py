"""Joint clearance: the U-joint's pin lies on the side of its bore towards which the leg pushes.

With the force f_i that leg i transmits along the unit direction g_i (compression positive,
`rrru.kinematics.dynamics.loads`), the bore (the platform) lags behind the pin (the forearm) by the radial clearance
c_i:

    shift_i = -c_i sign(f_i) g_i,   or, softer,   shift_i = -c_i tanh(f_i / f_0) g_i

The second form changes sides within a force f_0, the parameter `transition`, as contacts with friction and some
elasticity do. As in `link_flexure`, `held` says whether f_i is the force with joint 3 free or held by friction.

It enters as a shift of the platform's U-joint centre against the forearm, one clearance per leg, and is linear in c. It
flips with the sign of the force and vanishes where the leg transmits none. While the force keeps its sign it is a
change of L3 by c_i: a calibration with three free forearm lengths absorbs it, one with tied lengths in part. The jump
where the force changes sign makes it identifiable.

Assumptions: massless contact (the pin is always at the bore's wall, and passes from one side to the other in no time);
the contact lies on the forearm's line; the pin's radius left out.

Source: Parenti-Castelli and Venanzi, Clearance influence analysis on mechanisms, Mechanism and Machine Theory 40, 2005.
Paper A, section 3.3, names it as the cause of the error after calibration; its size is assumed.
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.link_flexure import HELD, held_shares, member_force
from rrru.effects.protocol import Contribution, Effect, Motion, leg_parameters, plain_coordinates
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

_SIZE = ("clearance", "mm", 0.0, 2.0)
_SHAPE = (
    Parameter("transition", "N", 0.0, 0.0, 100.0, "force within which the contact changes sides, assumed"),
    HELD,
)


def for_robot(robot: Robot) -> Effect | None:
    """The effect model for robots whose platform is pushed by links, None for others."""
    members = robot.parts.members
    if not members:
        return None
    sizes = leg_parameters("paper A, section 3.3 blames it; size assumed", _SIZE, count=len(members))
    shares = held_shares(robot)
    shapes = tuple({"transition": force, HELD.name: share} for share in shares for force in (0.2, 0.7, 2.0))
    parameters = ParameterSet((*sizes, *_SHAPE))
    coordinates = plain_coordinates(parameters, 0.05, shapes)
    return Effect("joint_clearance", parameters, coordinates, _sides, ("force_n",), switches=True)


def _sides(motion: Motion, values: FloatArray) -> Contribution:
    """Shifts along the members under clearances (members,) in mm, the transition in N and the share held."""
    *clearance, transition, held = values
    force = member_force(motion, held)
    side = np.tanh(force / transition) if transition > 0.0 else np.sign(force)
    return motion.along(motion.robot.parts.members, -side * clearance)
