"""Make the problem of a campaign: its motion, the used points, the effects that they can test and at which of them.

Lengths in mm, angles in rad.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd

from rrru.arrays import BoolArray, FloatArray, IntArray
from rrru.campaign import measurements as rows
from rrru.campaign.driven_path import (
    DEGREE,
    drive_rates,
    driven_path,
    passes_points,
    path_through,
    smooth_drives,
    starts_of_runs,
    stops,
)
from rrru.campaign.stated_motion import stated_motion
from rrru.diagnosis.approach_direction import at_reversals, paths_between_stops, rest_widths, undetermined_senses
from rrru.diagnosis.discrepancy_basis import TestedEffect, unknown_functions
from rrru.diagnosis.drive_spectra import resolved
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.payload_nuisance import nuisance_priors
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.effects.motion import Course, make_motion
from rrru.effects.protocol import LOADS, PATH, Effect, Motion, complete_rows, known_values
from rrru.errors import FitError
from rrru.estimation.starts import register_measurements
from rrru.kinematics.dynamics import Masses, carried_kg
from rrru.kinematics.robot import Robot

# why an effect that bears load is not tested where nothing loads it
UNLOADED = "needs a load of the parts that deflect, and neither a stated mass nor payload_kg gives one"
# which points are used, in words
_USABLE = "allowed: measured points within reach that are no outliers"


def make_diagnosis_problem(
    measurements: pd.DataFrame,
    mechanism: Robot,
    masses: Masses,
    noise_mm: float,
    library: Mapping[str, Effect],
    use_near_singularity: bool = True,
    characteristic_length_mm: float = np.nan,
) -> DiagnosisProblem:
    """The DiagnosisProblem of a measurement table.

    Every point is used that was measured, is no outlier and can be reached. Effects whose needs the motion meets
    nowhere are set aside with the reason; `DiagnosisProblem.known` has the points at which the others have all that
    they need. Raises FitError for an empty table.
    """
    if not len(measurements):
        raise FitError("the campaign has no points; allowed: at least one row: check the file of measurements")
    measurements = register_measurements(measurements, mechanism)
    actuators, command = rows.actuators(measurements, mechanism), rows.command(measurements)
    stop, (course, unknown) = stops(measurements), _course(measurements, mechanism, actuators)
    motion_at = partial(make_motion, mechanism, masses, replace(course, approach=np.where(unknown, 0.0, np.nan)))
    motion = motion_at()
    used = rows.usable(measurements, use_near_singularity) & np.isfinite(motion.position_mm).all(axis=1)
    used &= np.isfinite(mechanism.forward(actuators, guess_mm=command)).all(axis=1)
    if not used.any():
        raise FitError(f"the campaign has no point that a diagnosis can use; {_USABLE}: check the column status")
    testable, untestable = _tested(library, motion, used, _count_numbers(measurements, used, stop))
    rows_of = {name: complete_rows(effect, motion) for name, effect in testable.items()}
    compared = np.all([used, *rows_of.values()], axis=0)
    for name, function in unknown_functions(mechanism).items():
        complete = complete_rows(function, motion)
        # no function costs the effects a reading
        if not _lacking(function, motion, used) and complete[compared].all():
            testable[name], rows_of[name] = function, complete
    known = {name: rows for name, rows in rows_of.items() if not rows[used].all()}
    nuisance_sd, bounds = nuisance_priors(motion, masses)
    return DiagnosisProblem(
        mechanism,
        measurements,
        motion,
        used,
        testable,
        untestable,
        float(noise_mm),
        float(characteristic_length_mm),
        motion_at=motion_at,
        nuisance_sd=nuisance_sd,
        bounds=bounds,
        known=known,
        massless=_lacks_masses(mechanism, masses),
    )


def _lacks_masses(mechanism: Robot, masses: Masses) -> bool:
    """Whether no mass of a robot is stated whose links have masses of their own."""
    own = getattr(mechanism, "point_masses", None)
    return own is not None and not own and not carried_kg(mechanism, masses, np.zeros(1)).any()


def _tested(
    library: Mapping[str, Effect], motion: Motion, used: BoolArray, count: int
) -> tuple[dict[str, TestedEffect], dict[str, str]]:
    """Effects that the used points can test, and others with the reason.

    count: how many numbers the used points give about the robot.
    """
    testable: dict[str, TestedEffect] = {}
    untestable: dict[str, str] = {}
    for name, effect in library.items():
        if _fitted(effect, motion):
            untestable[name] = "the calibration's own parameters absorb it"
            continue
        lacking = _lacking(effect, motion, used)
        if lacking:
            untestable[name] = lacking
        else:
            testable[name] = resolved(effect, motion)
    return testable, untestable


def _lacking(effect: TestedEffect, motion: Motion, used: BoolArray) -> str:
    """Why the used points do not determine what an effect needs, empty where they do."""
    values = {need: getattr(motion, need)[used] for need in effect.needs if need != PATH}
    known = {need: value[known_values(value)].reshape(-1, value[0].size) for need, value in values.items()}
    none = [name for name, value in known.items() if not len(value)]
    if none:
        return f"needs {', '.join(none)}, which the columns do not give"
    alike = [name for name, value in known.items() if not np.ptp(value, axis=0).any()]
    if "drive_rate" in alike and not known["drive_rate"].any():
        return "needs drive_rate, which is zero: the robot rests at every point"
    if any(name in LOADS and not known[name].any() for name in alike):
        return UNLOADED
    if alike:
        return f"needs {', '.join(alike)} of more than one value"
    return "" if complete_rows(effect, motion)[used].any() else no_approach(used)


def no_approach(used: BoolArray) -> str:
    """Why an effect that depends on the sense in which the drives arrive is not tested at used points (n,)."""
    return f"the sense in which the drives arrive is known at none of {int(used.sum())} points"


def _count_numbers(measurements: pd.DataFrame, used: BoolArray, stop: IntArray) -> int:
    """How many numbers the used points give about the robot: at each stop at most the six of the platform's pose."""
    turned = np.zeros(len(used), dtype=bool)
    if rows.has_turns(measurements):
        turned = measurements["measured_rx_rad"].notna().to_numpy()
    on_world = rows.on_the_world(measurements)
    on_robot = used if on_world is None else used & ~on_world
    return int(np.minimum(np.bincount(stop, on_robot * (3.0 + 3.0 * turned)), 6.0).sum())


