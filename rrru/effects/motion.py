"""The motion that the effects see, from what the platform is told to do. Lengths mm, angles rad, forces N, times s."""

import numpy as np

from rrru.effects.protocol import Motion
from rrru.mechanisms.dynamics import drive_rates, held_force, loads


def make_motion(
    mechanism,
    masses,
    position_mm,
    theta_rad,
    path_theta_rad,
    path_index,
    time_s,
    velocity_mm_s,
    acceleration_mm_s2,
    payload_kg,
):
    """Motion at n commanded points: rates and loads of the nominal mechanism, everything else as given.

    position_mm, theta_rad, velocity_mm_s, acceleration_mm_s2: (n, 3); path_theta_rad (N, 3) with rows path_index (n,); time_s, payload_kg: (n,);
    masses: `rrru.mechanisms.dynamics.Masses`. Where the velocity is NaN the rates are; the loads then count the platform as at rest, and an
    unknown payload as none. The loads are those at the commanded position: a controller's own corrections are too small to change them.
    """
    position = np.asarray(position_mm, dtype=float)
    payload = np.asarray(payload_kg, dtype=float)
    rate, drive_acceleration = drive_rates(mechanism, position, velocity_mm_s, acceleration_mm_s2)
    known = np.isfinite(velocity_mm_s).all(axis=1, keepdims=True) & np.isfinite(acceleration_mm_s2).all(axis=1, keepdims=True)
    nominal, acceleration, carried = mechanism.inverse(position), np.where(known, acceleration_mm_s2, 0.0), np.nan_to_num(payload)
    force, direction, torque = loads(mechanism, masses, position, nominal, np.where(known, drive_acceleration, 0.0), acceleration, carried)
    return Motion(
        position_mm=position,
        theta_rad=np.asarray(theta_rad, dtype=float),
        theta_rate_rad_s=rate,
        theta_acceleration_rad_s2=drive_acceleration,
        path_theta_rad=np.asarray(path_theta_rad, dtype=float),
        path_index=np.asarray(path_index),
        time_s=np.asarray(time_s, dtype=float),
        payload_kg=payload,
        force_n=force,
        held_force_n=held_force(mechanism, masses, position, nominal, acceleration, carried),
        force_direction=direction,
        torque_nmm=torque,
        lengths_mm=np.array([mechanism.R_mm, mechanism.L1_mm, mechanism.L2_mm, mechanism.L3_mm, mechanism.r_mm]),
    )
