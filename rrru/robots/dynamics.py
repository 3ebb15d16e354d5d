"""Rates of the drives and loads on the legs along a motion of the platform.

Rates. With the inverse kinematics q(x) along x(h) = x + v h + a h^2 / 2 (central differences: Abramowitz and Stegun,
Handbook of Mathematical Functions, 1964, 25.3)

    q' = (q(x(h)) - q(x(-h))) / 2h,    q'' = (q(x(h)) - 2 q(x) + q(x(-h))) / h^2

Loads. Half of each forearm is lumped at the platform, half at the driven end (elbow or carriage); a drive arm is a
uniform rod of mass m_a, a carriage a point. The platform carries W = (m_p + payload + 3/2 m_f)(g - a), and the legs
push it along g_i with f_i so that sum_i f_i g_i = -W. By virtual work (Tsai, Robot Analysis, 1999, chapter 10) the
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

from rrru.robots import singularity
from rrru.robots.rrru3 import Rrru3

GRAVITY_MM_S2 = 9806.65
# kg mm / s^2 in a newton
_PER_NEWTON = 1000.0
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


def gravity(mechanism):
    """Acceleration of gravity (3,) in mm/s^2 in the robot's frame."""
    return np.array([0.0, 0.0, GRAVITY_MM_S2 if isinstance(mechanism, Rrru3) else -GRAVITY_MM_S2])


def loads(mechanism, masses, position_mm, actuators, drive_acceleration, acceleration_mm_s2, payload_kg):
    """Legs' forces (n, 3) in N on the platform, their directions (n, 3 legs, 3), drives' loads (n, 3) in N mm or N.

    Compression is positive; a load is positive in the drive's sense. position_mm and actuators (n, 3) fit each other;
    payload_kg (n,). NaN where a pose cannot be reached.
    """
    actuators = np.asarray(actuators, dtype=float)
    direction = singularity.leg_forces(mechanism, position_mm, actuators)
    load = _platform_load(mechanism, masses, acceleration_mm_s2, payload_kg)
    force = -np.linalg.solve(direction.transpose(0, 2, 1), load[..., None])[..., 0]
    per_drive = mechanism.actuator_jacobian(position_mm, actuators)
    if mechanism.drive_unit == "mm":
        along = mechanism.rails() @ gravity(mechanism)
        own = (masses.arm_kg + 0.5 * masses.forearm_kg) * (along - drive_acceleration)
    else:
        arm = mechanism.lengths_mm[1]
        weight = 0.5 * (masses.arm_kg + masses.forearm_kg) * GRAVITY_MM_S2 * arm * np.cos(actuators)
        own = weight - (masses.arm_kg / 3.0 + 0.5 * masses.forearm_kg) * arm**2 * drive_acceleration
    return force, direction, np.einsum("nak,na->nk", per_drive, load) + own / _PER_NEWTON


def held_force(mechanism, masses, position_mm, theta_rad, acceleration_mm_s2, payload_kg):
    """Forces (n, 3) in N of the 3-RRRU's legs, as in `loads`, if friction holds joint 3.

    A free joint 3 lets the leg push along its forearm only. Held, it makes one two-force member of L2 and L3, which
    pushes along the line from the elbow (joint 2) to the U-joint. A real leg lies between the two.
    """
    theta, radial = np.asarray(theta_rad, dtype=float)[..., None], mechanism.radial
    arm = np.cos(theta) * radial + np.sin(theta) * np.array([0.0, 0.0, 1.0])
    elbow = mechanism.R_mm * radial + mechanism.L1_mm * arm
    line = np.asarray(position_mm, dtype=float)[:, None, :] + mechanism.r_mm * radial - elbow
    line /= np.linalg.norm(line, axis=-1, keepdims=True)
    load = _platform_load(mechanism, masses, acceleration_mm_s2, payload_kg)
    return -np.linalg.solve(line.transpose(0, 2, 1), load[..., None])[..., 0]


def _platform_load(mechanism, masses, acceleration_mm_s2, payload_kg):
    """Weight and inertia force (n, 3) in N of platform, payload and the platform's half of the forearms."""
    mass = masses.platform_kg + np.asarray(payload_kg, dtype=float) + 1.5 * masses.forearm_kg
    return mass[:, None] * (gravity(mechanism) - acceleration_mm_s2) / _PER_NEWTON
