"""Search for a twin whose errors are as near as possible to the numbers that paper A prints.

Searched: the 7 identifiable geometry errors, clearance and backlash per leg, a periodic drive error (amplitude and
phase per leg, whole number of periods per turn), non-repeatability, the line groups' spacing and the spiral's shape.
No number of the paper enters the simulation. The comparison uses the median over draws of non-repeatability and noise,
so that the result does not depend on a single draw. For speed the search solves eq. (8) with clearance to first order,
which agrees with the spatial closure to micrometres for ideal axes. It calibrates on a linearised model, which is
accurate to hundredths of a millimetre where it was calibrated. The result is then run and calibrated like every other
campaign. Lengths in mm, angles in rad.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from rrru.campaign.plan import Plan, make_run
from rrru.effects.protocol import together
from rrru.errors import ConfigError, FitError, UnreachableError
from rrru.kinematics import singularity
from rrru.robots.rrru3 import Rrru3
from rrru.simulation.driven import non_repeatability
from rrru.simulation.virtual_robot import VirtualRobot
from rrru.studies.rrru3 import study_numbers as numbers
from rrru.studies.rrru3.linear_fit import linear_fit
from rrru.studies.rrru3.paper import ERRORS_MM
from rrru.studies.rrru3.twin import SEARCH_BOUNDS, Twin

# least singularity measure on the spiral
SPIRAL_MARGIN = 0.1
# ASSUME the paper does not say which lines Table 5 was fitted on: "group_1" (26 points) or "lines" (all seven groups)
LINE_CALIBRATIONS = ("group_1", "lines")
_WORST = 1e6
_line_run = cache(make_run)


class TranslationalRobot(VirtualRobot):
    """The same robot solved on eq. (8): only for ideal axes, where the platform does not rotate."""

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

    motion, trajectories: sections of the configuration; draws: see `draw`; line_calibration: one of LINE_CALIBRATIONS.
    Raises ConfigError for another one.
    """

    mechanism: Rrru3
    motion: dict
    trajectories: dict
    noise_mm: float
    draws: tuple
    line_calibration: str = "group_1"

    def __post_init__(self):
        if self.line_calibration not in LINE_CALIBRATIONS:
            allowed = ", ".join(LINE_CALIBRATIONS)
            raise ConfigError(f"twin: line calibration is {self.line_calibration!r}; allowed: {allowed}")

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


def draw(generators, count):
    """Unit non-repeatability and unit noise of draws, two arrays (d, 2, count, 3), in the order a robot draws them.

    generators: (measuring, driving corrected commands) of each draw.
    """
    drawn = [[(non_repeatability(g, count), g.standard_normal((count, 3))) for g in pair] for pair in generators]
    return tuple(np.moveaxis(np.array(drawn), 2, 0))


def simulate(task, twin, kind=TranslationalRobot):
    """Numbers and order margins (d,) of a candidate by name: calibrate on lines and spiral, drive again, compare.

    Raises UnreachableError or FitError where the candidate cannot be driven or calibrated.
    """
    mechanism, plan = task.mechanism, task.plan(twin)
    target = plan.targets()
    theta = mechanism.require_reachable(target)
    trajectory = np.concatenate([np.full(len(run.points_mm), run.trajectory) for run in plan.runs])
    curve = trajectory == "spiral"
    _require_clear(mechanism, target[curve], theta[curve])
    robot = twin.robot(mechanism, kind)
    motion = robot.motion(plan, mechanism.inverse)
    measuring, again = np.moveaxis(robot.non_repeatability_mm * task.draws[0] + task.noise_mm * task.draws[1], 1, 0)
    measured = robot.positions(motion, target)[0] + measuring
    calibrated = trajectory == "line_1" if task.line_calibration == "group_1" else ~curve
    fits = [linear_fit(mechanism, theta[rows], measured[:, rows], target[rows]) for rows in (calibrated, curve)]
    lines, spiral = (_corrected(robot, plan, motion, deviations) + again - target for deviations, _ in fits)
    errors = measured - target, lines, spiral
    if not all(np.isfinite(errors_mm).all() for errors_mm in errors):
        raise UnreachableError("the candidate leaves its workspace")
    names = [mechanism.parameters.names.index(name) for name in numbers.LINKS]
    orders = numbers.group_orders(trajectory, *errors) | numbers.link_order(*(fit[:, names] for fit, _ in fits))
    return numbers.study_numbers(trajectory, *errors) | {"lines_objective": fits[0][1]}, orders


