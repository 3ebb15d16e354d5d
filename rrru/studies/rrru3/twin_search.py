"""Search for a twin whose errors come as near as they can to the numbers that paper A prints.

Searched: the 7 identifiable geometry errors, clearance and play per leg, a periodic drive error (amplitude and phase
per leg, whole number of periods per turn), non-repeating wobble, the line groups' spacing and the spiral's shape.
Nothing else: no number of the paper is fed into the simulation. For speed the search solves eq. (8) with clearance to
first order, which equals the spatial closure to micrometres as long as the axes are ideal, and calibrates on a
linearised model, which is true to hundredths of a millimetre; what it finds is then run and calibrated like every other
campaign. Lengths in mm, angles in rad.
"""

from dataclasses import replace
from functools import cache

import numpy as np
from scipy.optimize import differential_evolution

from rrru.campaign.plan import Plan, make_run
from rrru.campaign.trajectories import line_groups
from rrru.effects.effect import Contribution
from rrru.errors import ConfigError, FitError, UnreachableError
from rrru.fit.identifiability import RANK_TOLERANCE
from rrru.plant.virtual_robot import VirtualRobot, non_repeatability
from rrru.robots import singularity
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


class TranslationalRobot(VirtualRobot):
    """The same robot solved on eq. (8): only for ideal axes, where the platform does not turn."""

    def positions(self, motion, target):
        """Platform centres (n, 3); clearance to first order."""
        change = sum((effect.contribute(motion) for effect in self.effects), Contribution())
        drive = motion.drive + change.drive
        deviations = self.mechanism.parameters.vector(
            {k: v for k, v in self.deviations.items() if k != "dr"} | {"da": self.deviations["dr"]}
        )
        solved = self.mechanism.forward(drive, deviations, target)
        along = np.einsum(
            "nlk,nlk->nl", motion.force_direction, np.broadcast_to(change.joint_mm, motion.force_direction.shape)
        )
        return solved + np.linalg.solve(motion.force_direction, along[..., None])[..., 0], np.zeros(len(target))


def draw(generator, count):
    """Random numbers of one drive in the order in which a virtual robot draws them: unit wobble (count, 3) and unit
    noise (count, 3).
    """
    return non_repeatability(generator, count), generator.standard_normal((count, 3))


def simulate(mechanism, twin, noise_mm, draws, line_calibration="group_1", kind=TranslationalRobot):
    """Numbers and order margins of a candidate: calibrate on lines and on the spiral, drive the corrected commands,
    compare.

    draws: see `draw`, for the measurement and for the drives with corrected commands; line_calibration: one of
    LINE_CALIBRATIONS. Raises UnreachableError or FitError where the candidate cannot be driven or calibrated.
    """
    if line_calibration not in LINE_CALIBRATIONS:
        raise ConfigError(f"twin: line calibration is {line_calibration!r}; allowed: {', '.join(LINE_CALIBRATIONS)}")
    plan = _plan(twin)
    target = plan.targets()
    theta = mechanism.require_reachable(target)
    trajectory = np.concatenate([np.full(len(run.points_mm), run.trajectory) for run in plan.runs])
    curve = trajectory == "spiral"
    margin = min(
        singularity.translational_measure(mechanism, target[curve], theta[curve]).min(),
        singularity.constraint_measure(mechanism, target[curve], theta[curve]).min(),
    )
    if margin < SPIRAL_MARGIN:
        raise UnreachableError(f"the spiral comes within {margin:.3f} of a singularity; allowed: {SPIRAL_MARGIN}")
    robot = twin.robot(mechanism, kind)

    def drive(controller, drawn):
        position, _ = robot.positions(robot.motion(plan, controller), target)
        return position + robot.non_repeatability_mm * drawn[0] + noise_mm * drawn[1]

    measured = drive(mechanism.inverse, draws[0])
    fits = {}
    for name, chosen in (
        ("lines", trajectory == "line_1" if line_calibration == "group_1" else ~curve),
        ("spiral", curve),
    ):
        fits[name] = _linear_fit(mechanism, theta[chosen], measured[chosen], target[chosen])
    lines, spiral = (
        drive(lambda x, e=fits[name][0]: mechanism.inverse(x, e), draws[1]) - target for name in ("lines", "spiral")
    )
    numbers = study_numbers(trajectory, measured - target, lines, spiral) | {"lines_objective": fits["lines"][1]}
    return numbers, group_orders(trajectory, measured - target, lines)


@cache
def _line_run(start_mm, end_mm):
    """Run along the first line; the other groups' are the same, shifted."""
    return make_run(line_groups(start_mm, end_mm, (0.0,), 26)[0], 80.0, 40.0)


def _plan(twin):
    """Plan of a candidate: seven lines and the spiral, each once."""
    *lines, spiral = twin.trajectories()
    base = _line_run(lines[0].start_mm, lines[0].end_mm)
    runs = []
    for line in lines:
        shift = np.subtract(line.start_mm, lines[0].start_mm)
        runs.append(replace(base, trajectory=line.name, points_mm=base.points_mm + shift, path_mm=base.path_mm + shift))
    return Plan((*runs, make_run(spiral, 80.0, 40.0)), 60.0)


