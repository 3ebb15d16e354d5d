"""The methods: each gives a controller from measured points, from positions in the order driven to actuators.

Lengths in mm.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from rrru.calibration.calibrate import calibrate
from rrru.campaign import measurements as rows
from rrru.compensation.jacobian import through_inverse, through_jacobian
from rrru.compensation.rbf import choose, fit, grow, make_folds
from rrru.estimation.observations.target_positions import TargetPositions

# what each method needs to measure
NEEDS = {
    "zero_offsets": "positions, or anything that shows them: distances, heights, images",
    "least_squares": "positions",
    "least_squares_full": "positions",
    "genetic": "positions",
    "rbf_map": "positions, dense in the region of use",
    "rbf_after_parameters": "positions, dense in the region of use",
    "jacobian_step": "position at every target itself, again after every change",
    "zero_offsets_images": "camera images of a dot target; no tracker",
}


@dataclass(frozen=True)
class Learned:
    """A controller, the number of its learned parameters, and of its model evaluations (points solved)."""

    controller: object
    numbers: int
    evaluations: int


@dataclass(frozen=True)
class Candidates:
    """Choices for networks: folds of the cross-validation, most neurons, spreads in units of the points' spacing."""

    folds: int
    neurons: int
    spreads: tuple


def measured_points(mechanism, measurements):
    """TargetPositions of the usable points of a measurement table; methods choose what is fitted to them."""
    frame = measurements[rows.usable(measurements)]
    return TargetPositions(mechanism, rows.actuators(frame, mechanism), rows.measured(frame), rows.command(frame))


def _with(points, parameter_set):
    """The points with a set of parameters to fit."""
    return replace(points, mechanism=replace(points.mechanism, parameter_set=parameter_set))


def _calibrated(points, result):
    """The Learned controller of a search for the deviations of the points' mechanism."""
    controller = partial(points.mechanism.inverse, deviations=result.deviations)
    return Learned(controller, len(result.deviations), result.evaluations * len(points))


def parameters(points, parameter_set):
    """Least squares of a set of parameters, their bounds those of the mechanism."""
    points = _with(points, parameter_set)
    return _calibrated(points, calibrate(points))


def genetic(points, settings, seed):
    """The genetic algorithm with GeneticSettings on the parameters that tracked positions identify."""
    from rrru.genetic.algorithm import minimise

    points = _with(points, points.mechanism.TRACKED)
    bounds = points.mechanism.parameters
    return _calibrated(points, minimise(points.mean_distance, bounds.low, bounds.high, settings, seed))


def rbf_map(points, candidates, generator):
    """A network for the position error, through the exact inverse kinematics (paper B, eq. 11)."""
    answers, numbers = _trained(points.start_mm, points.measured_mm - points.start_mm, candidates, generator)
    return Learned(lambda path: through_inverse(points.mechanism, path, answers(path)), numbers, 0)


def rbf_after_parameters(points, candidates, generator):
    """Least squares, then a network for its residuals."""
    points = _with(points, points.mechanism.TRACKED)
    found = calibrate(points)
    answers, numbers = _trained(points.start_mm, points.residual(found.deviations), candidates, generator)
    return Learned(
        lambda path: through_inverse(points.mechanism, path, answers(path), found.deviations),
        numbers + len(found.deviations),
        found.evaluations * len(points),
    )


def jacobian_step(points, path_index):
    """One step of q - J dp at every target by its own measured error (paper B, eq. 12 without a network).

    path_index (m,): rows of the targets in the path that the controller is given; between them the correction is
    interpolated.
    """
    error = points.measured_mm - points.start_mm

    def controller(path):
        along = np.stack([np.interp(np.arange(len(path)), path_index, error[:, axis]) for axis in range(3)], axis=-1)
        return through_jacobian(points.mechanism, path, along)

    return Learned(controller, 3 * len(path_index), len(path_index))


def offsets(mechanism, values):
    """The controller with drive offsets (3,) from another measurement."""
    zero = replace(mechanism, parameter_set="zero")
    return Learned(partial(zero.inverse, deviations=np.asarray(values, dtype=float)), 3, 0)


def position_methods(points, candidates, genetic_settings, generator, seed):
    """Every method that learns from measured positions, as functions without arguments, by name."""
    tracked, full = points.mechanism.TRACKED, points.mechanism.RICHEST
    methods = {
        "zero_offsets": lambda: parameters(points, "zero"),
        "least_squares": lambda: parameters(points, tracked),
        "least_squares_full": lambda: parameters(points, full),
        "genetic": lambda: genetic(points, genetic_settings, seed),
        "rbf_map": lambda: rbf_map(points, candidates, generator("folds")),
        "rbf_after_parameters": lambda: rbf_after_parameters(points, candidates, generator("folds")),
    }
    return {name: learn for name, learn in methods.items() if full != tracked or name != "least_squares_full"}


def _trained(command_mm, targets, candidates, generator):
    """Network of the least cross-validated error, and the count of its weights and thresholds."""
    folds = make_folds(len(command_mm), candidates.folds, generator)
    # candidates in units of the distance of evenly spread points
    spacing = (np.prod(np.ptp(command_mm, axis=0)) / len(command_mm)) ** (1.0 / 3.0)
    most = min(candidates.neurons, len(command_mm) - len(command_mm) // candidates.folds - 1)
    choice = choose(command_mm, targets, [share * spacing for share in candidates.spreads], most, folds)
    order = grow(command_mm, targets, choice.spread_mm, choice.neurons).order
    return fit(command_mm, targets, choice.spread_mm, order), 3 * (len(order) + 1)
