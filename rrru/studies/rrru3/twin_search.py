"""A candidate for the twin, simulated over many draws at once, and the objective of its search.

Searched: the 7 identifiable geometry errors, clearance and backlash per leg, a periodic drive error (amplitude and
phase per leg, whole number of periods per turn), non-repeatability, the line groups' spacing and the spiral's shape.
No number of the paper enters the simulation. All candidates have the same draws of non-repeatability and noise (common
random numbers), so that the objective is smooth; see `twin_objective`. For speed the search solves eq. (8) with
clearance to first order, which agrees with the spatial closure to micrometres for ideal axes. It calibrates on a
linearised model, which is accurate to hundredths of a millimetre where it was calibrated. The result is then run and
calibrated like every other campaign. Lengths in mm, angles in rad.
"""

import dataclasses
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from rrru.campaign.plan import Plan, make_run
from rrru.effects.protocol import Motion, together
from rrru.errors import ConfigError, FitError, UnreachableError
from rrru.kinematics import singularity
from rrru.kinematics.dynamics import PER_NEWTON, carried_kg, gravity
from rrru.kinematics.legs import rigid_motions
from rrru.robots.rrru3 import Rrru3
from rrru.simulation.driven import non_repeatability
from rrru.simulation.virtual_robot import VirtualRobot
from rrru.studies.rrru3 import study_numbers as numbers
from rrru.studies.rrru3.linear_fit import linear_fit
from rrru.studies.rrru3.twin import SPIKE_POINTS, Twin, search_bounds
from rrru.studies.rrru3.twin_objective import misfit

# least singularity measure on the spiral
SPIRAL_MARGIN = 0.1
# ASSUME the paper does not say which lines Table 5 was fitted on: "group_1" (26 points) or "lines" (all seven groups)
LINE_CALIBRATIONS = ("group_1", "lines")
WORST = 1e6
NOT_DRIVEN = (UnreachableError, FitError, np.linalg.LinAlgError)
# of the random streams of a campaign that is measured, calibrated and driven again
_LABELS = ("measure", "closed_loop")
_line_run = cache(make_run)


class TranslationalRobot(VirtualRobot):
    """The same robot solved on eq. (8): only for ideal axes, where the platform does not rotate.

    Only for effects that need no load except the members' forces.
    """

    def motion(self, plan, controller):
        """The Motion, of whose rates and loads only `force_n` is known."""
        course, mechanism = self.course(plan, controller), self.mechanism
        carried = carried_kg(mechanism, self.masses, course.payload_kg)[:, None]
        load = carried * (gravity(mechanism) - course.acceleration_mm_s2) / PER_NEWTON
        along = singularity.leg_forces(mechanism, course.position_mm, mechanism.inverse(course.position_mm))
        forces = -np.linalg.solve(along.transpose(0, 2, 1), load[..., None])[..., 0]
        unknown = np.full_like(forces, np.nan)
        given = {name: getattr(course, name) for name in ("position_mm", "drive", "path_drive", "path_index", "time_s")}
        fields = {one.name: unknown for one in dataclasses.fields(Motion)} | given
        return Motion(**fields | {"robot": mechanism, "force_n": forces, "held_force_n": forces, "approach": unknown})

    def positions(self, motion, target):
        """Platform centres (n, 3); clearance to first order."""
        change = together(self.effects, motion)
        named = {name: value for name, value in self.deviations.items() if name != "dr"}
        deviations = self.mechanism.parameters.vector(named | {"da": self.deviations["dr"]})
        solved = self.mechanism.forward(motion.drive + self.mechanism.drive_errors(change.twists), deviations, target)
        sites = [self.mechanism.legs.site_numbers[site] for (site,) in self.mechanism.parts.members]
        along = singularity.leg_forces(self.mechanism, target, self.mechanism.inverse(target))
        return solved + np.linalg.solve(along, change.twists[:, sites, 0, None])[..., 0], np.zeros(len(target))


