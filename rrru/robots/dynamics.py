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
of the loads at the platform; a forearm's own rotation is left out. Lengths mm, angles rad, forces N, torques N mm,
masses kg, times s.
"""

from dataclasses import dataclass

import numpy as np

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


def drive_rates(mechanism, position_mm, velocity_mm_s, acceleration_mm_s2):
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


def gravity(robot):
    """Acceleration of gravity (3,) in mm/s^2 in the robot's frame."""
    return -GRAVITY_MM_S2 * np.asarray(robot.up)


def arm_load(masses, arm_mm, theta_rad, acceleration):
    """Torques (n, k) in N mm on drives of arms that stand level at theta_rad = 0, of their masses and half forearms."""
    weight = 0.5 * (masses.arm_kg + masses.forearm_kg) * GRAVITY_MM_S2 * arm_mm * np.cos(theta_rad)
    inertia = (masses.arm_kg / 3.0 + 0.5 * masses.forearm_kg) * arm_mm**2
    return (weight - inertia * acceleration) / PER_NEWTON


@dataclass(frozen=True)
class Loads:
    """Forces (n, members) in N of the members on the platform, compression positive, held_n if friction holds joints.

    drive (n, K): load on each drive in N mm or N, positive in the drive's sense; followers (n, f): on the joints that
    follow drives, likewise; across (n, J, 3): moments in N mm across the axes of an arm's turning joints, in their own
    frames; base (n, 3): moments in N mm about the robot's origin.
    """

    member_n: np.ndarray
    held_n: np.ndarray
    drive: np.ndarray
    followers: np.ndarray
    across: np.ndarray
    base: np.ndarray


def loads(robot, masses, at, actuators, drive_motion, acceleration_mm_s2, payload_kg):
    """Loads of a motion; at: TwistMap of its poses at actuators (n, K); drive_motion: rates and accelerations (n, K) of
    the drives; payload_kg (n,).

    NaN where a pose cannot be reached.
    """
    force = _platform_load(robot, masses, acceleration_mm_s2, payload_kg)
    member = _along_members(robot, at, np.concatenate([force, np.cross(at.point_mm, force)], axis=1))
    motion = np.asarray(actuators, dtype=float), *drive_motion
    member = member + robot.own_member_forces(motion, at.poses)
    held = _held(robot, at, force) if robot.parts.held_from else member
    own = robot.own_load(masses, motion, at.poses)
    driven = np.einsum("nak,na->nk", at.point @ at.driven_counts, force) + own
    numbers = {joint.name: joint.drive for joint in robot.legs.joints}
    followers = [numbers[one.site] for one in robot.parts.followers]
    across = _across(robot, at, force, motion)
    base = np.cross(at.point_mm, force) + robot.own_base_moment(motion, at.poses)
    return Loads(member, held, robot.legs.per_actuator(driven), driven[:, followers], across, base)


def _across(robot, at, force, motion):
    """Moments (n, J, 3) across the axes of an arm's turning joints under forces (n, 3) of the platform and its own."""
    names = robot.legs.arm_joints
    if not names:
        return np.zeros((len(at), 0, 3))
    turns, places = (
        np.stack(parts, axis=1) for parts in zip(*(at.frames[robot.legs.site_numbers[n]] for n in names), strict=True)
    )
    moment = np.cross(at.point_mm[:, None] - places, force[:, None]) * _carrying(robot.legs, at.poses, names)
    moment = moment + robot.own_moments(motion, at.poses, places)
    axes = np.stack([joint.axis for joint in robot.legs.joints if joint.name in names])
    own = np.einsum("njab,nja->njb", turns, moment)
    return own - (own * axes).sum(axis=-1, keepdims=True) * axes


def _carrying(legs, poses, names):
    """1 where the arm of some joints carries the platform of n poses, 0 where that is another arm's: (n, J, 1)."""
    on = np.array([[name in {joint.name for joint in leg.joints} for name in names] for leg in legs.legs], dtype=float)
    return on[poses.leg if legs.hands else np.zeros(len(poses.closed), dtype=int)][:, :, None]


def _along_members(robot, at, load):
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


def _held(robot, at, force):
    """Forces (n, 3) of three legs whose inner joint friction holds, under forces (n, 3) of the platform.

    A free inner joint lets a leg push along its last link only. Held, it makes one two-force member of both its links,
    which pushes along the line from the first to the platform's joint. A real leg lies between the two.
    """
    numbers = robot.legs.site_numbers
    pairs = zip(robot.parts.held_from, (site for (site,) in robot.parts.members), strict=True)
    line = np.stack([at.frames[numbers[far]][1] - at.frames[numbers[near]][1] for near, far in pairs], axis=1)
    line /= np.linalg.norm(line, axis=-1, keepdims=True)
    return -np.linalg.solve(line.transpose(0, 2, 1), force[..., None])[..., 0]


def _platform_load(robot, masses, acceleration_mm_s2, payload_kg):
    """Weight and inertia force (n, 3) in N of platform, payload and the platform's half of the forearms."""
    mass = masses.platform_kg + np.asarray(payload_kg, dtype=float) + 0.5 * len(robot.parts.members) * masses.forearm_kg
    return mass[:, None] * (gravity(robot) - acceleration_mm_s2) / PER_NEWTON
