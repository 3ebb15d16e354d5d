"""A candidate for the twin, simulated over many draws at once, and the objective of its search.

Searched: the 7 identifiable geometry errors, clearance and backlash per leg, a periodic drive error (amplitude and
phase per leg, whole number of periods per turn), non-repeatability, the line groups' spacing and the spiral's shape.
No number of the paper enters the simulation. All candidates have the same draws of non-repeatability and noise (common
random numbers), so that the objective is smooth; see `twin_objective`. For speed the search solves eq. (8), compiled,
with clearance to first order. For ideal axes this agrees with the spatial closure to hundredths of a millimetre, near
the lines' singular start, and to micrometres elsewhere. It calibrates on a model that is linearised where the
calibration ends: to thousandths of a millimetre where it was calibrated, and some tenths on the spiral after a
calibration on one line. The result is then run and calibrated like every other campaign.
Lengths in mm, angles in rad.
"""

from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from rrru.campaign import trajectories
from rrru.campaign.plan import Plan, make_run
from rrru.campaign.speed_profile import Trapezoid
from rrru.errors import ConfigError, FitError, UnreachableError
from rrru.kinematics.dynamics import gravity
from rrru.kinematics.legs import rigid_motions
from rrru.robots.rrru3 import Rrru3
from rrru.robots.rrru3_kernels import forward
from rrru.robots.three_legs import LEGS
from rrru.simulation.driven import non_repeatability
from rrru.studies.rrru3 import study_numbers as numbers
from rrru.studies.rrru3 import twin_kernels as kernels
from rrru.studies.rrru3 import twin_objective
from rrru.studies.rrru3.linear_fit import linear_fit
from rrru.studies.rrru3.paper import ERRORS_MM
from rrru.studies.rrru3.twin import SPIKE_POINTS, Twin, search_bounds, stated
from rrru.studies.rrru3.twin_objective import misfit

# points of the fast simulation's path, and steps of a spiral's length, from one sampled point to the next
PATH_STEPS, _ARC_STEPS = 4, 8
# least singularity measure on the spiral
SPIRAL_MARGIN = 0.1
# ASSUME the paper does not say which lines Table 5 was fitted on: "group_1" (26 points) or "lines" (all seven groups)
LINE_CALIBRATIONS = ("group_1", "lines")
WORST = 1e6
# of `group_orders` and `link_order`
_GROUP_ORDERS = 8
NOT_DRIVEN = (UnreachableError, FitError, np.linalg.LinAlgError)
# of the random streams of a campaign that is measured, calibrated and driven again
_LABELS = ("measure", "closed_loop")
_line_run = cache(make_run)


class Spatial:
    """A candidate's campaign on the spatial closure, for all effects."""

    def __init__(self, task, twin):
        self.plan, self.mechanism = task.plan(twin), task.mechanism
        self.target = self.plan.targets()
        self.theta = self.mechanism.require_reachable(self.target)
        self.robot = twin.robot(self.mechanism)
        self.motion = self.robot.motion(self.plan, self.mechanism.inverse)
        self.singularity = np.minimum(*self.mechanism.singularities(self.target, self.theta)[:2])

    def attained(self, deviations=None, spikes=0.0):
        """Positions (n, 3) without random errors, and the commands (n, 3) in rad.

        The commands are corrected by deviations (p,) and have errors `spikes` (n, 3). The loads are the nominal ones.
        """
        path, index = self.plan.path()
        along = self.mechanism.inverse(path, deviations)
        drive = along[index] + spikes
        return self.robot.positions(replace(self.motion, drive=drive, path_drive=along), self.target)[0], drive


class Translational:
    """The same on eq. (8), compiled: only for ideal axes, where the platform does not turn, and the searched effects.

    Clearance is of first order, and the path has a quarter of the points.
    """

    def __init__(self, task, twin):
        self.mechanism, self.values = task.mechanism, twin.values
        (self.path, self.index, self.smooth), acceleration = task.course(twin)
        self.target = self.path[self.index]
        self.along = kernels.inverse(self.path, *self._legs())
        self.theta = self.along[self.index]
        # per unit of mass: only the forces' signs matter
        load, clearance = gravity(self.mechanism) - acceleration, self._of_legs("clearance")
        self.shift, self.singularity = kernels.clearance_shift(self.target, self.theta, *self._legs(), load, clearance)
        section = twin.robot_section()
        named = {"da" if name == "dr" else name: value for name, value in section["errors"].items()}
        self.true_legs = self._legs(self.mechanism.parameters.vector(named))
        self.ratio = section["effects"]["transmission_error"]["ratio"]

    def attained(self, deviations=None, spikes=0.0):
        """See `Spatial.attained`."""
        along = self.along if deviations is None else kernels.inverse(self.path, *self._legs(deviations))
        drive = along[self.index] + spikes
        wave = self._of_legs("amplitude") * np.sin(self.ratio * drive + self._of_legs("phase"))
        driven = drive + kernels.backlash(along, self.smooth, self._of_legs("width"))[self.index] + wave
        (legs, turn), (cosine, sine) = self.true_legs, (np.cos(driven), np.sin(driven))
        solved = forward(legs[None], turn, *map(np.ascontiguousarray, (cosine.T, sine.T, self.target.T)))
        return solved[0].T + self.shift, drive

    def _legs(self, deviations=None):
        """Numbers of the legs and their azimuths' cosines and sines, as the kernels need them."""
        return self.mechanism.numbers(deviations), self.mechanism.azimuth_cos_sin

    def _of_legs(self, name):
        """Searched values (3,) of the legs."""
        return np.array([self.values[f"{name}{leg}"] for leg in LEGS])


