"""Loads on drives, members and base by a robot's own masses, given as point masses in its moving frames (virtual work).

Every point mass m at x loads the driven value k with

    tau_k = m (g - x'') . dx/dq_k

The derivatives are central differences of the exactly closed legs. Lengths in mm, masses in kg, forces in N, time in s.
"""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rrru.arrays import FloatArray
from rrru.kinematics.chain import Poses, Twists, Walk, value_of, walks
from rrru.kinematics.legs import Leg, Legs, cross, turn_about

if TYPE_CHECKING:
    from rrru.kinematics.general_robot import GeneralRobot

# values, rates and accelerations (n, K) of the drives
DriveMotion = tuple[FloatArray, FloatArray, FloatArray]

# steps of the differences: in time, and of a driven value in rad or mm
_STEP_S, _STEP = 1e-3, {"R": 1e-4, "P": 1e-2}
# name of the frame in which a point mass of the platform is fixed
PLATFORM = "platform"


@dataclass(frozen=True, eq=False)
class PointMass:
    """A point mass in mass_kg at at_mm (3,) of the frame behind the motion of a joint, called by its site.

    joint "platform": the platform's frame. Of a bar's mass, point masses of the site "<leg> bar" count along it from
    its first ball joint, those of "<leg> end", at negative x, along it from its end: what moves with a driven slide.
    """

    joint: str
    mass_kg: float
    at_mm: FloatArray


def places(robot: "GeneralRobot", actuators: FloatArray, poses: Poses, twists: FloatArray | None = None) -> FloatArray:
    """Places (n, point masses, 3) in mm of a robot's point masses at actuator values (n, K) and Poses that fit them.

    twists: finite ones (1, sites, 6) at the sites.
    """
    ways = dict(zip(robot.legs.legs, walks(robot.legs, actuators, poses, Twists(robot.legs, twists)), strict=True))
    holders = {name: leg for leg in robot.legs.legs for name in (*(j.name for j in leg.joints), *leg.bar_sites)}
    result = []
    for point_mass in robot.point_masses:
        if point_mass.joint == PLATFORM:
            result.append(poses.point(point_mass.at_mm))
            continue
        leg = holders[point_mass.joint]
        way = ways[leg]
        if way.bar and point_mass.joint in leg.bar_sites:
            end = way.bar.near if point_mass.joint == leg.bar_sites[0] else way.bar.far
            # counted along it from its first ball joint, or from its end
            result.append(end + point_mass.at_mm[0] * way.bar.line)
        else:
            result.append(_behind_joint(robot.legs, leg, way, point_mass, (poses, actuators)))
    return np.stack(result, axis=1)


def _behind_joint(
    legs: Legs, leg: Leg, way: Walk, point_mass: PointMass, state: tuple[Poses, FloatArray]
) -> FloatArray:
    """Places (n, 3) of a point mass fixed in the frame behind the motion of a joint."""
    (poses, actuators), number = state, [joint.name for joint in leg.joints].index(point_mass.joint)
    joint, turn, place = leg.joints[number], way.turns[number], way.places[number]
    if joint.kind != "fixed":
        known = value_of(legs, joint, actuators, poses.passive)
        if joint.kind == "R":
            turn = turn @ turn_about(joint.axis, known)
        else:
            place = place + known[:, None] * way.axes[number]
    return np.asarray(place + turn @ point_mass.at_mm)


def driven_loads(robot: "GeneralRobot", motion: DriveMotion, poses: Poses, gravity_mm_s2: FloatArray) -> FloatArray:
    """Loads (n, D) on the driven values, in N mm or N.

    motion: values, rates and accelerations (n, K) of the drives; poses: the Poses there. NaN where a pose is not known.
    """
    robot, motion = _uncoupled(robot, motion)
    force, actuators = _forces(robot, motion, poses, gravity_mm_s2), motion[0]
    result = np.empty(actuators.shape)
    for k, kind in enumerate(robot.legs.driven_kinds):
        step = _STEP[kind] * np.eye(actuators.shape[1])[k]
        slope = (_moved(robot, actuators + step, poses) - _moved(robot, actuators - step, poses)) / (2.0 * _STEP[kind])
        result[:, k] = np.einsum("nla,nla->n", slope, force)
    return result


