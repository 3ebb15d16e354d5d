"""The methods: each learns from measured points and becomes a controller, positions in the order driven to actuators.

Lengths in mm.
"""

from dataclasses import dataclass, replace

import numpy as np

from rrru.campaign import measurements as rows
from rrru.compensate.jacobian import through_inverse, through_jacobian
from rrru.compensate.rbf import fit, grow, make_folds, validation_mse
from rrru.fit.least_squares import least_squares
from rrru.fit.residuals import Residuals

# the richest set of parameters that positions identify
FULL = {"rrru3": "identifiable", "ptt3": "rails", "delta": "legs"}
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
    """A controller, how many numbers it learned and how often the model was evaluated, in points solved."""

    controller: object
    numbers: int
    evaluations: int


@dataclass(frozen=True)
class Network:
    """How networks are chosen: folds of the cross-validation, most neurons, spreads in units of the points' spacing."""

    folds: int
    neurons: int
    spreads: tuple


@dataclass(frozen=True)
class Points:
    """What was measured: mechanism and commanded, actuator and measured values (n, 3) each."""

    mechanism: object
    command_mm: np.ndarray
    actuators: np.ndarray
    measured_mm: np.ndarray

    @classmethod
    def of(cls, mechanism, measurements):
        """The usable points of a measurement table."""
        frame = measurements[rows.usable(measurements)]
        return cls(mechanism, rows.command(frame), rows.actuators(frame), rows.measured(frame))

    def residuals(self, parameter_set):
        """Residuals of the points for a set of parameters."""
        mechanism = replace(self.mechanism, parameter_set=parameter_set)
        return Residuals(mechanism, self.actuators, self.measured_mm, self.command_mm)


def _calibrated(residuals, result):
    """What a search for deviations has learned."""
    mechanism, deviations = residuals.mechanism, result.deviations
    controller = lambda path: mechanism.inverse(path, deviations)  # noqa: E731
    return Learned(controller, len(deviations), result.evaluations * len(residuals))


def parameters(points, parameter_set):
    """Least squares of a set of parameters, their bounds those of the mechanism."""
    residuals = points.residuals(parameter_set)
    return _calibrated(residuals, least_squares(residuals))


def genetic(points, settings, seed):
    """The genetic algorithm with GeneticSettings on the parameters that tracked positions identify."""
    from rrru.genetic.algorithm import minimise

    residuals = points.residuals(points.mechanism.TRACKED)
    bounds = residuals.mechanism.parameters
    return _calibrated(residuals, minimise(residuals.mean_distance, bounds.low, bounds.high, settings, seed))


def rbf_map(points, network, generator):
    """A network for the position error, through the exact inverse kinematics (paper B, eq. 11)."""
    answers, numbers = _trained(points.command_mm, points.measured_mm - points.command_mm, network, generator)
    return Learned(lambda path: through_inverse(points.mechanism, path, answers(path)), numbers, 0)


def rbf_after_parameters(points, network, generator):
    """Least squares first, then a network for what it leaves."""
    residuals = points.residuals(points.mechanism.TRACKED)
    found = least_squares(residuals)
    answers, numbers = _trained(points.command_mm, residuals.residual(found.deviations), network, generator)
    return Learned(
        lambda path: through_inverse(residuals.mechanism, path, answers(path), found.deviations),
        numbers + len(found.deviations),
        found.evaluations * len(residuals),
    )


def jacobian_step(points, path_index):
    """One step of q - J dp at every target by its own measured error (paper B, eq. 12 without a network).

    path_index (m,): rows of the targets in the path that the controller is given; between them the correction is
    interpolated.
    """
    error = points.measured_mm - points.command_mm

    def controller(path):
        along = np.stack([np.interp(np.arange(len(path)), path_index, error[:, axis]) for axis in range(3)], axis=-1)
        return through_jacobian(points.mechanism, path, along)

    return Learned(controller, 3 * len(path_index), len(path_index))


def offsets(mechanism, values):
    """Drive offsets (3,) that another measurement has found."""
    zero = replace(mechanism, parameter_set="zero")
    return Learned(lambda path: zero.inverse(path, np.asarray(values, dtype=float)), 3, 0)


def position_methods(points, network, genetic_settings, generator, seed):
    """Every method that learns from measured positions, as functions without arguments, by name."""
    tracked, full = points.mechanism.TRACKED, FULL[points.mechanism.name]
    methods = {
        "zero_offsets": lambda: parameters(points, "zero"),
        "least_squares": lambda: parameters(points, tracked),
        "least_squares_full": lambda: parameters(points, full),
        "genetic": lambda: genetic(points, genetic_settings, seed),
        "rbf_map": lambda: rbf_map(points, network, generator("folds")),
        "rbf_after_parameters": lambda: rbf_after_parameters(points, network, generator("folds")),
    }
    return {name: learn for name, learn in methods.items() if full != tracked or name != "least_squares_full"}


def _trained(command_mm, targets, network, generator):
    """Network of the least cross-validated error, and the count of its weights and thresholds."""
    folds = make_folds(len(command_mm), network.folds, generator)
    # candidates in units of the distance that evenly spread points have
    spacing = (np.prod(np.ptp(command_mm, axis=0)) / len(command_mm)) ** (1.0 / 3.0)
    spreads = [share * spacing for share in network.spreads]
    most = min(network.neurons, len(command_mm) - len(command_mm) // network.folds - 1)
    curves = np.array([validation_mse(command_mm, targets, spread, most, folds) for spread in spreads])
    best, neurons = np.unravel_index(curves.argmin(), curves.shape)
    order = grow(command_mm, targets, spreads[best], int(neurons)).order
    return fit(command_mm, targets, spreads[best], order), 3 * (len(order) + 1)
