"""Compensation table: drive values that bring the robot, as diagnosed, to the commanded positions. mm and rad.

The grid fills the box about the measured points as far as one of these is near, and where an error is a function of
drives' values as far as these were read. It is the only correction where no model file can hold what was found. The
robot is at rest, as warm as at the campaign's end.
"""

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from rrru.arrays import FloatArray, IntArray
from rrru.campaign import measurements as rows
from rrru.diagnosis.inference import InferenceResult
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.effects.motion import Course, make_motion
from rrru.effects.protocol import Contribution, Motion
from rrru.kinematics.dynamics import Masses
from rrru.kinematics.inverse import inverse_kinematics
from rrru.kinematics.robot import Robot

# of drive values, in rad and in mm
_ROUNDING = 1e-9


def corrected_drives(inference: InferenceResult, masses: Masses) -> pd.DataFrame:
    """Rows of `corrected_drives` of an inference; masses: of the robot."""
    problem = inference.problem
    robot, known = problem.mechanism, problem.used
    commands, drives = rows.command(problem.measurements)[known], rows.actuators(problem.measurements, robot)[known]
    position, nearest = _grid(commands)
    stated = robot.solve(drives[nearest], commands[nearest])
    turn = stated.turn
    nominal = inverse_kinematics(
        robot, (position, turn), (drives[nearest].copy(), commands[nearest]), robot.twists(), False
    )
    reached = np.isfinite(nominal).all(axis=1)
    if any(problem.effects[name].of_drive_value for name, _ in inference.state.effects if name in problem.effects):
        # a function of a drive's value is not known beyond the values that were read; a drive that stood still has none
        low, high = drives.min(axis=0), drives.max(axis=0)
        within = (nominal >= low - _ROUNDING) & (nominal <= high + _ROUNDING)
        reached &= (within | (high - low <= _ROUNDING)).all(axis=1)
    position, turn, nominal = position[reached], turn[reached], nominal[reached]
    end = at_end(problem)
    loads = dict(zip(("payload_kg", "time_s", "temperature_c"), end, strict=True))
    if not len(position):
        return _table(robot, (position, turn), (nominal, {0: nominal}), loads)
    found = {}
    for approach in (-1, 1):
        corrected = nominal
        for _ in range(OPTIONS.correction_iterations):
            motion = at_rest(robot, masses, (position, corrected, *end), approach, nominal)
            twists = robot.twists(inference.state.deviations) + effect_twists(inference, motion)
            corrected = inverse_kinematics(robot, (position, turn), (nominal, position), twists)
        found[approach] = corrected
    if np.nanmax(np.abs(found[1] - found[-1]), initial=0.0) < OPTIONS.min_sense_difference:
        found = {0: found[1]}
    return _table(robot, (position, turn), (nominal, found), loads)


def _table(
    robot: Robot,
    place: tuple[FloatArray, FloatArray],
    drives: tuple[FloatArray, dict[int, FloatArray]],
    state: dict[str, float],
) -> pd.DataFrame:
    """The rows of places and drives: nominal ones (n, K), and found ones (n, K) by the side that they come from."""
    (position, turn), (nominal, found) = place, drives
    vectors = Rotation.from_matrix(turn).as_rotvec().reshape(-1, 3)
    columns = {"point": np.arange(1, len(position) + 1)} | rows.vector_columns("command", position)
    columns |= {f"command_r{axis}_rad": value for axis, value in zip("xyz", vectors.T, strict=True)}
    columns |= dict(zip(robot.parts.columns, nominal.T, strict=True)) | state
    names = [f"corrected_{name}" for name in robot.parts.columns]
    frames = [
        pd.DataFrame(columns | dict(zip(names, values.T, strict=True))).assign(approach=side)
        for side, values in found.items()
    ]
    table = pd.concat(frames, ignore_index=True)
    # no temperature is known where the file has none
    known = table.drop(columns="temperature_c").to_numpy(dtype=float)
    return table[np.isfinite(known).all(axis=1)].reset_index(drop=True)


def _grid(commands: FloatArray) -> tuple[FloatArray, IntArray]:
    """Points (g, 3) of the box about commands (n, 3) that one of these is near, and its number (g,)."""
    low, high = commands.min(axis=0), commands.max(axis=0)
    lines = [
        np.linspace(a, b, OPTIONS.drive_table_grid_lines) if b - a > OPTIONS.min_extent_mm else np.array([a])
        for a, b in zip(low, high, strict=True)
    ]
    points = np.stack([axis.ravel() for axis in np.meshgrid(*lines, indexing="ij")], axis=1)
    step = np.maximum((high - low) / (OPTIONS.drive_table_grid_lines - 1), OPTIONS.min_extent_mm)
    far, number = cKDTree(commands / step).query(points / step, p=np.inf)
    return points[far <= OPTIONS.max_grid_distance_steps], number[far <= OPTIONS.max_grid_distance_steps]


def at_end(problem: DiagnosisProblem) -> tuple[float, float, float]:
    """The largest payload in kg, time in s of a campaign's end, and its last temperature in degrees C, NaN for none."""
    motion = problem.motion
    payload_kg = float(np.nan_to_num(motion.payload_kg[problem.used]).max(initial=0.0))
    known = motion.temperature_c[np.isfinite(motion.temperature_c)]
    return payload_kg, float(np.nanmax(motion.time_s, initial=0.0)), float(known[-1]) if len(known) else np.nan


def at_rest(
    robot: Robot,
    masses: Masses,
    state: tuple[FloatArray, FloatArray, float | FloatArray, float | FloatArray, float | FloatArray],
    approach: float | FloatArray,
    nominal: FloatArray,
) -> Motion:
    """The Motion at rest at positions (n, 3) and drives (n, K), each of which came from one side.

    state: positions in mm, drives, and payload in kg, time in s and temperature in degrees C (NaN if unknown), one
    number or (n,); approach: 1 from smaller values, -1 from larger ones, one number or (n, K); nominal (n, K): drive
    values that bring the nominal robot there, which is where it stands.
    """
    position, drive, payload, time_s, temperature_c = state
    count, nothing = len(position), np.zeros_like(position)
    course = Course(
        position_mm=position,
        drive=drive,
        path_drive=drive,
        path_index=np.arange(count),
        time_s=np.full(count, time_s),
        velocity_mm_s=nothing,
        acceleration_mm_s2=nothing,
        payload_kg=np.full(count, payload),
        temperature_c=temperature_c,
        drive_motion=(np.zeros_like(drive), np.zeros_like(drive)),
        # from further away than any backlash, and any travel over which friction builds up
        approach=approach,
    )
    motion: Motion = make_motion(robot, masses, course, (nominal, robot.map_at(nominal, position)))
    return motion


def effect_twists(inference: InferenceResult, motion: Motion) -> FloatArray:
    """Twists of the effects of an inference's state that a robot at rest has."""
    state, library = inference.state, inference.problem.library
    change = Contribution(motion.robot.twists())
    for key in state.effects:
        needs = library[key[0]].needs
        if all(np.isfinite(getattr(motion, need)).all() for need in needs):
            change = change + state.contribution(library, key, motion)
    return np.asarray(change.twists)