@dataclass(frozen=True)
class Task:
    """The campaign and the calibration of every candidate.

    motion: section of the configuration; trajectories: see `twin.stated`; draws: see `draw`; line_calibration: one of
    LINE_CALIBRATIONS; of_model: the errors after a calibration are those of the measured points against the calibrated
    model, not of a robot that is driven again; registered: the tracker's frame is fitted to the commanded points; more:
    additional effects that are searched, or "spikes", see `twin.search_bounds`; spikes: whether the orders of Fig. 9's
    spikes count; weights: see `twin_objective.misfit`. Raises ConfigError for another line calibration.
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
        """The fastest simulation that has the searched effects."""
        return Spatial if set(self.more) - {"spikes"} else Translational

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

    @cached_property
    def trajectory(self):
        """Names (n,) of the trajectories of all points."""
        counts = {f"line_{group}": self.trajectories["lines"]["points"] for group in range(1, 8)}
        counts |= {"spiral": self.trajectories["spiral"]["points"]}
        return np.repeat(list(counts), list(counts.values()))

    def course(self, twin):
        """Path of a candidate as `lines_and_curve` has it, and accelerations (n, 3) in mm/s^2."""
        section, shape = self.trajectories, twin.trajectory_section()
        lines, count = section["lines"], section["spiral"]["points"]
        place, along = _spiral(shape["spiral"], count, self.motion["speed_mm_s"], self.motion["acceleration_mm_s2"])
        ends = (np.array(lines[end], dtype=float) for end in ("start_mm", "end_mm"))
        offsets, counts = np.array(shape["lines"]["offsets_y_mm"]), (lines["points"], count)
        path = kernels.lines_and_curve(*ends, offsets, counts, place, PATH_STEPS)
        return path, np.concatenate([np.tile(self._line_acceleration, (len(offsets), 1)), along])

    @cached_property
    def _line_acceleration(self):
        """Accelerations (n, 3) in mm/s^2 at the points of every line."""
        line = trajectories.from_config({"lines": self.trajectories["lines"] | {"offsets_y_mm": [0.0]}})[0]
        return _line_run(line, self.motion["speed_mm_s"], self.motion["acceleration_mm_s2"]).acceleration_mm_s2


def make_task(campaign, virtual, count, line_calibration, more=()):
    """The Task of a virtual campaign and its section, over a number of draws that `redraws` does not use."""
    numbered = [[campaign.generator("twin", k, name) for name in _LABELS] for k in range(count)]
    return Task(
        campaign.robot.mechanism,
        virtual["motion"],
        stated(virtual["trajectories"]),
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

    kind: Spatial or Translational, by default the task's. Raises UnreachableError or FitError where the candidate
    cannot be driven or calibrated.
    """
    driven, mechanism = (kind or task.kind)(task, twin), task.mechanism
    target, theta, trajectory = driven.target, driven.theta, task.trajectory
    curve = trajectory == "spiral"
    if not np.isfinite(theta).all():
        raise UnreachableError("a point cannot be reached")
    if not (margin := driven.singularity[curve].min()) >= SPIRAL_MARGIN:
        raise UnreachableError(f"the spiral comes within {margin:.3f} of a singularity; allowed: {SPIRAL_MARGIN}")
    random = twin.values["wobble_mm"] * task.draws[0] + task.noise_mm * task.draws[1]
    measuring, again = np.moveaxis(random, 1, 0)
    frame = 0.0
    measured = driven.attained(spikes=_spikes(trajectory, twin))[0] + measuring
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
        lines, spiral = (_corrected(driven, deviations) + (again - target - frame) for deviations, _ in fits)
    errors = measured - target, lines, spiral
    if not all(np.isfinite(errors_mm).all() for errors_mm in errors):
        raise UnreachableError("the candidate leaves its workspace")
    names = [mechanism.parameters.names.index(name) for name in numbers.LINKS]
    orders = numbers.group_orders(trajectory, *errors) | numbers.link_order(*(fit[:, names] for fit, _ in fits))
    if task.spikes:
        each = [numbers.spike_orders(trajectory, *pair) for pair in zip(*errors[:2], strict=True)]
        orders |= {name: np.array([margins[name] for margins in each]) for name in each[0]}
    return numbers.study_numbers(trajectory, *errors) | {"lines_objective": fits[0][1]}, orders


