"""The motion that the effects see, from what the platform is told to do. Lengths mm, angles rad, forces N, times s."""

from dataclasses import dataclass

import numpy as np

from rrru.effects.protocol import Motion
from rrru.robots.dynamics import drive_rates, held_force, loads
from rrru.robots.rrru3 import Rrru3


@dataclass(frozen=True)
class Course:
    """What a robot is told to do at n points, NaN where nobody knows.

    position_mm, drive, velocity_mm_s, acceleration_mm_s2: (n, 3); path_drive (N, 3): actuator values along everything
    that is driven, with rows path_index (n,); time_s, payload_kg: (n,).
    """

    position_mm: np.ndarray
    drive: np.ndarray
    path_drive: np.ndarray
    path_index: np.ndarray
    time_s: np.ndarray
    velocity_mm_s: np.ndarray
    acceleration_mm_s2: np.ndarray
    payload_kg: np.ndarray


def make_motion(mechanism, masses, course):
    """Motion along a Course: rates and loads of the nominal mechanism with `rrru.robots.dynamics.Masses`.

    Where the velocity is NaN the rates are; the loads then count the platform as at rest, and an unknown payload as
    none. The loads are those at the commanded position: a controller's own corrections are too small to change them.
    """
    position, velocity, acceleration, payload = (
        np.asarray(values, dtype=float)
        for values in (course.position_mm, course.velocity_mm_s, course.acceleration_mm_s2, course.payload_kg)
    )
    rate, drive_acceleration = drive_rates(mechanism, position, velocity, acceleration)
    known = (np.isfinite(velocity) & np.isfinite(acceleration)).all(axis=1, keepdims=True)
    nominal, carried = mechanism.inverse(position), np.nan_to_num(payload)
    inertial = np.where(known, acceleration, 0.0)
    turning = np.where(known, drive_acceleration, 0.0)
    force, direction, load = loads(mechanism, masses, position, nominal, turning, inertial, carried)
    # only the 3-RRRU has a joint within its legs that friction can hold
    free = not isinstance(mechanism, Rrru3)
    held = force if free else held_force(mechanism, masses, position, nominal, inertial, carried)
    return Motion(
        position_mm=position,
        drive=np.asarray(course.drive, dtype=float),
        drive_rate=rate,
        drive_acceleration=drive_acceleration,
        path_drive=np.asarray(course.path_drive, dtype=float),
        path_index=np.asarray(course.path_index),
        time_s=np.asarray(course.time_s, dtype=float),
        payload_kg=payload,
        force_n=force,
        held_force_n=held,
        force_direction=direction,
        drive_load=load,
        lengths_mm=mechanism.lengths_mm,
    )
