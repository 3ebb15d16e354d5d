"""A robot's file as it came and as corrected, read again and driven along the campaign. Lengths in mm, angles in rad.

The robot of the corrected file is compared with the one that the diagnosis has found, at the same drive values: the
points that were read, at the measured poses and at fresh ones between them. The file's robot is closed at its drive
values, with the effects that the file holds in addition to geometry.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from rrru.arrays import FloatArray
from rrru.campaign import measurements as rows
from rrru.campaign.stated_motion import rests
from rrru.diagnosis.correction.corrected_file import Corrected, corrected
from rrru.diagnosis.correction.drive_table import at_rest, corrected_drives, effect_twists
from rrru.diagnosis.diagnose import Diagnosis
from rrru.diagnosis.inference import InferenceResult
from rrru.diagnosis.number_text import readable
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.diagnosis.result_notes import payload_notes
from rrru.diagnosis.shrink import model_row
from rrru.diagnosis.verdict_facts import NOT_CORRECTED
from rrru.effects.library import active_effects
from rrru.effects.protocol import Motion, together
from rrru.errors import ConfigError, SimulationError, UnreachableError
from rrru.formats.file_changes import Found, placement_of
from rrru.formats.robot_file import with_tip
from rrru.kinematics.chain import Poses
from rrru.kinematics.dynamics import Masses
from rrru.kinematics.legs import TOOL, WORLD
from rrru.kinematics.robot import Robot
from rrru.robots.catalogue import make_mechanism
from rrru.seeds import stream
from rrru.simulation.mujoco_robot import MujocoRobot
from rrru.store.atomic_write import write_text

_USE_DRIVES = "use the drive values of corrected_drives.parquet, which is in the folder of this file"
# fields of a Motion that have no row for each point
_WITHOUT_ROWS = ("robot", "path_drive", "load_slopes")


def write_corrected(
    diagnosis: Diagnosis, section: dict[str, Any], masses: Masses, file: Path | str, seed: int = 0
) -> Diagnosis:
    """The Diagnosis with residual errors of its robot's corrected file, and `corrected_drives`; writes the file.

    A file that cannot be corrected, or whose loops of bodies do not close afterwards, becomes an empty one with the
    reason in a comment and in `not_in_model`. section: the robot's entry in the configuration; masses: the
    robot's; seed: of the fresh poses at which file and diagnosis are compared.
    """
    file, inference, section = Path(file), diagnosis.inference, with_tip(section)
    shrink, why, worth = diagnosis.tables["gap_shrink"], "", {}
    try:
        if why_not := diagnosis.verdict["no_answer"]:
            raise ConfigError(why_not)
        written = corrected(inference, section, file.resolve().parent)
        write_text(written.text, file)
        more, why = gap_rows(inference, written, section, file, shrink)
        _refuse_worse(more)
        error = file_error(inference, _model(inference, written, section, file), masses, stream(seed, "fresh poses"))
        expected = _expected_mm(diagnosis, written, error)
        worth = {
            "file_error_mm": error.measured_mm,
            "file_error_fresh_mm": error.fresh_mm,
            "file_expected_mm": expected,
            "file_remainder": _remainder(shrink, more, written, inference, expected),
            "file_headline": _headline(written, error),
        }
        shrink, lost = pd.concat([shrink, more], ignore_index=True), written.not_in_model
    except ConfigError as error:
        tag, said = ("mujoco" if "mjcf" in section else "robot"), " ".join(str(error).replace("--", "-").split())
        write_text(f"<{tag}><!-- not corrected: {said} --></{tag}>\n", file)
        lost = (f"{NOT_CORRECTED}{said}",)
    notes = "; ".join(filter(None, (diagnosis.verdict["notes"], why)))
    verdict = diagnosis.verdict | worth | {"notes": notes, "not_in_model": "; ".join(lost)}
    tables = {"gap_shrink": shrink, "corrected_drives": corrected_drives(inference, masses)}
    return replace(diagnosis, verdict=verdict, tables=diagnosis.tables | tables)


def _expected_mm(diagnosis: Diagnosis, written: Corrected, error: "FileError") -> float:
    """Error in mm to expect of a corrected file's robot at poses and loads like those measured.

    Its distance from the diagnosed robot and the error of that one at held-out points are independent: squares add. The
    numbers of a file that cannot hold an effect are fitted to the readings at which that distance is taken, so that
    what their fit leaves at left-out stops is the better estimate where it is larger.
    """
    distance_mm = np.fmax(error.measured_mm, error.fresh_mm)
    return max(float(np.hypot(distance_mm, diagnosis.verdict["gap_after_rms_mm"])), written.predicted_mm)


def _left_mm(steps: pd.DataFrame, kind: str) -> float:
    """Root mean square residual in mm on all trajectories of the last row of a kind of `gap_shrink`, NaN for none."""
    chosen = steps[(steps["kind"] == kind) & (steps["trajectory"] == "*")] if len(steps) else steps
    return float(chosen["rms_mm"].iloc[-1]) if len(chosen) else np.nan


def _refuse_worse(more: pd.DataFrame) -> None:
    """Raise ConfigError where the residual error of the corrected file exceeds that of the file as it came."""
    given, written = _left_mm(more, "given_model"), _left_mm(more, "corrected_model")
    if written > given:
        raise ConfigError(
            f"its residual error would be {written:.3g} mm rms, that of the file as it came is {given:.3g} mm"
        )


def _remainder(
    shrink: pd.DataFrame, more: pd.DataFrame, written: Corrected, inference: InferenceResult, expected: float
) -> str:
    """Residual error of a corrected file beyond that of the diagnosis, in words, empty where negligible.

    written: the Corrected file; inference: the InferenceResult, whose payload and tilt no file holds, and for whose
    readings the residual error holds; expected: that error in mm, of file and diagnosis together.
    """
    of_weight = tuple(payload_notes(inference))
    left, whole = _left_mm(more, "corrected_model"), _left_mm(shrink, "held_out")
    if written.lacking or of_weight:
        names = ", ".join([*map(readable, written.lacking), *(f"that {note}" for note in of_weight)])
        size = f": {expected:.2g} mm rms remain {_conditions(inference.problem)}" if np.isfinite(expected) else ""
        return f"this {_holds(written)} and not {names}{size}; {_USE_DRIVES}"
    if not left > OPTIONS.max_file_remainder_ratio * whole:
        return ""
    return f"this file leaves {left:.2g} mm rms at the readings, the diagnosis {whole:.2g} mm; {_USE_DRIVES}"


def _conditions(problem: DiagnosisProblem) -> str:
    """Poses, payloads, speeds and temperatures of the readings in use, in words: a residual error holds for these."""
    frame = problem.measurements[problem.used]
    moved = "robot at rest" if rests(frame) else _range(frame, "speed_mm_s", "speed", "mm/s")
    loads = (_range(frame, "payload_kg", "payload", "kg"), moved, _range(frame, "temperature_c", "temperature", "°C"))
    return f"at poses and loads like those measured ({', '.join(loads)})"


def _range(frame: pd.DataFrame, column: str, word: str, unit: str) -> str:
    """The range of a column in words, "unknown" where nothing was recorded."""
    values = frame[column].dropna() if column in frame else pd.Series(dtype=float)
    if not len(values):
        return f"{word} unknown"
    low, high = f"{values.min():.3g}", f"{values.max():.3g}"
    return f"{word} {low if low == high else f'{low} to {high}'} {unit}"


def _holds(written: Corrected) -> str:
    """What a Corrected file's format holds."""
    if written.mjcf:
        return "MJCF holds geometry, compliance and backlash of the drives"
    return "URDF holds the geometry only"


