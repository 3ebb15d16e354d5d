"""The motion that the effects see, from what the platform is told to do. Lengths mm, angles rad, forces N, times s."""

from dataclasses import dataclass

import numpy as np

from rrru.effects.protocol import Motion
from rrru.robots.dynamics import drive_rates, loads


@dataclass(frozen=True)
class Course:
    """What a robot is told to do at n points, NaN where nobody knows.

    position_mm, velocity_mm_s, acceleration_mm_s2: (n, 3), drive (n, K); path_drive (N, K): actuator values along
    everything that is driven, with rows path_index (n,); time_s, payload_kg: (n,); drive_motion: first and second
    derivatives (n, K) of the actuator values, None where the positions tell them; stops: whether the robot stopped at
    every point; temperature_c: (n,) or one for all.
    """

    position_mm: np.ndarray
    drive: np.ndarray
    path_drive: np.ndarray
    path_index: np.ndarray
    time_s: np.ndarray
    velocity_mm_s: np.ndarray
    acceleration_mm_s2: np.ndarray
    payload_kg: np.ndarray
    drive_motion: tuple | None = None
    stops: bool = False
    temperature_c: np.ndarray | float = np.nan


def make_motion(robot, masses, course):
    """Motion along a Course: rates and loads of the nominal robot with `rrru.robots.dynamics.Masses`.

    Where the velocity is NaN the rates are; the loads then count the platform as at rest, and an unknown payload as
    none. The loads are those at the commanded position: a controller's own corrections are too small to change them.
    """
    position, velocity, acceleration, payload = (
        np.asarray(values, dtype=float)
        for values in (course.position_mm, course.velocity_mm_s, course.acceleration_mm_s2, course.payload_kg)
    )
    rate, drive_acceleration = course.drive_motion or drive_rates(robot, position, velocity, acceleration)
    known = (np.isfinite(velocity) & np.isfinite(acceleration)).all(axis=1, keepdims=True)
    # where the platform's orientation is free, the values that were sent tell the pose
    nominal, carried = course.drive if robot.orients else robot.inverse(position), np.nan_to_num(payload)
    inertial = np.where(known, acceleration, 0.0)
    turning = tuple(np.where(known, values, 0.0) for values in (rate, drive_acceleration))
    load = loads(robot, masses, position, nominal, turning, inertial, carried)
    return Motion(
        robot=robot,
        position_mm=position,
        drive=np.asarray(course.drive, dtype=float),
        drive_rate=rate,
        drive_acceleration=drive_acceleration,
        path_drive=np.asarray(course.path_drive, dtype=float),
        path_index=np.asarray(course.path_index),
        time_s=np.asarray(course.time_s, dtype=float),
        payload_kg=payload,
        force_n=load.member_n,
        held_force_n=load.held_n,
        drive_load=load.drive,
        follower_load=load.followers,
        across=load.across,
        base_moment=load.base,
        last_move=last_move(course.drive, course.path_index) if course.stops else np.full_like(rate, np.nan),
        temperature_c=np.broadcast_to(np.asarray(course.temperature_c, dtype=float), len(position)),
    )


def last_move(drive, stop):
    """How far drives (n, K) went to each row's stop from the one before, NaN at the first; stop (n,): never falling."""
    values, number = np.asarray(drive, dtype=float), np.unique(stop, return_inverse=True)[1]
    at_stop = values[np.unique(number, return_index=True)[1]]
    return np.concatenate([np.full((1, values.shape[1]), np.nan), np.diff(at_stop, axis=0)])[number]
