"""Rates of the drives and loads on the legs along a motion of the platform.

Rates. With the inverse kinematics q(x) along x(h) = x + v h + a h^2 / 2 (central differences: Abramowitz and Stegun,
Handbook of Mathematical Functions, 1964, 25.3)

    q' = (q(x(h)) - q(x(-h))) / 2h,    q'' = (q(x(h)) - 2 q(x) + q(x(-h))) / h^2

Loads. Half of each forearm is lumped at the platform, half at the driven end (elbow or carriage); a drive arm is a
uniform rod of mass m_a, a carriage a point. The platform carries W = (m_p + payload + k/2 m_f)(g - a), and the k
legs push it along g_i with f_i so that sum_i f_i g_i = -W. By virtual work (Tsai, Robot Analysis, 1999, chapter 10) the
loads turn drive arm i, in the sense of theta > 0 which lowers it, with the torque, or push carriage i along its rail
d_i with the force

    tau_i = W . dx/dtheta_i + (m_a / 2 + m_f / 2) g L1 cos(theta_i) - (m_a / 3 + m_f / 2) L1^2 theta_i''
    F_i = W . dx/db_i + (m_a + m_f / 2) (g . d_i - b_i'')

Gravity points along +z in the 3-RRRU's frame and along -z in the others'. The platform's translation is the only motion
of the loads at the platform; a forearm's own rotation is neglected. On a base that is tilted by a small turn w gravity
is g - w x g in the robot's frame. Lengths mm, angles rad, forces N, torques N mm, masses kg, times s.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np

from rrru.arrays import FloatArray, IntArray
from rrru.kinematics.chain import EndEffectorPoses, Poses
from rrru.kinematics.legs import Legs, cross
from rrru.kinematics.parameter_jacobian import TwistMap
from rrru.kinematics.point_masses import DriveMotion

if TYPE_CHECKING:
    from rrru.kinematics.robot import Robot

GRAVITY_MM_S2 = 9806.65
# kg mm / s^2 in a newton
PER_NEWTON = 1000.0
# balances the differences' rounding and truncation for paths that bend over some hundred mm
_STEP_MM = 0.2


@dataclass(frozen=True)
class Masses:
    """Masses in kg: platform without payload, one forearm, one drive arm or carriage."""

    platform_kg: float = 3.0
    forearm_kg: float = 1.2
    arm_kg: float = 2.0


def drive_rates(
    mechanism: "Robot", position_mm: FloatArray, velocity_mm_s: FloatArray, acceleration_mm_s2: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Rates (n, 3) and accelerations (n, 3) of the actuator values, per s and per s^2, from the platform's (n, 3).

    Both are NaN where position or velocity are; where only the platform's acceleration is NaN, only the drives' is.
    """
    position, velocity = np.asarray(position_mm, dtype=float), np.asarray(velocity_mm_s, dtype=float)
    acceleration = np.asarray(acceleration_mm_s2, dtype=float)
    bend = np.nan_to_num(acceleration)
    speed, bending = np.linalg.norm(velocity, axis=1), np.linalg.norm(bend, axis=1)
    with np.errstate(divide="ignore"):
        h = np.minimum(_STEP_MM / speed, np.sqrt(2.0 * _STEP_MM / bending))
    h = np.where(np.isinf(h), 1.0, h)[:, None]
    after = mechanism.inverse(position + velocity * h + 0.5 * bend * h**2)
    before = mechanism.inverse(position - velocity * h + 0.5 * bend * h**2)
    second = (after - 2.0 * mechanism.inverse(position) + before) / h**2
    known = np.isfinite(acceleration).all(axis=1, keepdims=True)
    return (after - before) / (2.0 * h), np.where(known, second, np.nan)


def gravity(robot: "Robot") -> FloatArray:
    """Acceleration of gravity (3,) in mm/s^2 in the robot's frame."""
    return -GRAVITY_MM_S2 * np.asarray(robot.up)


def level_axes(robot: "Robot") -> IntArray:
    """Numbers (2,) of the axes of a robot's frame that are the most level."""
    return np.sort(np.argsort(np.abs(robot.up), kind="stable")[:2])


def arm_load(masses: Masses, arm_mm: float, pulls: FloatArray, acceleration: FloatArray) -> FloatArray:
    """Torques (n, k) in N mm of the arms' own masses and half forearms on drives that turn level arms.

    pulls (n, k): gravity in mm/s^2 along the path of the arms' ends; acceleration (n, k): of the drives.
    """
    weight = 0.5 * (masses.arm_kg + masses.forearm_kg) * arm_mm * pulls
    inertia = (masses.arm_kg / 3.0 + 0.5 * masses.forearm_kg) * arm_mm**2
    return (weight - inertia * acceleration) / PER_NEWTON


