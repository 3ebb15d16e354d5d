"""What a campaign cannot tell, from its columns and its motion alone, before anything is fitted."""

import numpy as np

from rrru.campaign import measurements as rows
from rrru.campaign.noise import ENOUGH_REPEATS, read_noise, repeat_noise
from rrru.diagnosis.determined import poses_needed, require_determined
from rrru.diagnosis.diagnose import sim
from rrru.diagnosis.make_problem import make_case
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.settings import GapSettings
from rrru.errors import FitError, RrruError
from rrru.kinematics.dynamics import Masses
from rrru.studies import config as parts
from rrru.studies import setup

# a drive that comes from one side at all but this share of the points is always driven the same way
_ONE_WAY = 0.02
# names of numbers that are listed
_SHOWN = 8
# what gives what an effect needs
_REMEDIES = {
    "time_s": "a column time_s, in seconds or times of day",
    "drive_rate": "a column time_s on runs along a path that is passed without stops",
    "temperature_c": "a column temperature_c of the robot",
    "last_move": "`motion: stop_and_go` of a robot that rests at each reading",
}


def costs(measurements, config, section):
    """Sentences on what measurements of a campaign's section of the configuration cannot tell; empty for nothing."""
    nominal = parts.robot(config, section)
    said = [*_readings(measurements, setup.mechanism(nominal), section), *_passes(measurements, section)]
    try:
        robot = setup.measured_robot(nominal, measurements)
        library = GapSettings.from_config(config["gap"]).library(robot)
        masses = Masses(**parts.masses(config, section))
        case = make_case(
            measurements, sim(robot), masses, section.get("noise_mm") or 1.0, library, True, robot.angle_arm_mm
        )
    except RrruError as error:
        return [*said, f"no diagnosis: {error}"]
    try:
        case = require_determined(case)
    except FitError as error:
        said.insert(0, f"no diagnosis: {error}")
    return [*_numbers(nominal, robot), *said, *_untested(case), *_one_way(case), _poses(case)]


def _poses(case):
    """How many poses the calibration needs."""
    rank, needed, read = poses_needed(case)
    spare = f"{OPTIONS.min_spare_numbers} numbers to spare"
    return f"{read} poses are read; {rank} parameters that these tell apart need at least {needed}, with {spare}"


def without_times(config, mechanism):
    """Sentences on what no diagnosis of a robot sees in a file without times."""
    library = GapSettings.from_config(config["gap"]).library(mechanism)
    names = [name for name, effect in library.items() if {"time_s", "drive_rate"} & set(effect.needs)]
    return [f"cannot be seen without times: {', '.join(names)}; {_REMEDIES['time_s']} would show them"] if names else []


def _numbers(nominal, robot):
    """Numbers of the robot that the poses do not tell from the others."""
    told = set(robot.parameters.names)
    lost = [name for name in setup.mechanism(nominal).parameters.names if name not in told]
    if lost:
        more = f" and {len(lost) - _SHOWN} more" if len(lost) > _SHOWN else ""
        yield f"these poses do not tell {', '.join(lost[:_SHOWN])}{more}: left out of the calibration"


def _untested(case):
    """Effects that lack what they need, by the reason."""
    reasons = {}
    for name, reason in case.untestable.items():
        reasons.setdefault(reason, []).append(name)
    for reason, names in reasons.items():
        needs = [remedy for need, remedy in _REMEDIES.items() if need in reason]
        remedy = f"; {' and '.join(needs)} would show them" if needs else ""
        yield f"cannot be seen: {', '.join(names)} ({reason}){remedy}"


def _one_way(case):
    """Drives that come to every point from the same side."""
    motion = case.motion
    before = motion.path_drive[np.maximum(motion.path_index - 1, 0)]
    known = np.isfinite(motion.last_move).all(axis=1)
    step = np.where(known[:, None], np.nan_to_num(motion.last_move), motion.drive - before)[case.used]
    up, down = (step > 0.0).mean(axis=0), (step < 0.0).mean(axis=0)
    same = [
        column
        for column, one, other in zip(case.mechanism.parts.columns, up, down, strict=True)
        if min(one, other) < _ONE_WAY
    ]
    if same:
        yield f"always approached from one side: {', '.join(same)}; play there looks like an offset: drive back, too"


def _passes(measurements, section):
    """What never comes back: places at other times, noise, payloads."""
    command = measurements[["command_x_mm", "command_y_mm", "command_z_mm"]].round(3)
    runs = measurements["run"].groupby([*command.to_numpy().T]).nunique()
    if not (runs > 1).any():
        yield "no place is measured in two runs: what drifts cannot be told from what depends on the place"
    stated = "noise_mm" in section or read_noise(measurements) is not None
    if not stated and repeat_noise(measurements)[1] < ENOUGH_REPEATS:
        yield "nobody states the noise and hardly a point is repeated: what is rough along the runs counts as noise"
    if measurements["payload_kg"].nunique() < 2:
        mass = "" if "platform_mass_kg" in section else ", whose platform_mass_kg nobody states"
        yield f"one payload: what bends is seen under the robot's own weight alone{mass}"


def _readings(measurements, robot, section):
    """What positions of one point leave open on robots that turn their platform."""
    one = "target" not in measurements or measurements["target"].nunique() < 3
    if robot.orients and one and not rows.has_turns(measurements):
        yield "no orientations and fewer than three reflectors: what only turns the tool about its point is not seen"
    if section.get("frame") == "register":
        yield "frame: register, solved from the robot's own points: where its base stands is not told"
