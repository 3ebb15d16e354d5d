"""Deflection of an arm's joints under the weight of links whose masses no file states.

Behind joint i hang the links l >= i. A link and all that hangs on its end load joint i about its axis z_i by a moment
that is linear in a vector s_l, fixed in the link: its mass times its centre of mass, and the mass behind it times its
length. With the vertical u and the turn R_l of the link, a joint of compliance k_i deflects by

    dq_i = k_i g sum_l z_i . (u x R_l s_l) = sum_l z_i . (u x R_l a_il)

The products a_il = k_i g s_l are the parameters, each component on its own. Components that turn no joint, or that
others of the same joint replace, are left out. About a level axis the own link's part is a sine of the joint's value,
as `encoder_eccentricity` is; the parts of the links behind tell them apart.

Assumptions: linear springs; loads at rest.

Source: gravity in base inertial parameters: Khalil and Dombre, Modeling, Identification and Control of Robots, 2002,
chapter 9. The size is assumed: 1 kg per 40 mm of link on 50 kN m/rad.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr

from rrru.arrays import FloatArray, IntArray
from rrru.effects.protocol import Motion
from rrru.kinematics.parameter_jacobian import TwistMap
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter

_KG_PER_MM, _GRAVITY, _COMPLIANCE = 1.0 / 40.0, 9.81, 2e-8
_MOST_RAD = 0.02
# poses at which the components that matter are looked for, and the largest size that counts as none
_POSES, _NONE = 64, 1e-6
# a link without length, such as a wrist's, has its centre of mass so far off
_LEAST_MM = 30.0


@dataclass(frozen=True)
class LinkWeights:
    """Parameters of the weight on each drive of an arm, whose drive k moves link k and all behind it.

    joints (K,): number in the leg of each drive's joint; columns: by drive the numbers of its own, three a link behind
    its joint; moments (K,): assumed moments of the links in kg mm.
    """

    robot: Robot
    joints: list[int]
    columns: list[IntArray]
    moments: FloatArray

    def parameters(self, drive: int) -> tuple[list[Parameter], FloatArray]:
        """Parameters of a drive, counted from 0, and their typical sizes (c,) in rad."""
        named = [(drive + column // 3, "xyz"[column % 3]) for column in self.columns[drive]]
        parameters = [
            Parameter(
                f"weight{drive + 1}_link{link + 1}_{axis}", "rad", 0.0, -_MOST_RAD, _MOST_RAD, "assumed", drive + 1
            )
            for link, axis in named
        ]
        return parameters, _COMPLIANCE * _GRAVITY * np.array([self.moments[link] for link, _ in named])

    def functions(self, motion: Motion) -> list[FloatArray]:
        """By drive the deflections (n, c) under a unit of each of its parameters along a Motion."""
        at = self.robot.map_at(motion.drive, motion.position_mm)
        every = _columns(self.robot, at, self.joints)
        return [columns[:, own] for columns, own in zip(every, self.columns, strict=True)]


def link_weights(robot: Robot) -> LinkWeights | None:
    """The LinkWeights of an arm whose drives all turn and whose links have no stated masses, None for others."""
    legs = robot.legs
    alone = len(legs.legs) == 1 and legs.arm_joints and legs.coupling is None and not robot.point_masses
    if not alone or set(robot.parts.units) != {"rad"}:
        return None
    (leg,) = legs.legs
    number = {joint.drive: k for k, joint in enumerate(leg.joints) if joint.drive is not None}
    joints = [number[drive] for drive in range(len(number))]
    low, high = np.asarray(robot.drive_range, dtype=float).T
    # anywhere in the ranges, always the same poses
    drives = np.random.default_rng(0).uniform(low, high, (_POSES, len(low)))
    at = robot.map_at(drives, robot.guess(drives))
    columns = [_independent(of_drive) for of_drive in _columns(robot, at, joints)]
    return LinkWeights(robot, joints, columns, _moments(robot, at, joints))


def _frames(robot: Robot, at: TwistMap) -> tuple[FloatArray, FloatArray]:
    """Turns (J + 1, n, 3, 3) and places (J + 1, n, 3) of the leg's joints and of the platform."""
    (leg,) = robot.legs.legs
    frames = [at.frames[robot.legs.site_numbers[joint.name]] for joint in leg.joints]
    turns, places = (np.stack(parts) for parts in zip(*frames, strict=True))
    return np.concatenate([turns, at.poses.turn[None]]), np.concatenate([places, at.poses.position_mm[None]])


def _columns(robot: Robot, at: TwistMap, joints: Sequence[int]) -> list[FloatArray]:
    """By drive the functions (n, 3 links): what each component of each link behind its joint adds to its value.

    The frame after a joint is fixed in its link; that of the joint itself does not turn with it.
    """
    (leg,) = robot.legs.legs
    turns, _ = _frames(robot, at)
    result = []
    for drive, joint in enumerate(joints):
        # z . (u x R e) = R e . (z x u)
        lever = np.cross(turns[joint] @ leg.joints[joint].axis, robot.up)
        behind = [np.einsum("na,nac->nc", lever, turns[other + 1]) for other in joints[drive:]]
        result.append(np.concatenate(behind, axis=1))
    return result


def _independent(columns: FloatArray) -> IntArray:
    """Numbers (c,) of columns that are not zero and that no others of them replace."""
    _, triangle, order = qr(columns, mode="economic", pivoting=True)
    size = np.abs(np.diag(triangle))
    return np.sort(order[: int((size > _NONE * np.sqrt(len(columns))).sum())])


def _moments(robot: Robot, at: TwistMap, joints: Sequence[int]) -> FloatArray:
    """Assumed moments (K,) in kg mm of each link and of all that hangs on its end."""
    _, places = _frames(robot, at)
    along = np.diff(places[[*joints, -1]], axis=0)
    length = np.maximum(np.median(np.linalg.norm(along, axis=2), axis=1), _LEAST_MM)
    mass = _KG_PER_MM * length
    behind = np.append(np.cumsum(mass[::-1])[::-1], 0.0)[1:]
    return np.asarray(length * (0.5 * mass + behind))