def member_forces(robot: "GeneralRobot", motion: DriveMotion, poses: Poses, gravity_mm_s2: FloatArray) -> FloatArray:
    """Forces (n, members) in N that a robot's masses put on its members, compression positive.

    A member that grows by s does the work f s on them: f = -sum m (g - x'') . dx/ds. motion, poses as in
    `driven_loads`.
    """
    robot, motion = _uncoupled(robot, motion)
    force, numbers = _forces(robot, motion, poses, gravity_mm_s2), robot.legs.site_numbers
    result = np.zeros((len(motion[0]), len(robot.parts.members)))
    for k, site in ((k, site) for k, group in enumerate(robot.parts.members) for site in group):
        growth = np.zeros((1, len(numbers), 6))
        growth[0, numbers[site], 0] = _STEP["P"]
        longer, shorter = (_moved(robot, motion[0], poses, sign * growth) for sign in (1.0, -1.0))
        result[:, k] -= np.einsum("nla,nla->n", (longer - shorter) / (2.0 * _STEP["P"]), force)
    return result


def moments(
    robot: "GeneralRobot", motion: DriveMotion, poses: Poses, gravity_mm_s2: FloatArray, at_mm: FloatArray
) -> FloatArray:
    """Moments (n, J, 3) in N mm of an arm's masses about the places at_mm (n, J, 3) of the joints that carry them.

    The joints are `rrru.kinematics.legs.Legs.arm_joints`; motion, poses as in `driven_loads`.
    """
    robot, motion = _uncoupled(robot, motion)
    force, place = _forces(robot, motion, poses, gravity_mm_s2), places(robot, motion[0], poses)
    behind = _behind(robot.legs)
    result = np.empty(at_mm.shape)
    for k, name in enumerate(robot.legs.arm_joints):
        carried = [point_mass.joint in (*behind[name], PLATFORM) for point_mass in robot.point_masses]
        lever = place[:, carried] - at_mm[:, k, None]
        result[:, k] = cross(lever, force[:, carried]).sum(axis=1)
    return result


def base_moment(robot: "GeneralRobot", motion: DriveMotion, poses: Poses, gravity_mm_s2: FloatArray) -> FloatArray:
    """Moments (n, 3) in N mm of a robot's masses about its origin; motion, poses as in `driven_loads`."""
    robot, motion = _uncoupled(robot, motion)
    force, place = _forces(robot, motion, poses, gravity_mm_s2), places(robot, motion[0], poses)
    return np.asarray(cross(place, force).sum(axis=1))


def _behind(legs: Legs) -> dict[str, set[str]]:
    """By joint's name the names of it and of all joints behind it, in every leg that has it."""
    result: dict[str, set[str]] = {}
    for leg in legs.legs:
        names = [joint.name for joint in leg.joints]
        for number, name in enumerate(names):
            result.setdefault(name, set()).update(names[number:])
    return result


def _uncoupled(robot: "GeneralRobot", motion: DriveMotion) -> tuple["GeneralRobot", DriveMotion]:
    """The robot with all its driven values free, and a motion (values, rates, accelerations) of these."""
    values, rates, accelerations = (robot.legs.driven(part) for part in motion)
    free = robot if robot.legs.coupling is None else replace(robot, legs=robot.legs.uncoupled)
    return free, (values, rates, accelerations)


def _moved(robot: "GeneralRobot", actuators: FloatArray, poses: Poses, twists: FloatArray | None = None) -> FloatArray:
    """Places (n, point masses, 3) at other driven values (n, D) or under twists (1, sites, 6), from Poses nearby."""
    return places(robot, actuators, robot.model.solve(actuators, poses, twists), twists)


def _forces(robot: "GeneralRobot", motion: DriveMotion, poses: Poses, gravity_mm_s2: FloatArray) -> FloatArray:
    """Weight and inertia force (n, point masses, 3) in N of every point mass."""
    actuators, rate, acceleration = motion
    bend = 0.5 * _STEP_S**2 * acceleration
    steps = (_moved(robot, actuators + sign * _STEP_S * rate + bend, poses) for sign in (1.0, -1.0))
    second = (sum(steps) - 2.0 * places(robot, actuators, poses)) / _STEP_S**2
    mass = np.array([point_mass.mass_kg for point_mass in robot.point_masses])
    return mass[:, None] * (gravity_mm_s2 - second) / 1000.0
