"""Distance of the robot of a corrected file from the one that a diagnosis has found, at the same drive values.

It compares the points that were read, at the measured poses and at fresh ones between them. The file's robot is closed
at its drive values, with the effects that the file holds in addition to geometry. Lengths in mm, angles in rad.
"""

from dataclasses import dataclass, replace

import numpy as np

from rrru.campaign import measurements as rows
from rrru.diagnosis.correction.drive_table import at_end, at_rest, effect_twists
from rrru.diagnosis.options import OPTIONS
from rrru.effects.library import active_effects
from rrru.effects.protocol import together


@dataclass(frozen=True)
class FileModel:
    """A file's robot; effects: values by parameter of those that the file holds; instrument: twists (1, sites, 6) of
    what is read.
    """

    robot: object
    effects: dict
    instrument: np.ndarray

    def twists(self, motion):
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


def file_error(inference, model, masses, generator):
    """The FileError of a FileModel; masses: of the robot; generator: draws the fresh poses."""
    case = inference.case
    actuators, command = case.driven
    twists = model.twists(case.motion)
    poses = model.robot.solve(actuators, command, twists)
    of_file = case.by_other(model.robot, poses, twists + model.instrument)
    known = case.on_robot & case.complete({term.effect for term in inference.fit.terms})
    of_file, diagnosed, calibrated = (
        left[known] for left in (of_file, case.residual(inference.state), case.residual(inference.calibrated))
    )
    fresh = _fresh_differences(inference, model, masses, generator)
    return FileError(_rms(of_file - diagnosed), _rms(fresh), _rms(of_file), _rms(calibrated))


def _rms(distances_mm):
    """Root mean square length of vectors (n, 3) without those that are unknown, NaN where all are."""
    squares = (distances_mm[np.isfinite(distances_mm).all(axis=1)] ** 2).sum(axis=1)
    return float(np.sqrt(squares.mean())) if len(squares) else np.nan


def _fresh_differences(inference, model, masses, generator):
    """Vectors (n, 3) from the file's robot to the diagnosed one at fresh poses, NaN where one of them has none.

    The drive values are weighted means of those at three measured poses, so that they lie within the measured range.
    """
    case = inference.case
    robot, (actuators, command) = case.mechanism, case.driven
    on_world = rows.on_the_world(case.measurements)
    usable = np.flatnonzero(case.used if on_world is None else case.used & ~on_world)
    picks = usable[generator.integers(len(usable), size=(OPTIONS.fresh_poses, 3))]
    share = generator.dirichlet(np.ones(3), len(picks))
    drive, near = (np.einsum("nk,nkd->nd", share, values[picks]) for values in (actuators, command))
    approach = generator.choice([-1.0, 1.0], size=(len(picks), 1))
    poses = robot.solve(drive, near)
    closed = np.flatnonzero(poses.closed)
    drive, approach = drive[closed], approach[closed]
    position = robot.measured(poses.of(closed), robot.twists())
    motion = at_rest(robot, masses, (position, drive, *at_end(case)), approach, drive)
    readings = None if case.readings is None else case.readings.of(picks[closed, 0])
    diagnosed, written = (
        robot.twists(inference.state.deviations) + effect_twists(inference, motion),
        model.twists(motion),
    )
    seen = robot.measured(robot.solve(drive, position, diagnosed), diagnosed, readings)
    poses = model.robot.solve(drive, position, written)
    return seen - model.robot.measured(poses, written + model.instrument, readings)
