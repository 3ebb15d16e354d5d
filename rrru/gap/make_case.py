"""Making the case of a campaign: its motion, which points can be used, which effects they can test.

Lengths in mm, angles in rad.
"""

from functools import partial

import numpy as np

from rrru.campaign import measurements as rows
from rrru.campaign.driven_path import (
    DEGREE,
    STEPS,
    drive_rates,
    driven_path,
    follows_path,
    smooth_drives,
    starts_of_runs,
    stops,
)
from rrru.effects.motion import Course, make_motion
from rrru.errors import FitError
from rrru.estimation.starts import register_measurements
from rrru.gap.case import Case
from rrru.gap.unknown import unknown_functions
from rrru.gap.weight import doubts_of

# an effect is tested where at least this share of the points has what it needs
_ENOUGH = 0.8
# more coordinates than this share of the numbers read tell nothing
_MOST_BROAD = 0.5
# nearer than this to a reversal of a drive the interpolated path may be on the wrong side of it
_STANDS = {"rad": 1e-8, "mm": 1e-6}
# of the splines of a finer interpolation: as far as the two are apart is as far as the coarser one may be off
_FINER_DEGREE = 7
_NEAR_REVERSAL = {"rad": 3e-4, "mm": 0.1}


def make_case(measurements, mechanism, masses, noise_mm, library, use_near_singularity=True, arm_mm=np.nan):
    """The case of a measurement table.

    Effects whose needs the motion meets at too few points are set aside with the reason; the few points that lack what
    a tested effect needs are left out. Raises FitError for an empty table.
    """
    if not len(measurements):
        raise FitError("the campaign has no points")
    measurements = register_measurements(measurements, mechanism)
    actuators, command = rows.actuators(measurements, mechanism), rows.command(measurements)
    motion_at = partial(make_motion, mechanism, masses, _course(measurements, mechanism, actuators))
    motion = motion_at()
    used = rows.usable(measurements, use_near_singularity) & np.isfinite(motion.position_mm).all(axis=1)
    # what lies in the drives' play at a run's start depends on how the robot arrived, which no column tells
    stop = stops(measurements)
    used &= ~np.isin(stop, stop[starts_of_runs(measurements["run"].to_numpy())])
    if follows_path(motion.position_mm, measurements["run"].to_numpy()):
        finer, _ = driven_path(measurements, _FINER_DEGREE)
        drives = mechanism, actuators, motion.path_index
        used &= ~at_reversals(motion, _path_drive(measurements, finer, drives, _FINER_DEGREE))
    used &= np.isfinite(mechanism.forward(actuators, guess_mm=command)).all(axis=1)
    if not used.any():
        raise FitError("the campaign has no point that a diagnosis can use")
    testable, untestable, complete = _tested(library, motion, used, _told(measurements, used, stop))
    used &= complete
    for name, function in unknown_functions(mechanism).items():
        values = [getattr(motion, need)[used] for need in function.needs]
        if all(np.isfinite(value).all() and np.ptp(value) > 0.0 for value in values):
            testable[name] = function
    sizes = float(noise_mm), float(arm_mm)
    doubts, bounds = doubts_of(motion, masses)
    of_weight = {"doubts": doubts, "bounds": bounds}
    return Case(mechanism, measurements, motion, used, testable, untestable, *sizes, motion_at=motion_at, **of_weight)


def _tested(library, motion, used, told):
    """Effects that the used points can test, others with the reason, and where (n,) the tested ones are complete.

    told: how many numbers the used points tell of the robot.
    """
    testable, untestable, complete = {}, {}, np.ones(len(used), dtype=bool)
    for name, effect in library.items():
        if _fitted(effect, motion):
            untestable[name] = "the calibration's own parameters take it up"
            continue
        if effect.coordinates.broad and len(effect.coordinates) > _MOST_BROAD * told:
            untestable[name] = f"has {len(effect.coordinates)} numbers, too many for the {told} that were told"
            continue
        values = {need: getattr(motion, need).reshape(len(used), -1) for need in effect.needs}
        lacking = _lacking({need: value[used] for need, value in values.items()})
        if lacking:
            untestable[name] = lacking
        else:
            testable[name] = effect
            complete = np.all([complete, *(np.isfinite(value).all(axis=1) for value in values.values())], axis=0)
    return testable, untestable, complete


