"""Pedestal compliance: what the robot stands on deflects under the moment of its weight.

A floor plate, a table or a pedestal is a beam that the weight of links, platform and payload bends. About the robot's
origin it bears the moment m of these loads; at its top it then turns and, the turn being about some place further
down, shifts by

    w_k = c_k m_k,    v = sum_k s_k m_k (e_k x up)

about and along the horizontal axes e_k of the robot's frame: a tilt c_k and a shift s_k per moment for each. The robot
and everything that stands on the same body move as one. The effect is therefore a twist of the world as an instrument
on the floor sees it. Reflectors on the table next to the robot, together with those on the tool, make it identifiable.
Without them only its pattern separates it from `drive_compliance` of the first joints.

Assumptions: linear spring; loads at rest; the weight itself, which does not change, is part of where the robot stands.

Source: cantilever under an end moment, w = m h / (E I), v = w h / 2 (Timoshenko, Strength of Materials, 1930, part 1,
chapter 5). A steel tube of 200 x 8 mm and 700 mm turns by 1.3e-10 rad/(N mm); its bolts and the floor are softer, so
the sizes are assumed.
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import Contribution, Effect, Motion, plain_coordinates
from rrru.kinematics.dynamics import level_axes
from rrru.kinematics.legs import WORLD
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

_SOURCE = "bending of what the robot stands on, size assumed"
_KINDS = (("tilt", "rad/(N mm)", 0.0, 1e-7), ("shift", "mm/(N mm)", -1e-4, 1e-4))
_TYPICAL = np.repeat([1e-9, 3e-7], 2)


def for_robot(robot: Robot) -> Effect:
    """The effect model, about the two axes of the robot's frame that are the most level."""
    axes = level_axes(robot)
    names = [(f"{kind}_{'xyz'[k]}", unit, low, high) for kind, unit, low, high in _KINDS for k in axes]
    parameters = ParameterSet(tuple(Parameter(name, unit, 0.0, low, high, _SOURCE) for name, unit, low, high in names))
    about = np.eye(3)[axes]
    across = np.cross(about, robot.up)

    def tilted(motion: Motion, values: FloatArray) -> Contribution:
        """The world's twist under tilts (2,) and shifts (2,) per moment."""
        moment = motion.base_moment @ about.T
        return motion.at({WORLD: np.concatenate([moment * values[2:] @ across, moment * values[:2] @ about], axis=1)})

    return Effect("pedestal_compliance", parameters, plain_coordinates(parameters, _TYPICAL), tilted, ("base_moment",))
