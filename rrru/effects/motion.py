"""The motion that the effects depend on, from the commanded course. Lengths mm, angles rad, forces N, times s."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from rrru.arrays import FloatArray, IntArray
from rrru.effects.protocol import LOADS, Motion
from rrru.kinematics.chain import Poses
from rrru.kinematics.dynamics import Masses, drive_rates, load_slopes, loads
from rrru.kinematics.parameter_jacobian import TwistMap
from rrru.kinematics.robot import Robot


@dataclass(frozen=True)
class Course:
    """Commanded motion at n points, NaN where it is unknown.

    position_mm, velocity_mm_s, acceleration_mm_s2: (n, 3), drive (n, K); path_drive (N, K): actuator values along
    everything that is driven, with rows path_index (n,); time_s, payload_kg: (n,); drive_motion: first and second
    derivatives (n, K) of the actuator values, None where the positions determine them; stops: whether the robot stopped
    at every point; temperature_c: (n,) or one for all; approach: (n, K) or one for all, see
    `rrru.effects.protocol.Motion`.
    """

    position_mm: FloatArray
    drive: FloatArray
    path_drive: FloatArray
    path_index: IntArray
    time_s: FloatArray
    velocity_mm_s: FloatArray
    acceleration_mm_s2: FloatArray
    payload_kg: FloatArray
    drive_motion: tuple[FloatArray, FloatArray] | None = None
    stops: bool = False
    temperature_c: FloatArray | float = np.nan
    approach: FloatArray | float = np.nan


def make_motion(
    robot: Robot, masses: Masses, course: Course, stands: tuple[FloatArray, TwistMap] | None = None
) -> Motion:
    """Motion along a Course: rates and loads of the nominal robot with `rrru.kinematics.dynamics.Masses`.

    Where the velocity is NaN the rates are; the loads then count the platform as at rest, and an unknown payload as
    none. The loads are those at the commanded position, or where the robot `stands`, from the TwistMap there and
    drive values (n, K) that bring the nominal robot there: see `standing`.
    """
    position, velocity, acceleration, payload = (
        np.asarray(values, dtype=float)
        for values in (course.position_mm, course.velocity_mm_s, course.acceleration_mm_s2, course.payload_kg)
    )
    rate, drive_acceleration = course.drive_motion or drive_rates(robot, position, velocity, acceleration)
    known = (np.isfinite(velocity) & np.isfinite(acceleration)).all(axis=1, keepdims=True)
    # where the platform's orientation is free, only the commanded actuator values determine the pose
    nominal, carried = course.drive if robot.orients else robot.inverse(position), np.nan_to_num(payload)
    inertial = np.where(known, acceleration, 0.0)
    turning = np.where(known, rate, 0.0), np.where(known, drive_acceleration, 0.0)
    nominal, at = stands or (nominal, robot.map_at(nominal, position))
    load = loads(robot, masses, at, nominal, turning, inertial, carried)
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
        **{name: getattr(load, attribute) for name, attribute in LOADS.items()},
        load_slopes=partial(load_slopes, robot, masses, at, nominal, inertial, carried),
        last_move=last_move(course.drive, course.path_index) if course.stops else np.full_like(rate, np.nan),
        temperature_c=np.broadcast_to(np.asarray(course.temperature_c, dtype=float), len(position)),
        approach=np.broadcast_to(np.asarray(course.approach, dtype=float), rate.shape),
    )


def standing(
    robot: Robot, sent: tuple[FloatArray, FloatArray], posed: tuple[Poses, FloatArray], turned: bool = True
) -> tuple[FloatArray, TwistMap]:
    """Drive values (n, K) that bring the nominal robot next to where one stands, and its TwistMap there.

    sent: actuator values (n, K) and positions (n, 3); posed: Poses and the twists (n or 1, sites, 6) of all their
    errors; turned: whether the poses' orientations count, or the tool's position alone. For an arm the errors of its
    drives alone count, for other robots the poses, by one linear step.
    """
    (actuators, position), (poses, twists) = sent, posed
    if not robot.legs.parallel:
        drive = actuators + robot.drive_errors(np.broadcast_to(twists, (len(actuators), *twists.shape[1:])))
        return drive, robot.map_at(drive, position)
    at, tool = robot.map_at(actuators, position), np.asarray(robot.tool_mm)[None]
    shift, turn = poses.point(tool) - at.poses.point(tool), poses.turned_from(at.poses.turn)
    lack, slopes = shift, at.point @ at.drive_counts
    if turned:
        arm = robot.characteristic_length_mm
        lack = np.concatenate([shift, arm * turn], axis=1)
        slopes = np.concatenate([slopes, arm * at.turn @ at.drive_counts], axis=1)
    known, step = np.isfinite(lack).all(axis=1), np.zeros(actuators.shape)
    step[known] = (np.linalg.pinv(slopes[known]) @ lack[known][..., None])[..., 0]
    return actuators + step, robot.map_at(actuators + step, position + np.nan_to_num(shift))


def last_move(drive: FloatArray, stop: IntArray) -> FloatArray:
    """Travel of the drives (n, K) to each row's stop from the one before, NaN at the first; stop (n,) ascending."""
    values, number = np.asarray(drive, dtype=float), np.unique(stop, return_inverse=True)[1]
    at_stop = values[np.unique(number, return_index=True)[1]]
    return np.concatenate([np.full((1, values.shape[1]), np.nan), np.diff(at_stop, axis=0)])[number]