def _linear_fit(mechanism, theta, measured, start):
    """Errors (p,) of least mean distance and the minimum, on the model linearised at its least-squares errors.

    Raises FitError where the iteration leaves the reach.
    """
    deviations = mechanism.parameters.nominal
    for _ in range(3):
        residual = measured - mechanism.forward(theta, deviations, start)
        jacobian = mechanism.parameter_jacobian(measured - residual, theta, deviations)
        if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
            raise FitError("the candidate's calibration leaves the reach")
        flat = jacobian.reshape(-1, jacobian.shape[-1])
        step = np.linalg.lstsq(flat, residual.ravel(), rcond=RANK_TOLERANCE)[0]
        deviations = deviations + step
    residual = residual - jacobian @ step
    # damped Newton on the mean distance of the linear model
    width, q = np.linalg.qr(flat), np.zeros(len(deviations))
    basis = width.Q.reshape(jacobian.shape)
    value = np.linalg.norm(residual, axis=1).mean()
    for _ in range(30):
        now = residual - basis @ q
        distance = np.maximum(np.linalg.norm(now, axis=1), 1e-9)
        along = np.einsum("na,nap->np", now / distance[:, None], basis)
        scaled, along_scaled = (
            (basis / np.sqrt(distance)[:, None, None]).reshape(flat.shape),
            along / np.sqrt(distance)[:, None],
        )
        newton = np.linalg.solve(scaled.T @ scaled - along_scaled.T @ along_scaled, along.sum(axis=0))
        size = 1.0
        while size > 1e-3 and np.linalg.norm(residual - basis @ (q + size * newton), axis=1).mean() > value:
            size *= 0.5
        if size <= 1e-3:
            break
        q = q + size * newton
        previous, value = value, np.linalg.norm(residual - basis @ q, axis=1).mean()
        if previous - value < 1e-10:
            break
    return deviations + np.linalg.solve(width.R, q), value


def misfit(numbers, orders):
    """How far a candidate is from the paper: what exceeds a deviation of 8 %, in units of 7 %, to the fourth power, and
    broken orders.

    A deviation of 15 % counts 1. An order counts as broken while its margin is below 1.5 %, and 9 where it is none.
    """
    total = 0.0
    for item, published in ERRORS_MM.items():
        ratio = numbers[item] / published
        deviation = max(ratio - 1.0, 0.0) if item in UPPER_LIMITS else abs(ratio - 1.0)
        total += min(max(deviation - 0.08, 0.0) / 0.07, 40.0) ** 4
    return total + sum((max(0.015 - margin, 0.0) / 0.005) ** 2 for margin in orders.values())


def cost(vector, mechanism, noise_mm, draws, line_calibration):
    """Misfit of a search vector; a large number for candidates that cannot be driven."""
    try:
        value = misfit(
            *simulate(mechanism, Twin(dict(zip(SEARCH_BOUNDS, vector, strict=True))), noise_mm, draws, line_calibration)
        )
    except (UnreachableError, FitError, np.linalg.LinAlgError):
        return _WORST
    return value if np.isfinite(value) else _WORST


def search(
    mechanism, noise_mm, draws, line_calibration, seed, generations, population, start=None, workers=1, callback=None
):
    """Differential evolution over SEARCH_BOUNDS; returns (Twin, misfit). The same seed gives the same twin on any
    number of workers.

    noise_mm, draws, line_calibration: see `simulate`; population: candidates per searched number; start: a Twin to
    refine, around which the first generation is drawn, or None for the whole of the bounds; callback: scipy's, called
    with each generation's intermediate result.
    """
    generator = np.random.default_rng(seed)
    first = "latinhypercube" if start is None else _around(start, population * len(SEARCH_BOUNDS), generator)
    result = differential_evolution(
        cost,
        list(SEARCH_BOUNDS.values()),
        args=(mechanism, noise_mm, draws, line_calibration),
        maxiter=generations,
        popsize=population,
        mutation=(0.4, 0.9),
        recombination=0.8,
        rng=generator,
        init=first,
        updating="deferred",
        polish=False,
        tol=0.0,
        workers=workers,
        callback=callback,
    )
    return Twin(dict(zip(SEARCH_BOUNDS, result.x.tolist(), strict=True))), float(result.fun)


def _around(start, count, generator):
    """First generation (count, number of searched values) about a twin, which is its first member."""
    low, high = np.array(list(SEARCH_BOUNDS.values())).T
    centre = np.array([start.values[name] for name in SEARCH_BOUNDS])
    spread = _REFINE_SPREAD * (high - low) * generator.standard_normal((count, len(low)))
    spread[0] = 0.0
    return np.clip(centre + spread, low, high)