@dataclass(frozen=True)
class Task:
    """The campaign and the calibration of every candidate.

    motion, trajectories: sections of the configuration; draws: see `draw`; line_calibration: one of LINE_CALIBRATIONS;
    of_model: the errors after a calibration are those of the measured points against the calibrated model, not of a
    robot that is driven again; registered: the tracker's frame is fitted to the commanded points; more: additional
    effects that are searched, or "spikes", see `twin.search_bounds`; spikes: whether the orders of Fig. 9's spikes
    count; weights: see `twin_objective.misfit`. Raises ConfigError for another line calibration.
    """

    mechanism: Rrru3
    motion: dict
    trajectories: dict
    noise_mm: float
    draws: tuple
    line_calibration: str = "group_1"
    of_model: bool = False
    registered: bool = False
    more: tuple = ()
    spikes: bool = False
    weights: dict | None = None

    def __post_init__(self):
        if self.line_calibration not in LINE_CALIBRATIONS:
            allowed = ", ".join(LINE_CALIBRATIONS)
            raise ConfigError(f"twin: line calibration is {self.line_calibration!r}; allowed: {allowed}")

    @property
    def bounds(self):
        """Bounds (low, high) of the searched numbers by name."""
        return search_bounds(self.more)

    @property
    def kind(self):
        """The fastest robot that has the searched effects."""
        return VirtualRobot if set(self.more) - {"spikes"} else TranslationalRobot

    def plan(self, twin):
        """Plan of a candidate: seven lines and the spiral, each once."""
        *lines, spiral = twin.trajectories(self.trajectories)
        speed, acceleration = self.motion["speed_mm_s"], self.motion["acceleration_mm_s2"]
        # the first line is the same for every candidate; the other groups are shifted copies
        first, runs = _line_run(lines[0], speed, acceleration), []
        for line in lines:
            shift = np.subtract(line.start_mm, lines[0].start_mm)
            moved = {"points_mm": first.points_mm + shift, "path_mm": first.path_mm + shift}
            runs.append(replace(first, trajectory=line.name, **moved))
        return Plan((*runs, make_run(spiral, speed, acceleration)), self.motion["dwell_s"])


def make_task(campaign, virtual, count, line_calibration, more=()):
    """The Task of a virtual campaign and its section, over a number of draws that `redraws` does not use."""
    numbered = [[campaign.generator("twin", k, name) for name in _LABELS] for k in range(count)]
    return Task(
        campaign.robot.mechanism,
        virtual["motion"],
        virtual["trajectories"],
        campaign.noise_mm,
        draw(numbered, len(campaign.plan.targets())),
        line_calibration,
        more=more,
        spikes="spikes" in more,
    )


def redrawn(campaign, count):
    """The first draws of `redraws`, as for a Task: see `draw`."""
    numbered = [[campaign.drawn(name, k) for name in _LABELS] for k in range(count)]
    return draw(numbered, len(campaign.plan.targets()))


def draw(generators, count):
    """Unit non-repeatability and unit noise of draws, two arrays (d, 2, count, 3), in the order a robot draws them.

    generators: (measuring, driving corrected commands) of each draw.
    """
    drawn = [[(non_repeatability(g, count), g.standard_normal((count, 3))) for g in pair] for pair in generators]
    return tuple(np.moveaxis(np.array(drawn), 2, 0))


