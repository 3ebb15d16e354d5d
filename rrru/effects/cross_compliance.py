"""Cross compliance: the torque about one joint of a trunk deflects another one.

`drive_compliance` has a spring at every drive, which winds up by the torque about its own axis. Where joints share a
structure, such as rods that hold a chest upright, cables of two joints over one pulley or a housing that carries two
gears, the load on one moves the other as well:

    dq = C tau,   C = C^T,   dq_a = c_ab tau_b,   dq_b = c_ab tau_a

with the torques tau of the loads about drives and followers as `drive_compliance` has them, a drive's together with all
that follows it. The diagonal of C is `drive_compliance`; this effect has the elements off the diagonal. C of a linear
elastic structure is symmetric (Maxwell's and Betti's theorem), so that every pair of joints has one parameter. It may
be negative: |c_ab| <= sqrt(c_aa c_bb), since no load gains work. It enters at the joints' values and is linear in c.

Which joints: each pair of turning joints of the trunk that several arms share, neighbours or not. Rods may span several
joints, and the loads of both arms are large there. A single arm has no such effect: its joints wind up one behind the
other, and pairs of joints in a chain with one end effector are hard to separate from its other springs.

A joint that is described as following drives already passes its torque on to them: its spring gives C = J K J^T in the
joints' own values, with terms between joints. So this effect separates a robot whose passive joint was described as a
drive of its own from one whose joint is carried by rods. For a chest with the value -(q_1 + q_2) the estimates are
c_13 = -k_1 and c_23 = -k_2 together with c_33 = k_1 + k_2 + k_3.

Assumptions: linear springs.

Source: Betti, Teoria della elasticita, Il Nuovo Cimento 7, 1872 (reciprocity). The size is assumed: half that of a
drive's own compliance.
"""

from itertools import combinations

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import Contribution, Effect, Motion, plain_coordinates
from rrru.kinematics.legs import Drive
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

_SOURCE = "structure that joints of a trunk share, size assumed"
_HIGHEST, _TYPICAL = 1e-6, 1e-8


def for_robot(robot: Robot) -> Effect | None:
    """The effect model for the turning joints of a trunk that several arms share, None for fewer than two joints."""
    springs = (*robot.parts.drives, *robot.parts.followers)
    chains = [{joint.name for joint in leg.joints} for leg in robot.legs.legs] if robot.legs.end_effectors else []
    trunk = [k for k, spring in enumerate(springs) if spring.unit == "rad" and chains]
    trunk = [k for k in trunk if all(springs[k].site in chain for chain in chains)]
    pairs = np.array(list(combinations(trunk, 2))).reshape(-1, 2)
    if not len(pairs):
        return None
    parameters = ParameterSet(tuple(_parameter(springs[a], springs[b]) for a, b in pairs))

    def deflected(motion: Motion, values: FloatArray) -> Contribution:
        """Changes of the values of drives and followers under cross compliances (pairs,) in rad/(N mm)."""
        load = np.concatenate([motion.drive_load, motion.follower_load], axis=1)
        changes, drives = np.zeros_like(load), len(robot.parts.drives)
        for (a, b), value in zip(pairs, values, strict=True):
            changes[:, a] += value * load[:, b]
            changes[:, b] += value * load[:, a]
        return motion.at_drives(changes[:, :drives]) + motion.at_followers(changes[:, drives:])

    return Effect("cross_compliance", parameters, plain_coordinates(parameters, _TYPICAL), deflected, ("drive_load",))


def _parameter(first: Drive, second: Drive) -> Parameter:
    """The parameter of a pair of springs, named by their sites."""
    name = "_".join(["cross", *(spring.site.replace(" ", "_") for spring in (first, second))])
    return Parameter(name, "rad/(N mm)", 0.0, -_HIGHEST, _HIGHEST, _SOURCE)
