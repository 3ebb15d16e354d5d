"""Search for a twin whose errors come as near as they can to the numbers that paper A prints.

Searched: the 7 identifiable geometry errors, clearance and play per leg, a periodic drive error (amplitude and phase
per leg, whole number of periods per turn), non-repeatability, the line groups' spacing and the spiral's shape.
Nothing else: no number of the paper is fed into the simulation. For speed the search solves eq. (8) with clearance to
first order, which equals the spatial closure to micrometres as long as the axes are ideal, and calibrates on a
linearised model, which is true to hundredths of a millimetre; what it finds is then run and calibrated like every other
campaign. Lengths in mm, angles in rad.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from rrru.campaign.plan import Plan, make_run
from rrru.effects.protocol import together
from rrru.errors import ConfigError, FitError, UnreachableError
from rrru.plant.virtual_robot import VirtualRobot, non_repeatability
from rrru.robots import singularity
from rrru.robots.rrru3 import Rrru3
from rrru.studies.rrru3.linear_fit import linear_fit
from rrru.studies.rrru3.paper import ERRORS_MM
from rrru.studies.rrru3.study_numbers import UPPER_LIMITS, group_orders, study_numbers
from rrru.studies.rrru3.twin import SEARCH_BOUNDS, Twin

# the spiral keeps clear of both singularities by this margin of the measures
SPIRAL_MARGIN = 0.1
# ASSUME the paper does not say which lines Table 5 was fitted on: "group_1" (26 points) or "lines" (all seven groups)
LINE_CALIBRATIONS = ("group_1", "lines")
# a refinement starts this share of the bounds' width about its twin, 1 sigma
_REFINE_SPREAD = 0.02
_WORST = 1e6
_line_run = cache(make_run)


class TranslationalRobot(VirtualRobot):
    """The same robot solved on eq. (8): only for ideal axes, where the platform does not turn."""

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
    """What every candidate is driven through and calibrated with.

    motion, trajectories: sections of the configuration; draws: see `draw`, for the measurement and for the drives with
    corrected commands; line_calibration: one of LINE_CALIBRATIONS. Raises ConfigError for another one.
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
        # the first line is every candidate's, the other groups' are the same, shifted
        first, runs = _line_run(lines[0], speed, acceleration), []
        for line in lines:
            shift = np.subtract(line.start_mm, lines[0].start_mm)
            moved = {"points_mm": first.points_mm + shift, "path_mm": first.path_mm + shift}
            runs.append(replace(first, trajectory=line.name, **moved))
        return Plan((*runs, make_run(spiral, speed, acceleration)), self.motion["dwell_s"])


def draw(generator, count):
    """Unit non-repeatability and unit noise of one drive, (count, 3) each, in the order in which a robot draws them."""
    return non_repeatability(generator, count), generator.standard_normal((count, 3))


def simulate(task, twin, kind=TranslationalRobot):
    """Numbers and order margins of a candidate: calibrate on lines and spiral, drive the corrected commands, compare.

    Raises UnreachableError or FitError where the candidate cannot be driven or calibrated.
    """
    mechanism, plan = task.mechanism, task.plan(twin)
    target = plan.targets()
    theta = mechanism.require_reachable(target)
    trajectory = np.concatenate([np.full(len(run.points_mm), run.trajectory) for run in plan.runs])
    curve = trajectory == "spiral"
    _require_clear(mechanism, target[curve], theta[curve])
    robot = twin.robot(mechanism, kind)

    def drive(controller, drawn):
        position, _ = robot.positions(robot.motion(plan, controller), target)
        return position + robot.non_repeatability_mm * drawn[0] + task.noise_mm * drawn[1]

    measured = drive(mechanism.inverse, task.draws[0])
    calibrated = trajectory == "line_1" if task.line_calibration == "group_1" else ~curve
    fits = [linear_fit(mechanism, theta[rows], measured[rows], target[rows]) for rows in (calibrated, curve)]
    before, lines, spiral = (
        measured - target,
        *(
            drive(lambda x, deviations=deviations: mechanism.inverse(x, deviations), task.draws[1]) - target
            for deviations, _ in fits
        ),
    )
    numbers = study_numbers(trajectory, before, lines, spiral) | {"lines_objective": fits[0][1]}
    return numbers, group_orders(trajectory, before, lines)


def _require_clear(mechanism, position, theta):
    """Raise UnreachableError for a spiral near a singularity."""
    measures = (singularity.translational_measure, singularity.constraint_measure)
    margin = min(measure(mechanism, position, theta).min() for measure in measures)
    if margin < SPIRAL_MARGIN:
        raise UnreachableError(f"the spiral comes within {margin:.3f} of a singularity; allowed: {SPIRAL_MARGIN}")


def misfit(numbers, orders):
    """How far a candidate is from the paper: what exceeds a deviation of 8 %, in units of 7 %, to the fourth power.

    Broken orders add to it. A deviation of 15 % counts 1. An order counts as broken while its margin is below 1.5 %,
    and 9 where it is none.
    """
    total = 0.0
    for item, published in ERRORS_MM.items():
        ratio = numbers[item] / published
        deviation = max(ratio - 1.0, 0.0) if item in UPPER_LIMITS else abs(ratio - 1.0)
        total += min(max(deviation - 0.08, 0.0) / 0.07, 40.0) ** 4
    return total + sum((max(0.015 - margin, 0.0) / 0.005) ** 2 for margin in orders.values())


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

    section: the configuration's `twin`, whose population is per searched number; start: a Twin to begin around instead
    of anywhere. The same seed gives the same twin on any number of workers.
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
        init="latinhypercube" if start is None else _around(start, count, generator),
        updating="deferred",
        polish=False,
        tol=0.0,
        workers=workers,
        callback=callback,
    )
    return _twin(result.x), float(result.fun)


def _around(start, count, generator):
    """First generation (count, number of searched values) about a twin, which is its first member."""
    low, high = np.array(list(SEARCH_BOUNDS.values())).T
    centre = np.array([start.values[name] for name in SEARCH_BOUNDS])
    spread = _REFINE_SPREAD * (high - low) * generator.standard_normal((count, len(low)))
    spread[0] = 0.0
    return np.clip(centre + spread, low, high)
