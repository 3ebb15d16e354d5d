"""The methods: each learns from measured points and becomes a controller, positions in the order driven to actuator
values. Lengths in mm.
"""

from dataclasses import dataclass, replace

import numpy as np

from rrru.campaign import measurements as rows
from rrru.compensate.jacobian import through_inverse, through_jacobian
from rrru.compensate.rbf import fit, grow, make_folds, validation_mse
from rrru.fit.least_squares import least_squares
from rrru.fit.residuals import Residuals
from rrru.genetic.algorithm import minimise
from rrru.genetic.campaign_runs import settings_from_config
from rrru.studies.methods.benches import FULL

# what each method fits or learns, how many numbers, and what it needs to measure
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
class Points:
    """What was measured: mechanism and commanded, actuator and measured values (n, 3) each."""

    mechanism: object
    command_mm: np.ndarray
    actuators: np.ndarray
    measured_mm: np.ndarray

    def residuals(self, parameter_set):
        """Residuals of the points for a set of error parameters."""
        return Residuals(
            replace(self.mechanism, parameter_set=parameter_set), self.actuators, self.measured_mm, self.command_mm
        )


def points_of(mechanism, measurements):
    """The usable points of a measurement table."""
    frame = measurements[rows.usable(measurements)]
    return Points(mechanism, rows.command(frame), rows.actuators(frame), rows.measured(frame))


def parameters(points, parameter_set):
    """Least squares of a set of error parameters, their bounds those of the mechanism."""
    residuals = points.residuals(parameter_set)
    found = least_squares(residuals)
    mechanism = residuals.mechanism
    return Learned(
        lambda path: mechanism.inverse(path, found.deviations),
        len(found.deviations),
        found.evaluations * len(residuals),
    )


def genetic(points, config, seed):
    """The genetic algorithm of the configuration's `genetic` section on the identifiable error parameters."""
    residuals = points.residuals(points.mechanism.TRACKED)
    mechanism = residuals.mechanism
    found = minimise(
        residuals.mean_distance,
        mechanism.parameters.low,
        mechanism.parameters.high,
        settings_from_config(config["genetic"]),
        seed,
    )
    return Learned(
        lambda path: mechanism.inverse(path, found.deviations),
        len(found.deviations),
        found.evaluations * len(residuals),
    )


def rbf_map(points, section, generator):
    """A network for the position error, through the exact inverse kinematics (paper B, eq. 11)."""
    network, numbers = _network(points.command_mm, points.measured_mm - points.command_mm, section, generator)
    return Learned(lambda path: through_inverse(points.mechanism, path, network(path)), numbers, 0)


def rbf_after_parameters(points, section, generator):
    """Least squares first, then a network for what it leaves."""
    residuals = points.residuals(points.mechanism.TRACKED)
    found, mechanism = least_squares(residuals), residuals.mechanism
    network, numbers = _network(points.command_mm, residuals.residual(found.deviations), section, generator)
    return Learned(
        lambda path: through_inverse(mechanism, path, network(path), found.deviations),
        numbers + len(found.deviations),
        found.evaluations * len(residuals),
    )


def jacobian_step(mechanism, path_index, points):
    """One step of q - J dp at every target by itself, its own error having been measured (paper B, eq. 12 without a
    network).

    path_index (m,): rows of the targets in the path that the controller is given; between them the correction is
    interpolated.
    """

    def controller(path):
        error = points.measured_mm - points.command_mm
        along = np.stack([np.interp(np.arange(len(path)), path_index, error[:, axis]) for axis in range(3)], axis=-1)
        return through_jacobian(mechanism, path, along)

    return Learned(controller, 3 * len(path_index), len(path_index))


def offsets(mechanism, values):
    """Drive offsets (3,) that another measurement has found."""
    zero = replace(mechanism, parameter_set="zero")
    return Learned(lambda path: zero.inverse(path, np.asarray(values, dtype=float)), 3, 0)


def position_methods(points, config, generator, seed):
    """Every method that learns from measured positions, as functions without arguments, by name."""
    section, mechanism = config["methods"]["network"], points.mechanism
    return {
        "zero_offsets": lambda: parameters(points, "zero"),
        "least_squares": lambda: parameters(points, mechanism.TRACKED),
        **(
            {"least_squares_full": lambda: parameters(points, FULL[mechanism.name])}
            if FULL[mechanism.name] != mechanism.TRACKED
            else {}
        ),
        "genetic": lambda: genetic(points, config, seed),
        "rbf_map": lambda: rbf_map(points, section, generator("folds")),
        "rbf_after_parameters": lambda: rbf_after_parameters(points, section, generator("folds")),
    }


def _network(command_mm, targets, section, generator):
    """Network with the spread and the number of neurons of least cross-validated error, and the count of its weights
    and thresholds.
    """
    folds = make_folds(len(command_mm), section["folds"], generator)
    # candidates in units of the distance that evenly spread points have
    spacing = (np.prod(np.ptp(command_mm, axis=0)) / len(command_mm)) ** (1.0 / 3.0)
    spreads = [share * spacing for share in section["spreads"]]
    most = min(section["neurons"], len(command_mm) - len(command_mm) // section["folds"] - 1)
    curves = np.array([validation_mse(command_mm, targets, spread, most, folds) for spread in spreads])
    best, neurons = np.unravel_index(curves.argmin(), curves.shape)
    order = grow(command_mm, targets, spreads[best], int(neurons)).order
    return fit(command_mm, targets, spreads[best], order), 3 * (len(order) + 1)