def _headline(written: Corrected, error: "FileError") -> str:
    """That a corrected file is worse than the calibration, and why, in words; empty where it is not."""
    if not error.readings_mm > OPTIONS.max_file_remainder_ratio * error.calibrated_mm:
        return ""
    lost, most = written.not_in_model, OPTIONS.max_listed_numbers
    more = f" and {len(lost) - most} more" if len(lost) > most else ""
    lacking = f"; it cannot hold: {', '.join(lost[:most])}{more}" if lost else ""
    sizes = f"{error.readings_mm:.2g} mm rms, the calibration one of {error.calibrated_mm:.2g} mm"
    return f"the corrected file has a residual error of {sizes}{lacking}"


def _model(inference: InferenceResult, written: Corrected, section: dict[str, Any], file: Path) -> "FileModel":
    """The FileModel of a Corrected file, loaded anew."""
    robot = _robot(inference.problem, section | {"mjcf" if written.mjcf else "urdf": str(file)})
    return FileModel(robot, written.in_file, _instrument(inference.problem, robot, written.found, True))


def gap_rows(
    inference: InferenceResult, corrected: Corrected, section: dict[str, Any], file: Path, shrink: pd.DataFrame
) -> tuple[pd.DataFrame, str]:
    """Rows of `gap_shrink`: of the robot's file as it came, and of the Corrected one, and why MuJoCo did not drive it.

    section: the robot's entry in the configuration; file: the corrected one; shrink: the other rows. MuJoCo drives an
    MJCF, up to 300 points of the campaign, with what loads and drives it itself; where it cannot, and of a URDF, both
    are closed at the drive values that the numbers in the file lead to. Raises ConfigError where the corrected file is
    no robot.
    """
    key = "mjcf" if "mjcf" in section else "urdf"
    models = [
        ("given_model", _robot(inference.problem, section), {}),
        ("corrected_model", _robot(inference.problem, section | {key: str(file)}), corrected.in_file),
    ]
    files, why = (section[key], file), ""
    try:
        if key == "urdf":
            raise ConfigError("a URDF has no actuators")
        poses = [
            simulated(inference.problem.motion, robot, Path(one), section["platform"])
            for (_, robot, _), one in zip(models, files, strict=True)
        ]
    except (ConfigError, SimulationError, UnreachableError) as error:
        # a semicolon separates notes
        reason = str(error).replace("; ", ", ")
        why = f"corrected model not driven, but closed at its drive values, since {reason}"
        poses = [_closed(inference.problem, robot, effects) for _, robot, effects in models]
    result, problem = [], inference.problem
    known = problem.on_robot & problem.complete({term.effect for term in inference.fit.terms})
    for (kind, robot, _), (at, twists) in zip(models, poses, strict=True):
        twists = twists + _instrument(problem, robot, corrected.found, kind == "corrected_model")
        # the file is not judged where the sense of arrival of a drive is unknown
        left = np.where(known[:, None], problem.by_other(robot, at, twists), np.nan)
        if np.isfinite(left).all(axis=1).any():
            result.append(model_row(shrink, kind, left, problem.noise_mm))
    return pd.DataFrame(result), why