def _spikes(trajectory, twin):
    """Errors (n, 3) in rad of single commands of group 1."""
    errors = np.zeros((len(trajectory), 3))
    rows = np.flatnonzero(trajectory == "line_1")
    for name, point in SPIKE_POINTS.items():
        errors[rows[point - 1], 0] = twin.values.get(name, 0.0)
    return errors


def _rigid_part(target, errors):
    """The part of errors (d, n, 3) at targets (n, 3) that a registration removes: shift and small turn, (d, n, 3)."""
    basis = np.linalg.qr(rigid_motions(target - target.mean(axis=0)).reshape(-1, 6)).Q
    return (errors.reshape(len(errors), -1) @ basis @ basis.T).reshape(errors.shape)


def _modelled(mechanism, theta, target, deviations):
    """Positions (d, n, 3) of the model with deviations (d, p) at nominal commands, to first order about their mean."""
    mean = deviations.mean(axis=0)
    position = mechanism.forward(theta, mean, target)
    return position + _first_order(mechanism, position, theta, mean, deviations)


def _corrected(driven, deviations):
    """Positions (d, n, 3) attained with commands corrected by deviations (d, p), without random errors.

    Exact for the mean deviations of the draws, to first order about it.
    """
    mechanism, mean = driven.mechanism, deviations.mean(axis=0)
    attained, drive = driven.attained(mean)
    return attained - _first_order(mechanism, driven.target, drive, mean, deviations)


def _first_order(mechanism, position, theta, mean, deviations):
    """Changes (d, n, 3) of the model's positions from mean deviations (p,) to others (d, p)."""
    legs, turn = mechanism.numbers(mean), mechanism.azimuth_cos_sin
    jacobian = kernels.parameter_jacobian(position, theta, legs, turn, mechanism.leg_map)
    return ((deviations - mean) @ jacobian.reshape(-1, len(mean)).T).reshape(len(deviations), -1, 3)


def _spiral(shape, count, speed_mm_s, acceleration_mm_s2):
    """Path (N, 3) of a spiral, and accelerations (n, 3) at its points under the trapezoidal profile.

    They are those of `rrru.campaign.plan.make_run`, from the derivatives of the spiral itself.
    """
    share = np.linspace(0.0, 1.0, (count - 1) * _ARC_STEPS + 1)
    (inner, outer), (low, high), wave = shape["radius_mm"], shape["z_mm"], 2.0 * np.pi * shape["turns"]
    angle, radius = np.radians(shape["start_deg"]) + wave * share, inner + (outer - inner) * share
    level = np.zeros_like(share)
    outward = np.stack([np.cos(angle), np.sin(angle), level], axis=-1)
    around = np.stack([-outward[:, 1], outward[:, 0], level], axis=-1)
    place = radius[:, None] * outward
    first = (outer - inner) * outward + (wave * radius)[:, None] * around
    place += np.stack(
        [shape["centre_mm"][0] + level, shape["centre_mm"][1] + level, low + (high - low) * share], axis=-1
    )
    first[:, 2] = high - low
    stretch = np.sqrt((first**2).sum(axis=1))
    arc = np.concatenate([[0.0], np.cumsum(0.5 * (stretch[1:] + stretch[:-1]))]) * share[1]
    at = slice(None, None, _ARC_STEPS)
    first, stretch = first[at], stretch[at, None]
    second = 2.0 * (outer - inner) * wave * around[at] - (wave**2 * radius[at])[:, None] * outward[at]
    profile, tangent = Trapezoid(arc[-1], speed_mm_s, acceleration_mm_s2), first / stretch
    time = profile.time(arc[at])
    across = second - (second * tangent).sum(axis=1, keepdims=True) * tangent
    along = profile.acceleration(time)[:, None] * tangent
    return place[:: _ARC_STEPS // PATH_STEPS], along + profile.speed(time)[:, None] ** 2 * across / stretch**2


def cost(values, task):
    """Misfit in nat of searched values, in the order of the task's bounds; a large number where it cannot be driven."""
    try:
        value = misfit(*simulate(task, _twin(values, task)), task.weights)
    except NOT_DRIVEN:
        return WORST
    return value if np.isfinite(value) else WORST


def residuals(values, task, tolerance):
    """Residuals (m,) of searched values, see `twin_objective.residuals`; NaN where they cannot be driven."""
    try:
        return twin_objective.residuals(*simulate(task, _twin(values, task)), task.weights, tolerance)
    except NOT_DRIVEN:
        return np.full(2 * len(ERRORS_MM) + _GROUP_ORDERS + 2 * task.spikes, np.nan)


def _twin(values, task):
    """The Twin of searched values."""
    return Twin(dict(zip(task.bounds, np.asarray(values).tolist(), strict=True)))