def _lacking(values):
    """Why values (n, k) by name do not tell what an effect needs, empty where they do."""
    known = {name: value[np.isfinite(value).all(axis=1)] for name, value in values.items()}
    few = [name for name, value in known.items() if len(value) < _ENOUGH * len(values[name])]
    if few:
        return f"needs {', '.join(few)}, which the columns do not give"
    alike = [name for name, value in known.items() if not np.ptp(value, axis=0).any()]
    return f"needs {', '.join(alike)} of more than one value" if alike else ""


def _told(measurements, used, stop):
    """How many numbers the used points tell of the robot: at each stop no more than the six of a platform's pose."""
    turned = np.zeros(len(used), dtype=bool)
    if rows.has_turns(measurements):
        turned = measurements["measured_rx_rad"].notna().to_numpy()
    beside = rows.on_the_world(measurements)
    own = used if beside is None else used & ~beside
    return int(np.minimum(np.bincount(stop, own * (3.0 + 3.0 * turned)), 6.0).sum())


def _fitted(effect, motion):
    """Whether an effect changes nothing but constant numbers that the calibration chooses its parameters from."""
    coordinates = effect.coordinates
    values = coordinates.to_values(np.array(coordinates.typical), coordinates.shapes[0])
    twists = np.asarray(effect.contribute(motion, values).twists)
    return twists.ndim == 3 and len(twists) == 1 and not (twists[0].astype(bool) & ~motion.robot.offered).any()


def at_reversals(motion, other_path):
    """Rows (n,) at which a drive reverses: on its way up or down there the commanded points alone do not tell.

    other_path: (N, K) actuator values along the path by another interpolation. As far as the two are apart between a
    point and its neighbours, neither tells where a drive reverses.
    """
    result = np.zeros(len(motion.drive), dtype=bool)
    stations = np.unique(motion.path_index)
    apart = np.maximum.reduceat(np.abs(motion.path_drive - other_path), stations)
    apart = np.maximum(apart, np.concatenate([np.zeros_like(apart[:1]), apart[:-1]]))
    apart = apart[np.searchsorted(stations, motion.path_index)]
    for leg, unit in enumerate(motion.robot.parts.units):
        for path in (motion.path_drive[:, leg], other_path[:, leg]):
            reversals = _reversals(path, _STANDS[unit])
            if len(reversals):
                nearest = reversals[np.abs(reversals[:, None] - motion.path_index).argmin(axis=0)]
                close = np.abs(nearest - motion.path_index) <= STEPS
                way = np.abs(path[nearest] - motion.drive[:, leg])
                result |= close & (way < _NEAR_REVERSAL[unit] + apart[:, leg])
    return result


def _reversals(path, stands):
    """Rows of a path (N,) of one drive at which it turns back; by less than `stands` it does not move."""
    step = np.diff(path)
    moving = np.flatnonzero(~(np.abs(step) < stands))
    return moving[1:][step[moving[:-1]] * step[moving[1:]] < 0.0]


def _course(measurements, mechanism, actuators):
    """What the robot was told to do; at the measured points with the table's own actuator values."""
    path, told = driven_path(measurements)
    if mechanism.orients:
        told["drive_motion"] = drive_rates(measurements, actuators)
    at_rest = not follows_path(told["position_mm"], measurements["run"].to_numpy())
    path_drive = _path_drive(measurements, path, (mechanism, actuators, told["path_index"]))
    return Course(drive=actuators, path_drive=path_drive, stops=at_rest, **told)


def _path_drive(measurements, path, drives, degree=DEGREE):
    """Actuator values (N, K) along a path (N, 3) by splines of an odd degree through the points of each run.

    drives: the robot, its actuator values (n, K) at the measured points, and the rows (n,) of these on the path.
    """
    mechanism, actuators, index = drives
    if mechanism.orients:
        # positions do not tell the orientation between the points
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
    return result