@dataclass(frozen=True)
class Loads:
    """Forces (n, members) in N of the members on the platform, compression positive, held_n if friction holds joints.

    drive (n, K): load on each drive in N mm or N, positive in the drive's sense; followers (n, f): on the joints that
    follow drives, likewise; across (n, J, 3): moments in N mm across the axes of an arm's turning joints, in their own
    frames; base (n, 3): moments in N mm about the robot's origin.
    """

    member_n: FloatArray
    held_n: FloatArray
    drive: FloatArray
    followers: FloatArray
    across: FloatArray
    base: FloatArray

    def __add__(self, other: "Loads") -> "Loads":
        return Loads(*(getattr(self, one.name) + getattr(other, one.name) for one in fields(Loads)))


def loads(
    robot: "Robot",
    masses: Masses,
    at: TwistMap,
    actuators: FloatArray,
    drive_motion: tuple[FloatArray, FloatArray],
    acceleration_mm_s2: FloatArray,
    payload_kg: FloatArray,
) -> Loads:
    """Loads of a motion; at: TwistMap of its poses at actuators (n, K); drive_motion: rates and accelerations (n, K) of
    the drives; payload_kg (n,).

    NaN where a pose cannot be reached.
    """
    force = carried_kg(robot, masses, payload_kg)[:, None] * (gravity(robot) - acceleration_mm_s2) / PER_NEWTON
    motion = np.asarray(actuators, dtype=float), *drive_motion
    return _of_platform(robot, at, force) + _of_parts(robot, masses, at, motion, gravity(robot))


def load_slopes(
    robot: "Robot",
    masses: Masses,
    at: TwistMap,
    actuators: FloatArray,
    acceleration_mm_s2: FloatArray,
    payload_kg: FloatArray,
) -> tuple[Loads, ...]:
    """Derivatives of `loads`: by the platform's mass in kg, by the tilt of the base about each level axis, and by
    mass and each of these tilts.

    Exact except for terms of second order in the tilt.
    """
    mass, still = carried_kg(robot, masses, payload_kg)[:, None], np.zeros(np.shape(actuators))
    motion = np.asarray(actuators, dtype=float), still, still
    tilted = [-cross(axis, gravity(robot)) for axis in np.eye(3)[level_axes(robot)]]
    by_mass = _of_platform(robot, at, (gravity(robot) - acceleration_mm_s2) / PER_NEWTON)
    per_kg = [_of_platform(robot, at, np.ones_like(mass) * change / PER_NEWTON) for change in tilted]
    by_tilt = [
        _of_platform(robot, at, mass * change / PER_NEWTON) + _of_parts(robot, masses, at, motion, change)
        for change in tilted
    ]
    return by_mass, *by_tilt, *per_kg


def carried_kg(robot: "Robot", masses: Masses, payload_kg: FloatArray) -> FloatArray:
    """Masses (n,) at the platform: its own, payload_kg (n,) and its half of the forearms."""
    return masses.platform_kg + np.asarray(payload_kg, dtype=float) + 0.5 * len(robot.parts.members) * masses.forearm_kg


def _of_platform(robot: "Robot", at: TwistMap, force: FloatArray) -> Loads:
    """The Loads of forces (n, 3) in N at the platform."""
    member = _along_members(robot, at, np.concatenate([force, cross(at.point_mm, force)], axis=1))
    held = _held(robot, at, force) if robot.parts.held_from else member
    driven = np.einsum("nak,na->nk", at.point @ at.driven_counts, force)
    return _with_followers(robot, driven, member, held, _across(robot, at, force), cross(at.point_mm, force))


def _of_parts(robot: "Robot", masses: Masses, at: TwistMap, motion: DriveMotion, gravity_mm_s2: FloatArray) -> Loads:
    """The Loads of all moving masses except the platform's.

    motion: values, rates and accelerations (n, K) of the drives.
    """
    member = robot.own_member_forces(motion, at.poses, gravity_mm_s2)
    driven = robot.own_load(masses, motion, at.poses, gravity_mm_s2)
    count, sizes = len(motion[0]), (len(robot.parts.members), len(robot.legs.driven_kinds))
    member, driven = (np.broadcast_to(load, (count, size)) for load, size in zip((member, driven), sizes, strict=True))
    held = np.zeros((count, 3)) if robot.parts.held_from else member
    base = robot.own_base_moment(motion, at.poses, gravity_mm_s2)
    across = _own_across(robot, at, motion, gravity_mm_s2)
    return _with_followers(robot, driven, member, held, across, np.broadcast_to(base, (count, 3)))