def simulate(task, twin, kind=None):
    """Numbers and order margins (d,) of a candidate by name: calibrate on lines and spiral, drive again, compare.

    kind: the robot's class, by default the task's. Raises UnreachableError or FitError where the candidate cannot be
    driven or calibrated.
    """
    mechanism, plan = task.mechanism, task.plan(twin)
    target = plan.targets()
    theta = mechanism.require_reachable(target)
    trajectory = np.concatenate([np.full(len(run.points_mm), run.trajectory) for run in plan.runs])
    curve = trajectory == "spiral"
    _require_clear(mechanism, target[curve], theta[curve])
    robot = twin.robot(mechanism, kind or task.kind)
    motion = robot.motion(plan, mechanism.inverse)
    measuring, again = np.moveaxis(robot.non_repeatability_mm * task.draws[0] + task.noise_mm * task.draws[1], 1, 0)
    first, frame = _spiked(motion, trajectory, twin), 0.0
    measured = robot.positions(first, target)[0] + measuring
    if not np.isfinite(measured).all():
        raise UnreachableError("the candidate leaves its workspace")
    if task.registered:
        frame = _rigid_part(target, measured - target)
        measured = measured - frame
    calibrated = trajectory == "line_1" if task.line_calibration == "group_1" else ~curve
    fits = [linear_fit(mechanism, theta[rows], measured[:, rows], target[rows]) for rows in (calibrated, curve)]
    if task.of_model:
        lines, spiral = (measured - _modelled(mechanism, theta, target, deviations) for deviations, _ in fits)
    else:
        shift = again - target - frame
        path = plan.path()
        lines, spiral = (_corrected(robot, target, path, motion, deviations) + shift for deviations, _ in fits)
    errors = measured - target, lines, spiral
    if not all(np.isfinite(errors_mm).all() for errors_mm in errors):
        raise UnreachableError("the candidate leaves its workspace")
    names = [mechanism.parameters.names.index(name) for name in numbers.LINKS]
    orders = numbers.group_orders(trajectory, *errors) | numbers.link_order(*(fit[:, names] for fit, _ in fits))
    if task.spikes:
        each = [numbers.spike_orders(trajectory, *pair) for pair in zip(*errors[:2], strict=True)]
        orders |= {name: np.array([margins[name] for margins in each]) for name in each[0]}
    return numbers.study_numbers(trajectory, *errors) | {"lines_objective": fits[0][1]}, orders


def _spiked(motion, trajectory, twin):
    """The motion with the twin's errors of single commands of group 1."""
    rows = np.flatnonzero(trajectory == "line_1")
    drive = motion.drive.copy()
    for name, point in SPIKE_POINTS.items():
        drive[rows[point - 1], 0] += twin.values.get(name, 0.0)
    return replace(motion, drive=drive)


def _rigid_part(target, errors):
    """The part of errors (d, n, 3) at targets (n, 3) that a registration removes: shift and small turn, (d, n, 3)."""
    basis = np.linalg.qr(rigid_motions(target - target.mean(axis=0)).reshape(-1, 6)).Q
    return (errors.reshape(len(errors), -1) @ basis @ basis.T).reshape(errors.shape)


def _modelled(mechanism, theta, target, deviations):
    """Positions (d, n, 3) of the model with deviations (d, p) at nominal commands, to first order about their mean."""
    mean = deviations.mean(axis=0)
    position = mechanism.forward(theta, mean, target)
    jacobian = mechanism.parameter_jacobian(position, theta, mean)
    return position + np.einsum("nap,dp->dna", jacobian, deviations - mean)


def _corrected(robot, target, path, motion, deviations):
    """Positions (d, n, 3) attained with commands corrected by deviations (d, p), without random errors.

    Exact for the mean deviations of the draws, to first order about it. path: see `Plan.path`; motion: of the nominal
    commands, whose loads are the same.
    """
    mechanism, mean = robot.mechanism, deviations.mean(axis=0)
    path, index = path
    drive = mechanism.inverse(path, mean)
    attained, _ = robot.positions(replace(motion, drive=drive[index], path_drive=drive), target)
    jacobian = mechanism.parameter_jacobian(target, drive[index], mean)
    return attained - np.einsum("nap,dp->dna", jacobian, deviations - mean)


def _require_clear(mechanism, position, theta):
    """Raise UnreachableError for a spiral near a singularity."""
    measures = (singularity.translational_measure, singularity.constraint_measure)
    margin = min(measure(mechanism, position, theta).min() for measure in measures)
    if margin < SPIRAL_MARGIN:
        raise UnreachableError(f"the spiral comes within {margin:.3f} of a singularity; allowed: {SPIRAL_MARGIN}")


def cost(values, task):
    """Misfit in nat of searched values, in the order of the task's bounds; a large number where it cannot be driven."""
    twin = Twin(dict(zip(task.bounds, np.asarray(values).tolist(), strict=True)))
    try:
        value = misfit(*simulate(task, twin), task.weights)
    except NOT_DRIVEN:
        return WORST
    return value if np.isfinite(value) else WORST