def _robot(problem: DiagnosisProblem, section: dict[str, Any]) -> Robot:
    """The robot of a file."""
    if "mjcf" in section:
        # what was found of the tool is counted from where it was, not from where a corrected file has it
        section = section | {"tool_mm": [*problem.mechanism.tool_mm]}
    robot = make_mechanism(problem.mechanism.name, section, parameter_set="frame")
    reading: Robot = robot.with_measurement_config(problem.mechanism.measurement_config)
    return reading


def simulated(motion: Motion, robot: Robot, file: Path, platform: str) -> tuple[Poses, FloatArray]:
    """Poses (n) of an MJCF that MuJoCo drives along a Motion, NaN beyond what is driven, and no twists.

    robot: of the file. Raises ConfigError, SimulationError or UnreachableError where it cannot be driven.
    """
    count = min(len(motion), OPTIONS.max_driven_points)
    first = replace(
        motion,
        **{name: getattr(motion, name)[:count] for name in motion.__dataclass_fields__ if name not in _WITHOUT_ROWS},
    )
    poses, _ = MujocoRobot(robot, file, platform).posed(first, first.position_mm)
    whole = _nowhere(robot, len(motion))
    for name in ("position_mm", "turn", "residual_mm", "closed"):
        getattr(whole, name)[:count] = getattr(poses, name)
    return whole, robot.twists()


def _nowhere(robot: Robot, count: int) -> Poses:
    """Poses (n) that are unknown."""
    passive = np.zeros((count, len(robot.legs.passive_joints)))
    return Poses(
        np.full((count, 3), np.nan),
        np.full((count, 3, 3), np.nan),
        passive,
        np.full(count, np.inf),
        np.zeros(count, dtype=bool),
    )


def _closed(
    problem: DiagnosisProblem, robot: Robot, effects: Mapping[str, Mapping[str, float]]
) -> tuple[Poses, FloatArray]:
    """Poses (n) of a robot closed at the drive values of the campaign and what effects add, and its twists."""
    twists = FileModel(robot, effects, robot.twists()).twists(problem.motion)
    actuators, command = rows.actuators(problem.measurements, robot), rows.command(problem.measurements)
    return robot.solve(actuators, command, twists), twists


def _instrument(problem: DiagnosisProblem, robot: Robot, found: Found, corrected: bool) -> FloatArray:
    """Twists (1, sites, 6) of what is read: the reflectors' places, and the tool's where it is corrected or these are.

    The frame is the file's, so that reflectors that are not on the robot are moved by it.
    """
    result, numbers = robot.twists(), robot.legs.site_numbers
    config = problem.mechanism.measurement_config
    named = {*config.fitted, *((TOOL,) if corrected or config.fitted or config.turned else ())}
    for name in named & set(found.twists):
        result[0, numbers[name]] = found.twists[name]
    on_world = rows.on_the_world(problem.measurements)
    if on_world is not None:
        frame = problem.measurements[on_world]
        places, sites = rows.vectors(frame, "target"), rows.sites(frame["target"]).to_numpy()
        world = placement_of(found.twists.get(WORLD, np.zeros(6)))
        for name in pd.unique(sites):
            nominal = places[np.flatnonzero(sites == name)[0]]
            corrected_place = nominal + found.twists.get(name, np.zeros(6))[:3]
            result[0, numbers[name], :3] = world[:3, :3] @ corrected_place + world[:3, 3] - nominal
    return result