def _with_followers(
    robot: "Robot", driven: FloatArray, member: FloatArray, held: FloatArray, across: FloatArray, base: FloatArray
) -> Loads:
    """The Loads with loads (n, D) on all driven values."""
    numbers = {joint.name: joint.drive for joint in robot.legs.joints if joint.drive is not None}
    followers = [numbers[one.site] for one in robot.parts.followers]
    return Loads(member, held, robot.legs.per_actuator(driven), driven[:, followers], across, base)


def _across(robot: "Robot", at: TwistMap, force: FloatArray) -> FloatArray:
    """Moments (n, J, 3) across the axes of an arm's turning joints under forces (n, 3) of the platform."""
    names = robot.legs.arm_joints
    if not names:
        return np.zeros((len(at), 0, 3))
    turns, places = _joint_frames(robot, at)
    moment = cross(at.point_mm[:, None] - places, force[:, None]) * _carrying(robot.legs, at.poses, names)
    return _across_axes(robot, turns, moment)


def _own_across(robot: "Robot", at: TwistMap, motion: DriveMotion, gravity_mm_s2: FloatArray) -> FloatArray:
    """The same under an arm's own masses."""
    if not robot.legs.arm_joints:
        return np.zeros((len(at), 0, 3))
    turns, places = _joint_frames(robot, at)
    return _across_axes(robot, turns, robot.own_moments(motion, at.poses, gravity_mm_s2, places))


def _joint_frames(robot: "Robot", at: TwistMap) -> tuple[FloatArray, FloatArray]:
    """Turns (n, J, 3, 3) and places (n, J, 3) of an arm's turning joints."""
    frames = (at.frames[robot.legs.site_numbers[name]] for name in robot.legs.arm_joints)
    turns, places = (np.stack(parts, axis=1) for parts in zip(*frames, strict=True))
    return turns, places


def _across_axes(robot: "Robot", turns: FloatArray, moment: FloatArray | float) -> FloatArray:
    """Components across the axes of moments (n, J, 3) about an arm's turning joints, in the joints' frames."""
    axes = np.stack([joint.axis for joint in robot.legs.joints if joint.name in robot.legs.arm_joints])
    in_joint = np.einsum("njab,nja->njb", turns, np.broadcast_to(moment, turns.shape[:3]))
    return np.asarray(in_joint - (in_joint * axes).sum(axis=-1, keepdims=True) * axes)


def _carrying(legs: Legs, poses: Poses, names: Sequence[str]) -> FloatArray:
    """1 where the arm of some joints carries the platform of n poses, 0 where another arm does: (n, J, 1)."""
    on = np.array([[name in {joint.name for joint in leg.joints} for name in names] for leg in legs.legs], dtype=float)
    leg = poses.leg if isinstance(poses, EndEffectorPoses) else np.zeros(len(poses.closed), dtype=int)
    return np.asarray(on[leg][:, :, None])


def _along_members(robot: "Robot", at: TwistMap, load: FloatArray) -> FloatArray:
    """Forces (n, members) along the members under loads (n, 6) of the platform."""
    numbers, wrenches = robot.legs.site_numbers, at.wrenches(load)
    owner = {
        site: k for k, leg in enumerate(robot.legs.legs) for site in (*(j.name for j in leg.joints), *leg.bar_sites)
    }
    result = np.zeros((len(at), len(robot.parts.members)))
    for k, group in enumerate(robot.parts.members):
        for site in group:
            result[:, k] += (wrenches[owner[site]][:, :3] * at.frames[numbers[site]][0][:, :, 0]).sum(axis=1)
    return result


def _held(robot: "Robot", at: TwistMap, force: FloatArray) -> FloatArray:
    """Forces (n, 3) of three legs whose inner joint friction holds, under forces (n, 3) of the platform.

    A free inner joint lets a leg push along its last link only. Held, it makes one two-force member of both its links,
    which pushes along the line from the first to the platform's joint. A real leg lies between the two.
    """
    numbers = robot.legs.site_numbers
    pairs = zip(robot.parts.held_from, (site for (site,) in robot.parts.members), strict=True)
    line = np.stack([at.frames[numbers[far]][1] - at.frames[numbers[near]][1] for near, far in pairs], axis=1)
    line /= np.linalg.norm(line, axis=-1, keepdims=True)
    return np.asarray(-np.linalg.solve(line.transpose(0, 2, 1), force[..., None])[..., 0], dtype=float)
