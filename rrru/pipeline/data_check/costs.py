"""What a campaign cannot determine, from its columns and its motion alone, before any fit."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.campaign.driven_path import passes_points, stops
from rrru.campaign.noise import ENOUGH_REPEATS, read_noise, repeat_noise
from rrru.diagnosis.determined import poses_needed, require_determined
from rrru.diagnosis.diagnose import with_wide_bounds
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.diagnosis.settings import GapSettings
from rrru.errors import FitError, RrruError
from rrru.kinematics.dynamics import Masses
from rrru.kinematics.robot import Robot
from rrru.pipeline import config as parts
from rrru.pipeline import setup
from rrru.pipeline.config import RobotPart

# share of points from the other side below which a drive counts as always approached from one side
_ONE_WAY = 0.02
_SPARE = f"{OPTIONS.min_spare_numbers} degrees of freedom to spare"
# most names of parameters that are listed
_SHOWN = 8
# remedies by the missing input of an effect
_REMEDIES = {
    "time_s": "a column time_s, in seconds or times of day",
    "drive_rate": "a column time_s on runs along a path that is passed without stops",
    "temperature_c": "a column temperature_c of the robot",
    "last_move": "`motion: stop_and_go` (--set motion=stop_and_go) of a robot that rests at each reading",
}


def costs(measurements: pd.DataFrame, config: Mapping[str, Any], section: Mapping[str, Any]) -> list[str]:
    """Sentences on what the measurements of a campaign's section cannot determine; empty for no such limit."""
    nominal = parts.robot(config, section)
    said = [*_readings(measurements, setup.mechanism(nominal), section), *_passes(measurements, section)]
    try:
        robot = setup.measured_robot(nominal, measurements)
        library = GapSettings.from_config(config["gap"]).library(robot)
        masses = Masses(**parts.masses(config, section))
        problem = make_diagnosis_problem(
            measurements,
            with_wide_bounds(robot),
            masses,
            section.get("noise_mm") or 1.0,
            library,
            True,
            robot.characteristic_length_mm,
        )
    except RrruError as error:
        return [*said, f"no diagnosis: {error}"]
    try:
        problem = require_determined(problem)
    except FitError as error:
        said.insert(0, f"no diagnosis: {error}")
    return [
        *_numbers(nominal, robot),
        *said,
        *_untested(problem),
        *_one_way(problem, robot.parts.columns),
        _poses(problem),
    ]


def _poses(problem: DiagnosisProblem) -> str:
    """Sentence on the number of poses that the calibration needs."""
    rank, needed, read = poses_needed(problem)
    return f"{read} poses are read; their {rank} identifiable parameters need at least {needed}, with {_SPARE}"


def enough_poses(mechanism: Robot) -> str:
    """Sentence on the number of poses of one reflector that are enough for all parameters of a robot."""
    count = len(mechanism.parameters)
    poses = -(-(count + OPTIONS.min_spare_numbers) // 3)
    return (
        f"about {poses} poses of one reflector are enough for the {count} parameters of {mechanism.name}, with {_SPARE}"
    )


def without_times(config: Mapping[str, Any], mechanism: Robot) -> list[str]:
    """Sentences on effects of a robot that are not testable in a file without times."""
    library = GapSettings.from_config(config["gap"]).library(mechanism)
    names = [name for name, effect in library.items() if {"time_s", "drive_rate"} & set(effect.needs)]
    return [f"not testable without times: {', '.join(names)}; add {_REMEDIES['time_s']}"] if names else []


def _numbers(nominal: RobotPart, robot: Robot) -> Iterator[str]:
    """Sentence on the robot's parameters that are not identifiable from the poses."""
    identifiable = set(robot.parameters.names)
    lost = [name for name in setup.mechanism(nominal).parameters.names if name not in identifiable]
    if lost:
        more = f" and {len(lost) - _SHOWN} more" if len(lost) > _SHOWN else ""
        yield f"not identifiable from these poses: {', '.join(lost[:_SHOWN])}{more}; the calibration fixes them"


def _untested(problem: DiagnosisProblem) -> Iterator[str]:
    """Sentences on effects that are not testable, by the reason."""
    reasons: dict[str, list[str]] = {}
    for name, reason in problem.untestable.items():
        reasons.setdefault(reason, []).append(name)
    for reason, names in reasons.items():
        needs = [remedy for need, remedy in _REMEDIES.items() if need in reason]
        remedy = f"; add {' and '.join(needs)}" if needs else ""
        yield f"not testable: {', '.join(names)} ({reason}){remedy}"


def _one_way(problem: DiagnosisProblem, columns: Iterable[str]) -> Iterator[str]:
    """Sentence on drives, by their columns, that approach every point from the same side."""
    motion = problem.motion
    before = motion.path_drive[np.maximum(motion.path_index - 1, 0)]
    known = np.isfinite(motion.last_move).all(axis=1, keepdims=True)
    step = np.where(known, np.nan_to_num(motion.last_move), motion.drive - before)[problem.used]
    up, down = (step > 0.0).mean(axis=0), (step < 0.0).mean(axis=0)
    same = [column for column, one, other in zip(columns, up, down, strict=True) if min(one, other) < _ONE_WAY]
    if same:
        drives = ", ".join(same)
        yield f"always approached from one side: {drives}; backlash is confounded with an offset: also drive back"


def _passes(measurements: pd.DataFrame, section: Mapping[str, Any]) -> Iterator[str]:
    """Sentences on missing repetitions: places at other times, noise, payloads."""
    command = measurements[["command_x_mm", "command_y_mm", "command_z_mm"]].round(3)
    follows_path = passes_points(measurements)
    visits = measurements["run"] if follows_path else pd.Series(stops(measurements), index=measurements.index)
    if not (visits.groupby([*command.to_numpy().T]).nunique() > 1).any():
        missing, remedy = ("in two runs", "repeat a run") if follows_path else ("twice", "return to some stops later")
        yield f"no place is measured {missing}: drift is confounded with effects of the place; {remedy}"
    stated = "noise_mm" in section or read_noise(measurements) is not None
    if not stated and (freedom := repeat_noise(measurements)[1]) < ENOUGH_REPEATS:
        yield _estimated_noise(measurements, freedom // 3)
    if measurements["payload_kg"].nunique() < 2:
        mass = "" if "platform_mass_kg" in section else "; platform_mass_kg is not stated"
        yield f"one payload: compliance shows under the robot's own weight only{mass}"


def _estimated_noise(measurements: pd.DataFrame, repeats: int) -> str:
    """Sentence on what counts as noise where it is neither stated nor determined by repeats of readings."""
    needed = -(-ENOUGH_REPEATS // 3)
    found = f"{repeats} readings repeat an earlier one (same trajectory, pose, direction, speed and payload)"
    rough = "errors that change from point to point along the runs count as noise"
    if not passes_points(measurements):
        rough = "the poses follow no path, so that systematic errors of the calibrated robot count as noise"
    return f"noise_mm is not stated and {found}, where {needed} would determine it: {rough}; state noise_mm"


def _readings(measurements: pd.DataFrame, robot: Robot, section: Mapping[str, Any]) -> Iterator[str]:
    """Sentences on what positions of one point do not determine on robots that rotate their platform."""
    few_targets = "target" not in measurements or measurements["target"].nunique() < 3
    if robot.orients and few_targets and not rows.has_turns(measurements):
        yield "no orientations and fewer than three reflectors: pure rotations of the tool about its point do not show"
    if section.get("frame") == "register":
        yield "frame: register is solved from the robot's own points: the pose of its base is not determined"
