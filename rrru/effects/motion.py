"""The motion that the effects see, from what the platform is told to do. Lengths mm, angles rad, forces N, times s."""

import numpy as np

from rrru.effects.effect import Motion
from rrru.robots.dynamics import drive_rates, held_force, loads
from rrru.robots.rrru3 import Rrru3


def make_motion(
    mechanism,
    masses,
    position_mm,
    drive,
    path_drive,
    path_index,
    time_s,
    velocity_mm_s,
    acceleration_mm_s2,
    payload_kg,
):
    """Motion at n commanded points: rates and loads of the nominal mechanism, everything else as given.

    position_mm, drive, velocity_mm_s, acceleration_mm_s2: (n, 3); path_drive (N, 3) with rows path_index (n,); time_s,
    payload_kg: (n,); masses: `rrru.robots.dynamics.Masses`. Where the velocity is NaN the rates are; the loads then
    count the platform as at rest, and an unknown payload as none. The loads are those at the commanded position: a
    controller's own corrections are too small to change them.
    """
    position = np.asarray(position_mm, dtype=float)
    payload = np.asarray(payload_kg, dtype=float)
    rate, drive_acceleration = drive_rates(mechanism, position, velocity_mm_s, acceleration_mm_s2)
    known = np.isfinite(velocity_mm_s).all(axis=1, keepdims=True) & np.isfinite(acceleration_mm_s2).all(
        axis=1, keepdims=True
    )
    nominal, acceleration, carried = (
        mechanism.inverse(position),
        np.where(known, acceleration_mm_s2, 0.0),
        np.nan_to_num(payload),
    )
    force, direction, load = loads(
        mechanism, masses, position, nominal, np.where(known, drive_acceleration, 0.0), acceleration, carried
    )
    # only the 3-RRRU has a joint within its legs that friction can hold
    held = (
        held_force(mechanism, masses, position, nominal, acceleration, carried)
        if isinstance(mechanism, Rrru3)
        else force
    )
    return Motion(
        position_mm=position,
        drive=np.asarray(drive, dtype=float),
        drive_rate=rate,
        drive_acceleration=drive_acceleration,
        path_drive=np.asarray(path_drive, dtype=float),
        path_index=np.asarray(path_index),
        time_s=np.asarray(time_s, dtype=float),
        payload_kg=payload,
        force_n=force,
        held_force_n=held,
        force_direction=direction,
        drive_load=load,
        lengths_mm=mechanism.lengths_mm,
    )
