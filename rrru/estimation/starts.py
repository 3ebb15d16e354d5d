"""Starting values: the frame and the targets in closed form, then a robot's stages, then everything at once.

A search that starts far from the truth ends in another minimum or does not converge. Where the nominal robot predicts
the readings well no start is needed. Where it does not, `rrru.campaign.target_registration` finds the instrument's
frame and the targets' places for any rotation. The readings are then expressed in the robot's frame: deviations stay
small there, and their priors and bounds keep their meaning. Lost zero offsets of drives are found by the robot's
`stages`. Lengths in mm, angles in rad.
"""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.spatial.transform import Rotation

from rrru.arrays import FloatArray, IntArray
from rrru.campaign import measurements as rows
from rrru.campaign.target_registration import TargetReadings, TargetRegistration, register_targets
from rrru.errors import FitError
from rrru.estimation.estimate import Estimate
from rrru.estimation.parameters import Block, Parameters
from rrru.estimation.problem import Observations, Problem
from rrru.estimation.solver import solve
from rrru.kinematics.base_parameters import open_numbers
from rrru.kinematics.chain import Poses
from rrru.kinematics.legs import TOOL, WORLD
from rrru.kinematics.readings import Readings, place_on_platform, reading_residual
from rrru.kinematics.robot import Robot

# a median residual above this share of the robot's size is not due to errors of its geometry
FAR_SHARE_OF_SIZE = 2e-3
# a median residual above this share of the robot's size means another frame: no search converges from there
LOST_SHARE_OF_SIZE = 0.05
# an instrument's own frame is off by metres, of which a registration leaves thousandths; lost zero offsets of drives,
# which `rrru.campaign.ingest.zero_offsets` finds with the frame, leave more than this share
_MAX_SHARE_AFTER = 0.02
# scale of the robust loss: residual beyond which a reading counts less, while zero offsets of drives are far off
_LOSS_SCALE_MM = 5.0
_MIN_READINGS = 3


def register_poses(
    robot: Robot, poses: Poses, twists: FloatArray, readings: Readings, mirrored: bool = False
) -> TargetRegistration:
    """The TargetRegistration of Readings at Poses under twists (1, sites, 6) of a robot.

    Places of targets in the robot's `measurement_config.fitted` are unknown; the twists give the others. mirrored: the
    instrument has a left-handed frame. Raises FitError for fewer than three readings at known poses.
    """
    _, number, place = _targets(robot, twists, readings)
    centre, turn = poses.position_mm, poses.turn
    if readings.on_world is not None:
        centre = np.where(readings.on_world[:, None], 0.0, centre)
        turn = np.where(readings.on_world[:, None, None], np.eye(3), turn)
    known = np.isfinite(centre).all(axis=1) & np.isfinite(readings.position_mm).all(axis=1)
    if known.sum() < _MIN_READINGS:
        raise FitError(f"{known.sum()} readings at poses that the robot can take; allowed: at least {_MIN_READINGS}")
    orientations = None if readings.turn is None else readings.turn[known]
    characteristic_length_mm = readings.characteristic_length_mm
    if not np.isfinite(characteristic_length_mm):
        characteristic_length_mm = robot.characteristic_length_mm
    found = TargetReadings(
        centre[known],
        turn[known],
        readings.position_mm[known],
        number[known],
        place,
        np.asarray(robot.tool_mm),
        orientations,
        characteristic_length_mm,
    )
    return register_targets(found, mirrored)


def _targets(robot: Robot, twists: FloatArray, readings: Readings) -> tuple[list[str], IntArray, FloatArray]:
    """Names (k) of the targets, number (n,) of each reading's, and places (k, 3), NaN where unknown."""
    count = len(readings)
    place = np.broadcast_to(place_on_platform(robot, twists, readings), (count, 3))
    if readings.reflectors is None:
        return [""], np.zeros(count, dtype=int), np.array(place[:1])
    names, first, number = np.unique(readings.reflectors.astype(str), return_index=True, return_inverse=True)
    unknown = np.isin(names, robot.measurement_config.fitted)
    return names.tolist(), number, np.where(unknown[:, None], np.nan, place[first])


def frame_values(robot: Robot, poses: Poses, twists: FloatArray, readings: Readings) -> dict[str, float]:
    """Changes of twists (1, sites, 6) that make readings fit, by name of the robot's open numbers.

    The exact registration of Readings at Poses, in the names of `rrru.kinematics.base_parameters.open_numbers`. Raises
    FitError where the readings do not determine it.
    """
    found, numbers = register_poses(robot, poses, twists, readings), robot.legs.site_numbers
    moved = np.array(twists[:1], dtype=float)
    moved[0, numbers[WORLD]] = found.frame
    if {TOOL} & {site for one in open_numbers(robot.measurement_config) for site in one.twists}:
        moved[0, numbers[TOOL], 3:] = Rotation.from_matrix(found.tool_turn).as_rotvec()
    for name in robot.measurement_config.fitted:
        moved[0, numbers[name], :3] = 0.0
    if robot.measurement_config.fitted:
        names, number, _ = _targets(robot, moved, readings)
        nominal = place_on_platform(robot, moved, readings)
        for name in robot.measurement_config.fitted:
            k = names.index(name)
            moved[0, numbers[name], :3] = found.place_mm[k] - nominal[int(np.argmax(number == k))]
    change = moved[0] - twists[0]
    return {
        candidate.name: float(sum(twist @ change[numbers[site]] for site, twist in candidate.twists.items()))
        for candidate in open_numbers(robot.measurement_config)
    }


