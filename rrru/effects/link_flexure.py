"""Link flexure: a forearm gives way along its length to the force that it carries.

Forearm i pushes the platform with the force f_i along its own direction g_i (compression positive,
`rrru.robots.dynamics.loads`). With its end fittings and U-joint it is a spring of compliance k_i; compression shortens
it:

    dL3_i = -k_i f_i

It enters at the length L3, one compliance per leg, and is linear in k. The platform follows its load: it sinks under
its weight, and further in proportion to a payload, which tells it from errors of the lengths; `drive_compliance` does
so too, but with the drive's torque, so that the pattern over the workspace differs.

Which force the forearm carries depends on joint 3: free, it is the component along the forearm; held by friction, the
leg is one two-force member from elbow to U-joint (`held_n` of `rrru.robots.dynamics.Loads`). Both are tried; `held` is
0 or 1, or a share between.

Assumptions: a two-force member, no bending (the lumped half of its own mass hangs at its end); linear spring; the loads
are those at the commanded pose.

Source: bar under axial force, dL = f L / (E A) (Timoshenko, Strength of Materials, 1930, part 1, chapter 1). A plain
aluminium tube of 800 mm and 300 mm^2 has 4e-5 mm/N; joints, clamps and glued ends are softer by far, so the sizes here
are assumed.
"""

from rrru.effects.protocol import Effect, leg_parameters, plain_coordinates
from rrru.parameters import Parameter, ParameterSet

_SIZE = ("flexure", "mm/N", 0.0, 0.1)
_HELD = Parameter("held", "1", 0.0, 0.0, 1.0, "0 where joint 3 is free, 1 where friction holds it")


def for_robot(robot):
    """The law for robots whose platform is pushed by links, None for others."""
    members = robot.parts.members
    if not members:
        return None
    sizes = leg_parameters("axial spring of forearm and its joints, size assumed", _SIZE, count=len(members))
    # a joint within the leg may be held
    shapes = ({"held": 0.0}, {"held": 1.0}) if robot.parts.held_from else ({"held": 0.0},)
    parameters = ParameterSet((*sizes, _HELD))
    return Effect("link_flexure", parameters, plain_coordinates(parameters, 2e-3, shapes), _shortened, ("force_n",))


def _shortened(motion, values):
    """Shifts along the members under compliances (members,) in mm/N and the share to which joint 3 is held."""
    force = motion.force_n + values[-1] * (motion.held_force_n - motion.force_n)
    return motion.along(motion.robot.parts.members, -values[:-1] * force)
