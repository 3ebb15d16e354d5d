"""Link flexure: a forearm gives way along its length to the force that it carries.

Forearm i pushes the platform with the force f_i along its own direction g_i (compression positive,
`rrru.robots.dynamics.loads`). With its end fittings and U-joint it is a spring of compliance k_i; compression shortens
it:

    dL3_i = -k_i f_i

It enters at the length L3, one compliance per leg, and is linear in k. The platform follows its load: it sinks under
its weight, and further in proportion to a payload, which tells it from errors of the lengths; `drive_compliance` does
so too, but with the drive's torque, so that the pattern over the workspace differs.

Which force the forearm carries depends on joint 3: free, it is the component along the forearm; held by friction, the
leg is one two-force member from elbow to U-joint (`rrru.robots.dynamics.held_force`). Both are tried; `held` is 0 or 1,
or a share between.

Assumptions: a two-force member, no bending (the lumped half of its own mass hangs at its end); linear spring; the loads
are those at the commanded pose.

Source: bar under axial force, dL = f L / (E A) (Timoshenko, Strength of Materials, 1930, part 1, chapter 1). A plain
aluminium tube of 800 mm and 300 mm^2 has 4e-5 mm/N; joints, clamps and glued ends are softer by far, so the sizes here
are assumed.
"""

import numpy as np

from rrru.effects.protocol import Contribution, Effect, leg_parameters, plain_coordinates
from rrru.parameters import Parameter, ParameterSet

_FOREARM = 3
_PARAMETERS = ParameterSet(
    (
        *leg_parameters("axial spring of forearm and its joints, size assumed", ("flexure", "mm/N", 0.0, 0.1)),
        Parameter("held", "1", 0.0, 0.0, 1.0, "0 where joint 3 is free, 1 where friction holds it"),
    )
)


def _shortened(motion, values):
    """Changes (n, 3, 5) of the lengths under compliances (3,) in mm/N and the share to which joint 3 is held."""
    force = motion.force_n + values[3] * (motion.held_force_n - motion.force_n)
    length = np.zeros((len(motion), 3, 5))
    length[..., _FOREARM] = -values[:3] * force
    return Contribution(length_mm=length)


def _effect(drive_unit, *shares_held):
    """The law for robots whose joint 3 may be held to these shares."""
    coordinates = plain_coordinates(_PARAMETERS, 2e-3, tuple({"held": held} for held in shares_held))
    return Effect("link_flexure", _PARAMETERS, coordinates, _shortened, ("force_n",), (drive_unit,))


# a slider's link has no joint of its own that could be held
EFFECTS = (_effect("rad", 0.0, 1.0), _effect("mm", 0.0))