def _corrected(robot, plan, motion, deviations):
    """Positions (d, n, 3) attained with commands corrected by deviations (d, p), without random errors.

    Exact for the mean deviations of the draws, to first order about it. motion: of the nominal commands, whose loads
    are the same.
    """
    mechanism, target, mean = robot.mechanism, plan.targets(), deviations.mean(axis=0)
    path, index = plan.path()
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


def misfit(found, orders):
    """Misfit of a candidate: the sum of the fourth powers of deviations beyond 8 %, in units of 7 %.

    found, orders: numbers and margins (d,) by name, of which the medians count. A deviation of 15 % counts 1, one of
    22 % counts 16, and each further 7 % counts 4, so that unreachable numbers do not dominate. Orders add a penalty
    while their margin is below 1.5 %: 9 at zero margin, and little more for a negative one.
    """
    total = 0.0
    for item, published in ERRORS_MM.items():
        ratio = np.median(found[item]) / published
        deviation = max(ratio - 1.0, 0.0) if item in numbers.UPPER_LIMITS else abs(ratio - 1.0)
        off = max(deviation - 0.08, 0.0) / 0.07
        total += min(off, 2.0) ** 4 + 4.0 * max(off - 2.0, 0.0)
    short = [max(0.015 - np.median(margin), 0.0) / 0.005 for margin in orders.values()]
    return total + sum(min(lack, 3.0) ** 2 + 0.05 * max(lack - 3.0, 0.0) for lack in short)


def _twin(vector):
    """The Twin of a search vector."""
    return Twin(dict(zip(SEARCH_BOUNDS, np.asarray(vector).tolist(), strict=True)))


def cost(vector, task):
    """Misfit of a search vector; a large number for candidates that cannot be driven."""
    try:
        value = misfit(*simulate(task, _twin(vector)))
    except (UnreachableError, FitError, np.linalg.LinAlgError):
        return _WORST
    return value if np.isfinite(value) else _WORST


def search(task, section, start=None, workers=1, callback=None):
    """Differential evolution over SEARCH_BOUNDS; returns (Twin, misfit).

    section: the configuration's `twin`, whose population is per searched number; start: a Twin as the centre of the
    first generation, with a spread of `share` times the bounds' width (1 sigma), instead of the whole bounds. The same
    seed gives the same twin on any number of workers.
    """
    from scipy.optimize import differential_evolution

    generator = np.random.default_rng(section["seed"])
    count = section["population"] * len(SEARCH_BOUNDS)
    result = differential_evolution(
        cost,
        list(SEARCH_BOUNDS.values()),
        args=(task,),
        maxiter=section["generations"],
        popsize=section["population"],
        mutation=(0.4, 0.9),
        recombination=0.8,
        rng=generator,
        init="latinhypercube" if start is None else _around(start, count, section["share"], generator),
        updating="deferred",
        polish=False,
        tol=0.0,
        workers=workers,
        callback=callback,
    )
    return _twin(result.x), float(result.fun)


def _around(start, count, share, generator):
    """First generation (count, number of searched values) about a twin, which is its first member."""
    low, high = np.array(list(SEARCH_BOUNDS.values())).T
    centre = np.array([start.values[name] for name in SEARCH_BOUNDS])
    spread = share * (high - low) * generator.standard_normal((count, len(low)))
    spread[0] = 0.0
    return np.clip(centre + spread, low, high)