def _fitted(effect: Effect, motion: Motion) -> bool:
    """Whether an effect changes only constants from which the calibration chooses its parameters."""
    coordinates = effect.coordinates
    values = coordinates.to_values(np.array(coordinates.typical), coordinates.shapes[0])
    twists = np.asarray(effect.contribute(motion, values).twists)
    return (
        twists.ndim == 3
        and len(twists) == 1
        and not (twists[0].astype(bool) & ~motion.robot.candidate_components).any()
    )


def _unknown_approach(measurements: pd.DataFrame, mechanism: Robot, course: Course) -> BoolArray:
    """Where (n, K) the rows do not determine from which side a drive comes: starts of runs, and next to reversals."""
    run, stop = measurements["run"].to_numpy(), stops(measurements)
    # no column says how the robot got to a run's start
    starts = np.isin(stop, stop[starts_of_runs(run)])
    result = np.repeat(starts[:, None], course.drive.shape[1], axis=1)
    if course.stops:
        return result
    finer = path_through(measurements, OPTIONS.finer_spline_degree)
    other = _path_drive(measurements, finer, (mechanism, course.drive, course.path_index), OPTIONS.finer_spline_degree)
    first = np.diff(stop, prepend=-1) > 0
    return result | at_reversals(course, other, rest_widths(course.drive[first], run[first], mechanism.parts.units))


def _course(measurements: pd.DataFrame, mechanism: Robot, actuators: FloatArray) -> tuple[Course, BoolArray]:
    """The commanded Course, and where (n, K) it is not determined from which side a drive comes.

    At the measured points it has the table's own actuator values.
    """
    path, motion = driven_path(measurements)
    rates = drive_rates(measurements, actuators) if mechanism.orients else None
    stated = stated_motion(measurements)
    if stated is not None and stated.stops:
        course = Course(drive=actuators, path_drive=actuators, stops=True, drive_motion=rates, **motion)
        return _stopping(measurements, mechanism, course, stated.between)
    at_rest = not passes_points(measurements)
    path_drive = _path_drive(measurements, path, (mechanism, actuators, motion["path_index"]))
    course = Course(drive=actuators, path_drive=path_drive, stops=at_rest, drive_motion=rates, **motion)
    return course, _unknown_approach(measurements, mechanism, course)


def _stopping(
    measurements: pd.DataFrame, mechanism: Robot, course: Course, between: str | None
) -> tuple[Course, BoolArray]:
    """`_course` of a campaign that states that the robot rests at each reading: all rows of a stop have its senses.

    between: of its `rrru.campaign.stated_motion.StatedMotion`.
    """
    stop, run = stops(measurements), measurements["run"].to_numpy()
    first = np.diff(stop, prepend=-1) > 0
    drive, run = course.drive[first], run[first]
    paths, index = paths_between_stops(mechanism, drive, course.position_mm[first], between)
    unknown = undetermined_senses(paths, index, run, rest_widths(drive, run, mechanism.parts.units))
    return replace(course, path_drive=paths[0], path_index=index[stop]), unknown[stop]


def _path_drive(
    measurements: pd.DataFrame, path: FloatArray, drives: tuple[Robot, FloatArray, IntArray], degree: int = DEGREE
) -> FloatArray:
    """Actuator values (N, K) along a path (N, 3) by splines of an odd degree through the points of each run.

    Straight between stops in no order.

    drives: the robot, its actuator values (n, K) at the measured points, and the rows (n,) of these on the path.
    """
    mechanism, actuators, index = drives
    if mechanism.orients or not passes_points(measurements):
        # positions do not determine the orientation between the points, nor the path between stops
        evenly = np.stack([np.interp(np.arange(len(path)), index, one) for one in actuators.T], axis=1)
        result = smooth_drives(measurements, evenly, index, degree)
    else:
        result = mechanism.inverse(path)
    lost = ~np.isfinite(result).all(axis=1)
    if lost.any():
        # what is out of reach stays where it was last
        good = np.flatnonzero(~lost)
        result = result[good[np.maximum(np.searchsorted(good, np.arange(len(lost)), side="right") - 1, 0)]]
    result[index] = actuators
    return np.asarray(result)