@dataclass(frozen=True)
class FileModel:
    """A file's robot; effects: values by parameter of those that the file holds; instrument: twists (1, sites, 6) of
    what is read.
    """

    robot: Robot
    effects: Mapping[str, Mapping[str, float]]
    instrument: FloatArray

    def twists(self, motion: Motion) -> FloatArray:
        """Twists (n or 1, sites, 6) of robot and effects along a Motion of the diagnosed robot."""
        acting = active_effects(self.effects, self.robot)
        return self.robot.twists() + (together(acting, replace(motion, robot=self.robot)).twists if acting else 0.0)


@dataclass(frozen=True)
class FileError:
    """Root mean square distances in mm. measured_mm, fresh_mm: of the file's robot from the diagnosed one, at measured
    and at fresh poses; readings_mm, calibrated_mm: of the file's robot and of the calibration from the readings.
    """

    measured_mm: float
    fresh_mm: float
    readings_mm: float
    calibrated_mm: float


def file_error(
    inference: InferenceResult, model: FileModel, masses: Masses, generator: np.random.Generator
) -> FileError:
    """The FileError of a FileModel; masses: of the robot; generator: draws the fresh poses."""
    problem = inference.problem
    actuators, command = problem.driven
    twists = model.twists(problem.motion)
    poses = model.robot.solve(actuators, command, twists)
    of_file = problem.by_other(model.robot, poses, twists + model.instrument)
    known = problem.on_robot & problem.complete({term.effect for term in inference.fit.terms})
    of_file, diagnosed, calibrated = (
        left[known] for left in (of_file, problem.residual(inference.state), problem.residual(inference.calibrated))
    )
    fresh = _fresh_differences(inference, model, masses, generator)
    return FileError(_rms(of_file - diagnosed), _rms(fresh), _rms(of_file), _rms(calibrated))


def _rms(distances_mm: FloatArray) -> float:
    """Root mean square length of vectors (n, 3) without those that are unknown, NaN where all are."""
    squares = (distances_mm[np.isfinite(distances_mm).all(axis=1)] ** 2).sum(axis=1)
    return float(np.sqrt(squares.mean())) if len(squares) else np.nan


def _fresh_differences(
    inference: InferenceResult, model: FileModel, masses: Masses, generator: np.random.Generator
) -> FloatArray:
    """Vectors (n, 3) from the file's robot to the diagnosed one at fresh poses, NaN where one of them has none.

    The drive values are weighted means of those at three measured poses, so that they lie within the measured range.
    Payload, time and temperature are those of one of the three, and each drive comes from either side: an effect makes
    the error that it has in the campaign, and the backlashes of several drives add up as independent errors.
    """
    problem = inference.problem
    robot, (actuators, command) = problem.mechanism, problem.driven
    on_world = rows.on_the_world(problem.measurements)
    usable = np.flatnonzero(problem.used if on_world is None else problem.used & ~on_world)
    picks = usable[generator.integers(len(usable), size=(OPTIONS.fresh_poses, 3))]
    share = generator.dirichlet(np.ones(3), len(picks))
    drive, near = (np.einsum("nk,nkd->nd", share, values[picks]) for values in (actuators, command))
    approach = generator.choice([-1.0, 1.0], size=drive.shape)
    poses = robot.solve(drive, near)
    closed = np.flatnonzero(poses.closed)
    drive, approach, like = drive[closed], approach[closed], picks[closed, 0]
    position = robot.measured(poses.of(closed), robot.twists())
    payload, time_s = (np.nan_to_num(values[like]) for values in (problem.motion.payload_kg, problem.motion.time_s))
    state = position, drive, payload, time_s, problem.motion.temperature_c[like]
    motion = at_rest(robot, masses, state, approach, drive)
    readings = None if problem.readings is None else problem.readings.of(like)
    diagnosed, written = (
        robot.twists(inference.state.deviations) + effect_twists(inference, motion),
        model.twists(motion),
    )
    seen = robot.measured(robot.solve(drive, position, diagnosed), diagnosed, readings)
    poses = model.robot.solve(drive, position, written)
    return seen - model.robot.measured(poses, written + model.instrument, readings)
