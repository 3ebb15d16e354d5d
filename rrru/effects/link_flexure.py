"""Link flexure: axial compliance of links that push a platform; compliance of an arm's links and bearings.

Forearm i pushes the platform with the force f_i along its own direction g_i (compression positive,
`rrru.kinematics.dynamics.loads`). With its end fittings and U-joint it is a spring of compliance k_i; compression
shortens it:

    dL3_i = -k_i f_i

It enters at the length L3, one compliance per leg, and is linear in k. The platform sinks under its weight, and further
in proportion to a payload, which separates it from errors of the lengths. `drive_compliance` does so too, but with the
drive's torque, so that the pattern over the workspace differs.

A member that is itself driven, as a hexapod's leg, is no forearm: a spring along it acts like the spring of its drive,
whatever part of the leg it is, and both are `drive_compliance`.

Which force the forearm of a 3-RRRU carries depends on its passive joint 3: if free, it is the component along the
forearm; held by friction, the leg is one two-force member from elbow to U-joint (`held_n` of
`rrru.kinematics.dynamics.Loads`). Both are fitted; `held` is 0 or 1, or a share between.

An arm has no such members: its links bend, and its bearings tilt. At every turning joint all that it carries rotates by

    w = c_j (m - (m . a) a)

with the moment m of the loads about the joint and its axis a: one compliance c_j per joint, equal in both directions
across the axis. Compliance about the axis is `drive_compliance`.

Assumptions: a two-force member, no bending (the lumped half of its own mass hangs at its end); linear spring.

Source: bar under axial force, dL = f L / (E A) (Timoshenko, Strength of Materials, 1930, part 1, chapter 1). A plain
aluminium tube of 800 mm and 300 mm^2 has 4e-5 mm/N; joints, clamps and glued ends are softer by far, so the sizes here
are assumed, as are those across joints (virtual joints for flexible links: Wernholt and Moberg, Nonlinear gray-box
identification using local models applied to industrial robots, Automatica 47, 2011).
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import Contribution, Effect, Motion, leg_parameters, plain_coordinates
from rrru.kinematics.legs import unit_twist
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

_SIZE = ("flexure", "mm/N", 0.0, 0.1)
_BEND = ("bending", "rad/(N mm)", 0.0, 1e-6)
HELD = Parameter("held", "1", 0.0, 0.0, 1.0, "0 where joint 3 is free, 1 where friction holds it")


def for_robot(robot: Robot) -> Effect | None:
    """The effect model for robots whose platform is pushed by links, and for arms; None for others."""
    members = robot.parts.members
    if not members:
        return _across_joints(robot.legs.arm_joints)
    if all(_driven(robot, member) for member in members):
        return None
    sizes = leg_parameters("axial spring of forearm and its joints, size assumed", _SIZE, count=len(members))
    shapes = tuple({HELD.name: share} for share in held_shares(robot))
    parameters = ParameterSet((*sizes, HELD))
    return Effect("link_flexure", parameters, plain_coordinates(parameters, 2e-3, shapes), _shortened, ("force_n",))


def held_shares(robot: Robot) -> tuple[float, ...]:
    """Values of `held` that are tried: 0, and 1 where friction may hold a joint within the leg."""
    return (0.0, 1.0) if robot.parts.held_from else (0.0,)


def member_force(motion: Motion, held: float) -> FloatArray:
    """Forces (n, members) in N with which members push the platform; held: 0 to 1, see HELD."""
    return motion.force_n + held * (motion.held_force_n - motion.force_n)


def _driven(robot: Robot, member: tuple[str, ...]) -> bool:
    """Whether a drive does nothing but lengthen the member of these sites."""
    nothing = np.zeros(6)
    lengthening = {site: unit_twist(0) for site in member}
    return any(
        all(
            np.array_equal(lengthening.get(site, nothing), drive.twists.get(site, nothing))
            for site in {*member, *drive.twists}
        )
        for drive in robot.parts.drives
    )


def _shortened(motion: Motion, values: FloatArray) -> Contribution:
    """Shifts in mm along the members; values: compliances (members,) in mm/N, then `held`."""
    return motion.along(motion.robot.parts.members, -values[:-1] * member_force(motion, values[-1]))


def _across_joints(joints: tuple[str, ...]) -> Effect | None:
    """The effect model for an arm with these turning joints, None where there are none."""
    if not joints:
        return None
    parameters = ParameterSet(
        leg_parameters("bearing and link across the axis, size assumed", _BEND, count=len(joints))
    )

    def tilted(motion: Motion, values: FloatArray) -> Contribution:
        """Rotations in rad across the axes of the J joints under compliances (J,) in rad/(N mm)."""
        turns = values[:, None] * motion.across
        twists = np.concatenate([np.zeros_like(turns), turns], axis=2)
        return motion.at({joint: twists[:, k] for k, joint in enumerate(joints)})

    return Effect("link_flexure", parameters, plain_coordinates(parameters, 1e-8), tilted, ("across",))