def register_measurements(measurements: pd.DataFrame, robot: Robot) -> pd.DataFrame:
    """A measurement table in the frame of a nominal robot, unchanged where it is near or where that frame is known.

    Where the robot's `measurement_config` leaves the frame open and its prediction is far off, measured positions and
    orientations are turned and shifted into the robot's frame, and unknown places of targets are replaced by those
    found. Raises FitError where they fit in a left-handed frame alone.
    """
    used, config = rows.usable(measurements), robot.measurement_config
    if not config.frame or used.sum() < _MIN_READINGS:
        return measurements
    actuators, command = rows.actuators(measurements, robot), rows.command(measurements)
    poses, twists = robot.solve(actuators, command), robot.twists()
    readings = rows.readings(measurements, robot.characteristic_length_mm) or Readings(rows.measured(measurements))
    off = np.linalg.norm(reading_residual(robot, replace(readings, turn=None), poses, twists)[used], axis=1)
    off = off[np.isfinite(off)]
    if not len(off) or np.median(off) <= LOST_SHARE_OF_SIZE * robot.size_mm:
        return measurements
    used_readings = robot, poses.of(used), twists, readings.of(used)
    max_median_mm = max(FAR_SHARE_OF_SIZE * robot.size_mm, _MAX_SHARE_AFTER * float(np.median(off)))
    try:
        found = register_poses(*used_readings)
    except FitError:
        return measurements
    if found.median_mm <= max_median_mm:
        return _moved(measurements, robot, readings, found)
    if (mirrored_mm := register_poses(*used_readings, mirrored=True).median_mm) <= max_median_mm:
        raise FitError(
            f"measured positions are {found.median_mm:.3g} mm off in a right-handed frame, {mirrored_mm:.3g} mm in a "
            "left-handed one (medians); allowed: a right-handed frame: change the sign of one measured axis"
        )
    return measurements


def _moved(measurements: pd.DataFrame, robot: Robot, readings: Readings, found: TargetRegistration) -> pd.DataFrame:
    """The table in the frame of a TargetRegistration."""
    table = measurements.assign(**rows.vector_columns("measured", found.apply(rows.measured(measurements))))
    if readings.turn is not None:
        turns = found.rotation @ readings.turn @ found.tool_turn.T
        table = table.assign(**rows.turn_columns("measured", turns))
    if readings.reflectors is not None:
        names, number, _ = _targets(robot, robot.twists(), readings)
        free = np.isin(np.array(names)[number], robot.measurement_config.fitted)
        place = np.where(free[:, None], found.place_mm[number], rows.vectors(measurements, "target"))
        table = table.assign(**rows.vector_columns("target", place))
    return table


class RobotReadings(Observations, Protocol):
    """Observations whose parameters are the deviations (p,) of a robot, such as
    `rrru.estimation.observations.target_positions.TargetPositions`.
    """

    @property
    def mechanism(self) -> Robot:
        """The robot."""


def starting_values(residuals: RobotReadings) -> tuple[FloatArray, int]:
    """Deviations (p,) to start from, and how many evaluations it took to find them.

    residuals: of readings in the robot's frame. The nominal ones where the nominal robot is near; else the robot's
    `stages` one after the other, such as frames and then with these the drives, robustly. A search over all parameters
    at once would move poorly determined combinations of parameters to fit second-order terms of large rotations.
    """
    robot, evaluations = residuals.mechanism, 0
    found = np.asarray(robot.parameters.nominal)
    off = np.linalg.norm(residuals.residual(found), axis=1)
    if not robot.stages or not np.median(off) > FAR_SHARE_OF_SIZE * robot.size_mm:
        return found, 0
    for stage in robot.stages:
        if stage.any():
            estimate = solve_along(residuals, found, stage)
            found = found + np.where(stage, _spread(estimate.values, stage), 0.0)
            evaluations += estimate.end.evaluations
    return found, evaluations


@dataclass(frozen=True, eq=False)
class _StageReadings:
    """Observations whose parameters are changes of some deviations (p,) from an origin."""

    residuals: RobotReadings
    origin: FloatArray
    stage: npt.NDArray[np.bool_]

    def residual(self, values: FloatArray, /) -> FloatArray:
        """Readings minus prediction (n, 3)."""
        return np.asarray(self.residuals.residual(self.origin + _spread(values, self.stage)))

    def jacobian(self, values: FloatArray, /) -> FloatArray:
        """Its derivative (n, 3, k)."""
        return np.asarray(self.residuals.jacobian(self.origin + _spread(values, self.stage)))[..., self.stage]


def solve_along(residuals: RobotReadings, origin: FloatArray, stage: npt.NDArray[np.bool_]) -> Estimate:
    """The robust Estimate of changes (k,) of the deviations of a stage (p,) from an origin (p,)."""
    parameters = [one for one, chosen in zip(residuals.mechanism.parameters, stage, strict=True) if chosen]
    sd = np.array([(one.high - one.low) / np.sqrt(12.0) for one in parameters])
    block = Block.of("stage", [one.name for one in parameters], [one.unit for one in parameters], sd)
    problem = Problem(
        _StageReadings(residuals, origin, stage), Parameters((block,)), loss="soft_l1", loss_scale=_LOSS_SCALE_MM
    )
    return solve(problem)


def _spread(values: FloatArray, stage: npt.NDArray[np.bool_]) -> FloatArray:
    """Values (k,) at the places of a stage (p,), zeros elsewhere."""
    result = np.zeros(len(stage))
    result[stage] = values
    return result
