"""Drive compliance: between motor and arm the drive deflects under the torque of the loads.

Gear teeth, shafts and a harmonic drive's flexspline act as a torsion spring of compliance k_i. The encoder on the
motor's side does not see its wind-up, so that the arm errs by

    dtheta_i = k_i tau_i

where tau_i is the torque of all loads about drive axis i, positive in the sense of theta
(`rrru.kinematics.dynamics.loads`):

    tau_i = W . dx/dtheta_i + (m_a + m_f) / 2 g L1 cos(theta_i) - (m_a / 3 + m_f / 2) L1^2 theta_i''

with W the weight and inertia force of platform, payload and half of the forearms. It enters at the drive angle, one
compliance per leg, and is linear in k. With theta > 0 lowering the arm, gravity lowers the platform. Most of its static
part is confounded with errors of lengths and drives. A second payload separates it, since nothing else but
`link_flexure` grows with the payload.

Assumptions: linear spring (harmonic drives stiffen with torque by a factor of about two over their range), no lost
motion (that is `backlash`), no vibration (a motion slow against the drive's resonance).

Where an arm's file states no masses of its links, the deflection under their weight has parameters of its own, and the
compliance is that under the payload: see `rrru.effects.link_weights`.

A joint that a rod or belt makes follow drives deflects under the loads about itself, in addition to what its drives do.

A carriage on a screw or belt deflects likewise: b_i errs by k_i F_i with the force F_i of all loads along its rail.

Source: Tsai, Robot Analysis, 1999, chapter 10 (loads); Spong, Modeling and control of elastic joint robots, ASME
Journal of Dynamic Systems, Measurement, and Control 109, 1987 (joint as a torsion spring). The size is assumed: 15 N m
on 50 kN m/rad make 3e-4 rad.
"""

from collections.abc import Sequence

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.link_weights import LinkWeights, link_weights
from rrru.effects.protocol import Contribution, Effect, Motion, drive_parameters, of_drives, plain_coordinates
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

_SOURCE = {
    "rad": "torsion spring; a small drive's 1 kN m/rad as bound",
    "mm": "screw, nut, bearing and carriage, size assumed",
}
_HIGHEST = {"rad": ("rad/(N mm)", 0.0, 1e-6), "mm": ("mm/N", 0.0, 0.05)}
_TYPICAL = {"rad": 2e-8, "mm": 1e-3}


def for_robot(robot: Robot) -> Effect:
    """The effect model for all drives, and after them all joints that follow some."""
    springs = (*robot.parts.drives, *robot.parts.followers)
    own = drive_parameters(springs, _SOURCE, ("compliance", _HIGHEST))
    weights = link_weights(robot)
    if weights is not None:
        return _of_unknown_masses(own, weights)
    parameters = ParameterSet(own)
    coordinates = plain_coordinates(parameters, of_drives(springs, _TYPICAL))
    return Effect("drive_compliance", parameters, coordinates, _wind_up, ("drive_load",))


def _wind_up(motion: Motion, values: FloatArray) -> Contribution:
    """Changes of the values of drives and followers under compliances (K + f,), rad/(N mm) or mm/N."""
    count = motion.drive_load.shape[1]
    followed = motion.at_followers(values[count:] * motion.follower_load)
    return motion.at_drives(values[:count] * motion.drive_load) + followed


def _of_unknown_masses(compliances: Sequence[Parameter], weights: LinkWeights) -> Effect:
    """The effect model for an arm whose links have no stated masses."""
    parameters, typical, sizes = [], [], []
    for drive, compliance in enumerate(compliances):
        further, further_sizes = weights.parameters(drive)
        parameters += [compliance, *further]
        typical += [_TYPICAL["rad"], *further_sizes]
        sizes.append(1 + len(further))

    def functions(motion: Motion) -> list[FloatArray]:
        """By drive the deflections (n, 1 + c) under a unit of its compliance and of each parameter of weight."""
        each = zip(motion.drive_load.T, weights.functions(motion), strict=True)
        return [np.column_stack([load, of_links]) for load, of_links in each]

    def deflected(motion: Motion, values: FloatArray) -> Contribution:
        """Changes of the drives' values under the parameters."""
        return motion.at_drive_functions(functions(motion), np.split(values, np.cumsum(sizes)[:-1]))

    parameter_set = ParameterSet(tuple(parameters))
    coordinates = plain_coordinates(parameter_set, np.array(typical))
    return Effect("drive_compliance", parameter_set, coordinates, deflected, along_drives=functions)
